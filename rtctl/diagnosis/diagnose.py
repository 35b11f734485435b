"""From a dataset and today's model to the answer: refit, search, name, extend, measure."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.border.errors import InputError, RunError
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.answer import Cause, as_json, causes_of
from rtctl.diagnosis.extended_model import extended_model
from rtctl.diagnosis.gain import Gain, gain
from rtctl.diagnosis.gate import Examined
from rtctl.diagnosis.hypothesis import Data, fitted
from rtctl.diagnosis.place import Place, places
from rtctl.diagnosis.search import Search, search
from rtctl.diagnosis.verdict import verdict_of
from rtctl.identification.fit_record import FitRecord, fit_record
from rtctl.identification.output_error import threads
from rtctl.identification.scales import scales_of
from rtctl.measured.dataset import Dataset

STEPS_PER_PERIOD = 64.0
"""Of the fits: their errors cancel in the differences that are tested; the gain is measured at the full number."""
LEAST_SAMPLES = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class DiagnosisOptions:
    """What a user may choose."""

    false_claim_rate: float = 0.05
    threads: int = max(1, min(2, os.cpu_count() or 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """The answer and all that its page shows."""

    verdict: str
    causes: tuple[Cause, ...]
    gain: Gain | None
    where: tuple[Place, ...]
    search: Search
    data: Data
    tests: tuple[FitRecord, ...]
    model: ModelFile
    """Extended; without provenance."""
    warnings: tuple[str, ...] = field(default=())

    @property
    def json(self) -> dict[str, Any]:
        """The content of `diagnosis.json`."""
        where = [{"coordinate": place.coordinate, "share": place.share} for place in self.where]
        chosen = self.search.chosen
        extra = {
            "warnings": list(self.warnings),
            "tests": [test._asdict() for test in chosen.tests],
            "p_value": chosen.p_value,
        }
        return as_json(self.verdict, self.causes, self.gain, where, None, extra)


def diagnose(
    dataset: Dataset,
    model: ModelFile,
    simulation: Simulation,
    ids: Sequence[str],
    options: DiagnosisOptions | None = None,
    told: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """Diagnose `simulation` (of `model`) by the records of `dataset`. Raises InputError, RunError."""
    options = options or DiagnosisOptions()
    fit, tests, warnings = _split(dataset)
    with threads(options.threads) as executor:
        data = Data(
            records=fit, scales=scales_of(fit), executor=executor if len(fit) > 1 else None,
            steps_per_period=STEPS_PER_PERIOD,
        )  # fmt: skip
        told("the nominal model")
        already = tuple(mechanism.id for mechanism in simulation.mechanisms)
        nominal = fitted(data, simulation, already)
        if nominal is None:
            raise RunError(
                "the model diverges on these records: correct its parameters, or let rtctl identify find them"
            )
        found = search(data, nominal, ids, options.false_claim_rate, told)
        noise_cost = _noise_cost(found.chosen)
        verdict = verdict_of(found, noise_cost)
        causes = causes_of(found, noise_cost) if verdict in ("explained", "partly_explained") else []
        best = found.chosen if causes else found.nominal
        measured = gain(
            nominal.simulation, best.hypothesis.simulation, tests, dataset.units["displacement"],
            _noise_rms(found.chosen), data.scales.rate,
        )  # fmt: skip
    return Diagnosis(
        verdict=verdict, causes=tuple(causes), gain=measured, where=tuple(places(found.nominal)), search=found,
        data=data, tests=tests, model=extended_model(model, best, {}), warnings=tuple(warnings),
    )  # fmt: skip


def _split(dataset: Dataset) -> tuple[tuple[FitRecord, ...], tuple[FitRecord, ...], list[str]]:
    """Records to fit and to test on; where none is marked, the last one is held out, and that is said."""
    warnings: list[str] = []
    usable = [record for record in dataset.records if record.samples - record.ignore_first >= LEAST_SAMPLES]
    for record in dataset.records:
        if record not in usable:
            warnings.append(
                f"record {record.name} has fewer than {LEAST_SAMPLES} scored samples and was left out"
            )
    fit = [record for record in usable if record.use != "test"]
    tests = [record for record in usable if record.use == "test"]
    if not fit:
        raise InputError(f'{dataset.path}: no record with use = "fit" is long enough to diagnose')
    if not tests and len(fit) > 1:
        tests = [fit.pop()]
        warnings.append(
            f'no record has use = "test": {tests[0].name} was held out of the fit to measure the gain'
        )
    elif not tests:
        warnings.append("one record and no test record: the gain could not be measured")
    holds = dataset.holds
    return tuple(fit_record(r, holds) for r in fit), tuple(fit_record(r, holds) for r in tests), warnings


def _noise_rms(examined: Examined) -> float:
    """RMS of the displacement's noise by its model, in units."""
    length = 4096
    return float(np.sqrt(np.mean(examined.noise[0].power(length))))


def _noise_cost(examined: Examined) -> float:
    """Half the sum of squares that noise alone would leave, on the scale of the fits' cost."""
    hypothesis = examined.hypothesis
    projected = examined.projected
    excess = projected.residual / max(projected.samples - projected.rank, 1)
    return hypothesis.cost / max(excess, 1.0)
