"""Mechanisms that are one law: a search fits one of them, and an answer names both.

A reading that is early is a late drive. So is one that is late by a part of a period, if the instrument reads at the
end of each period, as many do: then the drive is late by the rest of it. And a constant force on a hardening spring is
a spring that is not symmetric, where no displacement was measured.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from rtctl.border.mechanisms import Mechanism
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.result import Cause
from rtctl.output.readable_units import readable_unit

END_OF_PERIOD = (
    " If rows are read at the end of their period of {}, the drive acts {} late instead ({}): "
    "the records are the same."
)


def find_same_laws(
    simulation: Simulation,
    ids: Sequence[str],
    chosen: Simulation | None = None,
    measured: Collection[str] = ("displacement",),
) -> dict[str, tuple[str, ...]]:
    """Return by mechanism those of `ids` that are the same law on the side that a search leaves to it.

    Args:
        simulation: The re-fitted nominal model.
        ids: Mechanisms that were tried.
        chosen: That with the causes that were found; None: without any.
        measured: Outputs that were measured; without a displacement its zero is unseen too.
    """
    found: dict[str, tuple[str, ...]] = {}
    values = {one.name: one.value for one in (chosen or simulation).parameters}
    for one in ids:
        mechanism = simulation.extended((one,)).mechanisms[-1]
        for parameter in mechanism.parameters:
            if parameter.opposite:
                found[parameter.opposite] = (*found.get(parameter.opposite, ()), one)
        if "displacement" not in measured:
            alike = tuple(name for name in mechanism.about_another_zero(values) if name in ids)
            found |= {one: (*found.get(one, ()), *alike)} if alike else {}
    return found


def add_same_laws(names: Sequence[str], own: str, same_laws: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the `names` that could stand in place of `own`, each before those that are one law with it."""
    found = [one for name in (own, *names) for one in (name, *same_laws.get(name, ()))]
    return tuple(one for one in dict.fromkeys(found) if one != own)


def tell_readings_at_the_end(
    causes: Sequence[Cause], mechanisms: Sequence[Mechanism], period_s: float, ids: Sequence[str]
) -> tuple[Cause, ...]:
    """Return the causes, and beside a reading within the period what it is if rows are read at the period's end.

    Args:
        causes: Causes that were named.
        mechanisms: Mechanisms of the chosen set.
        period_s: Sample period of the records [s].
        ids: Mechanisms that were tried.
    """
    by_id = {one.id: one for one in mechanisms}
    named = {one.id for one in causes}
    return tuple(
        _tell_end(cause, by_id[cause.id], period_s, set(ids) - named) if cause.id in by_id else cause
        for cause in causes
    )


def _tell_end(cause: Cause, mechanism: Mechanism, period_s: float, ids: Collection[str]) -> Cause:
    for declared in mechanism.parameters:
        estimate = cause.parameters.get(declared.name)
        if estimate is None or declared.unit != "s" or declared.opposite not in ids:
            continue
        if estimate.value > 0.0 and estimate.high < period_s:
            rest = period_s - estimate.value
            texts = [readable_unit(value, "s").text(value) for value in (period_s, rest)]
            others = dict.fromkeys((*cause.indistinguishable_from, declared.opposite))
            statement = cause.statement + END_OF_PERIOD.format(*texts, declared.opposite)
            return cause._replace(statement=statement, indistinguishable_from=tuple(others))
    return cause
