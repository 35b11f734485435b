"""Initial parts that show nothing wrong, of a motion that nothing leads elsewhere: what was cut off is the evidence.

Records are cut where free runs take another course, since between two wells or at a jump a model with any error does
so sooner or later. A resonator without either cannot: where it leaves a record for good, something struck it there,
such as a stop that only the largest motion reaches. Then whole records are judged.

A spring with a cubic force jumps if its frequency shifts by 3 |k3| A^2 / (8 w) >= c / sqrt(3) at the amplitude A
(A. Nayfeh, D. Mook, Nonlinear Oscillations, 1979, section 4.1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.identification.scales import find_largest_displacement


def restore_evidence(first: NominalFit, ids: Sequence[str], false_claim_rate: float) -> NominalFit:
    """Return the fit of whole records where their initial parts hide what is wrong; itself otherwise.

    Args:
        first: The re-fitted nominal model.
        ids: Mechanisms that are searched.
        false_claim_rate: How often a cause may be claimed where there is none.
    """
    if not first.parted or first.whole is None or may_jump(first.nominal.simulation, first.problem):
        return first
    tested = run_residual_tests(first.nominal, first.problem, ids)
    if not tested.p_value > significance_level(first.problem, false_claim_rate):
        return first
    problem, nominal = first.whole
    return first._replace(problem=problem, nominal=nominal, notes=first.notes[:-1], parted=False)


def may_jump(simulation: Simulation, problem: Problem) -> bool:
    """Return whether the motion may go another way, between wells or at a jump; True where that is not known."""
    values = {one.name: one.value for one in simulation.parameters}
    known = values.keys() <= {"damping", "stiffness", "stiffness_cubic", "drive_gain"}
    stiffness, cubic = values.get("stiffness", 0.0), abs(values.get("stiffness_cubic", 0.0))
    if not known or simulation.mechanisms or not stiffness > 0.0:
        return True
    rate = math.sqrt(stiffness)
    shift = 3.0 * cubic * find_largest_displacement(problem.records, rate) ** 2 / (8.0 * rate)
    return shift > problem.thresholds.nominal_fit.jump_share * values.get("damping", 0.0) / math.sqrt(3.0)
