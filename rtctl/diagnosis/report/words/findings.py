"""What a fitted model says of the device, for the top of an answer: its main figures, and what makes it nonlinear."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.border.mechanisms import plain_unit
from rtctl.border.statistics import NORMAL_95
from rtctl.diagnosis.problem.statement import state_mechanism
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.result import ERROR, Cause, Diagnosis
from rtctl.models.derived.oscillator import HARDENING, SOFTENING
from rtctl.models.derived.quantity import Derived
from rtctl.output.readable_units import readable, with_standard_error

MAIN = ("natural frequency", "damping ratio", "time constant of the speed", "steady speed per drive")
"""Beginnings of the names of the quantities that stand on top."""
CERTAIN = ("adequate", "explained")
"""Verdicts after which the model lacks nothing that the data show."""
SHARES = (
    "The shares of the error are of its squares above the noise, and a cause counts for what it removes beside those "
    "that remove more: "
)
SHARES_ADD_UP = "nothing counts twice."
SHARES_OVERLAP = "they overlap, since each of two causes may take up what the other would."
SHARE_OF_REST = (
    "A share of what is left then is no part of the others: it is of the error that the other causes leave."
)
MOST_OF_ALL = 1.005
"""Largest sum of shares of one whole, as far as they are rounded."""
CUBIC = "stiffness_cubic"
DOUBTED = " (the model lacks something, so these values may be off by more)"

SAME_LAW = (
    "{names} are the same law in every record: nothing but knowledge of the bench decides between them."
)
NOT_TOLD = "These data cannot tell it from {names}."


def doubts_of(cause: Cause) -> list[str]:
    """Return the sentences on what could stand in place of a cause: one law by construction, or these data decide."""
    said = []
    if cause.same_law:
        said.append(SAME_LAW.format(names=" and ".join((cause.id, *cause.same_law))))
    if cause.rivals:
        said.append(NOT_TOLD.format(names=", ".join(cause.rivals)))
    return said


def main_quantities(derived: tuple[Derived, ...]) -> list[Derived]:
    """Return the quantities that stand on top of an answer."""
    return [one for one in derived if one.name.startswith(MAIN)]


def describe_shares(causes: Sequence[Cause]) -> str:
    """Return what the shares of several causes without a probability are shares of; "" where one or none is told."""
    told = [one for one in causes if one.probability is None]
    of_error = [one.share_removed for one in told if one.share_of == ERROR]
    if len(told) < 2:
        return ""
    of_rest = SHARE_OF_REST if len(of_error) < len(told) else ""
    if len(of_error) < 2:
        return of_rest
    parts = SHARES_OVERLAP if sum(of_error) > MOST_OF_ALL else SHARES_ADD_UP
    return " ".join(filter(None, [SHARES + parts, of_rest]))


def describe_main_quantities(diagnosis: Diagnosis) -> str:
    """Return natural frequency and damping ratio with their standard errors; "" where the model has none."""
    said = "; ".join(with_error(one) for one in main_quantities(diagnosis.derived))
    return said + (DOUBTED if said and diagnosis.verdict not in CERTAIN else "")


def with_error(one: Derived) -> str:
    """Return `natural frequency 26.0001 Hz, standard error 0.0001 Hz`."""
    return f"{one.name} {with_standard_error(one.value, _standard_error(one.low, one.high), one.unit)}"


def name_beyond_linear(diagnosis: Diagnosis) -> str:
    """Return what the nominal model has beyond a linear oscillator, with size and error; "" where it has nothing."""
    before = diagnosis.fits.before
    spring, said = spring_of(diagnosis.derived), []
    cubic = estimates_of(before, "").get(CUBIC)
    if spring:
        size = ""
        if cubic is not None:
            error = _standard_error(cubic.low, cubic.high)
            size = f" ({CUBIC} = {with_standard_error(cubic.value, error, plain_unit(cubic.unit))})"
        said.append(f"Beyond a linear oscillator it has a {spring[0].name.partition(':')[0]}{size}.")
    for one in before.hypothesis.simulation.mechanisms:
        said.append(f"It has {one.id} in it: {state_mechanism(one, estimates_of(before, one.id))}")
    return " ".join(said)


def describe_spring(diagnosis: Diagnosis) -> str:
    """Return what a cubic spring that matters means, as a sentence; "" without one, or where something else is left.

    Beside a cause of which the law is not exact, such as a stop, a spring takes up a part of that.
    """
    return spring_sentence(diagnosis.derived) if diagnosis.verdict in CERTAIN else ""


def spring_sentence(derived: tuple[Derived, ...]) -> str:
    """Return what the derived quantities say of a spring that hardens or softens; "" where they say nothing."""
    told = spring_of(derived)
    if not told:
        return ""
    where, share = told
    does = "hardens" if where.name.startswith(HARDENING) else "softens"
    place = with_standard_error(where.value, _standard_error(where.low, where.high), where.unit)
    part = readable(100.0 * abs(share.value), "", 3)
    return (
        f"The spring {does}: its cubic force is as large as the linear one at {place}, and {part} % of it "
        f"{share.name.partition(': ')[2].removesuffix(', cubic over linear force')}."
    )


def spring_of(derived: tuple[Derived, ...]) -> tuple[Derived, ...]:
    """Return place and share of a spring's cubic force; none where one of them is no number."""
    told = tuple(one for one in derived if one.name.startswith((HARDENING, SOFTENING)))
    return told if len(told) == 2 else ()


def _standard_error(low: float, high: float) -> float:
    return 0.5 * (high - low) / NORMAL_95
