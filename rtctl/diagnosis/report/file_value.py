"""An adequate answer whose only gap is one value of the model file: it is explained by that value."""

from __future__ import annotations

from dataclasses import replace

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.report.causes import wrong_value_cause
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.verification.wald_test import find_wrong_value
from rtctl.diagnosis.verification.whole_record_fits import Fits, HoldoutData, extend_model


def explain_by_file_value(
    answer: Diagnosis, request: SearchRequest, given: Simulation, holdout: HoldoutData
) -> Diagnosis:
    """Return an adequate answer as it is, or explained by the one value of the model file that is wrong."""
    problem, model = answer.problem, request.model
    rate, spreads = request.options.false_claim_rate, problem.subject.relative_errors(model)
    wrong = find_wrong_value(problem, given, spreads, answer.search.nominal, rate)
    if wrong is None:
        return answer
    fits = Fits(wrong.given, wrong.revised)
    return replace(
        answer, verdict="explained", causes=(wrong_value_cause(wrong, problem.thresholds.report),), fits=fits,
        gain=holdout.gain_of(fits, problem.subject.output),
        model=extend_model(problem, model, wrong.revised),
    )  # fmt: skip
