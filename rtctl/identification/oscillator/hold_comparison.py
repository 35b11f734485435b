"""Whether another hold of the drive fits the records better than the manifest's: re-fits from the optimum.

    BIC = sum over outputs of n ln(mean square) + k ln(sum of n),   n = N / sum over lags of autocorrelation^2

n is the number of independent samples that know a mean square as well as N coloured ones do (Bartlett). A hold is told
only where it also beats the manifest's hold with a delay, since half a sample of delay is nearly the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import FINE_LENGTH
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.multiple_shooting import ShootingOptions, fit_multiple_shooting
from rtctl.identification.simulation_error.output_error import FitOptions, cut_liveliest, fit_output_error

HOLDS = ("zero", "linear", "band-limited")
LATER, EARLIER = "drive.delay", "timing.skew"
"""Mechanisms that act as a hold that is later, and as one that is earlier."""
DECISIVE = 10.0
"""Difference of BIC that decides: odds of 150. R. Kass, A. Raftery, J. Am. Stat. Assoc. 90 (1995) 773."""
ITERATIONS, FINAL_ITERATIONS = 8, 2
"""Of a re-fit: it starts at the optimum of another hold, half a sample away."""
CORRECTION = 'write hold = "{hold}" in [signals.{drive}] of {manifest}'
BETTER = (
    'the records fit hold = "{hold}" better: error {error} instead of {own}; {correction} and run rtctl identify '
    "again"
)
EITHER = (
    'the records do not tell hold = "{hold}" (error {error}) from hold = "{now}" with {late}, and both fit better than '
    "this model (error {own}): if the drive goes on so between its samples, {correction} and run rtctl identify again"
)


class HoldDoubt(NamedTuple):
    """A doubt about the hold in the manifest."""

    text: str = ""
    """What to say; "": nothing."""
    correction: str = ""
    """What to write in the manifest before anything else; "": nothing that is certain."""


def compare_holds(fit: Fit, records: Sequence[FitRecord], options: FitOptions, manifest: Path) -> HoldDoubt:
    """Return the doubt about the hold of the drive; none where no other is better, or a delay is better still.

    Args:
        fit: The fit with the manifest's hold.
        records: The fitted records.
        options: Options of that fit.
        manifest: Where the hold is written.
    """
    holds = records[0].stimulus.holds
    if len(holds) != 1:
        return HoldDoubt()
    (drive, now), refits = next(iter(holds.items())), _Refits(fit, records, options)
    own = refits.by(now)
    others = {hold: refits.by(hold) for hold in HOLDS if hold != now}
    hold, best = min(others.items(), key=lambda one: _badness(one[1], [own, *others.values()]))
    if best is None or not _beats(best, own):
        return HoldDoubt()
    # what the optimum of the other hold does for this one is no merit of the hold
    if not _beats(best, refits.by(now, start=best)):
        return HoldDoubt()
    correction = CORRECTION.format(hold=hold, drive=drive, manifest=manifest)
    said = {
        "hold": hold, "now": now, "correction": correction, "error": _error(best, refits.records),
        "own": _error(own, refits.records),
    }  # fmt: skip
    better = HoldDoubt(BETTER.format(**said), correction)
    simulation = fit.simulation
    if any(one.id in (LATER, EARLIER) for one in simulation.mechanisms):
        return better  # each re-fit had a delay of its own, or it is known
    # from half a sample and not from 0, where the integrator's steps change and no slope is right
    values = np.array([*(one.value for one in simulation.parameters), 0.5 * records[0].period_s])
    late = refits.by(now, simulation.extended((LATER if hold == "zero" else EARLIER,)).with_values(values))
    if _beats(best, late):
        return better
    return (
        HoldDoubt()
        if _beats(late, best)
        else HoldDoubt(EITHER.format(**said, late=_delay(late, refits.records)))
    )


class _Refits:
    """Re-fits from the optimum of `fit`, all by its method, with few iterations."""

    def __init__(self, fit: Fit, records: Sequence[FitRecord], options: FitOptions) -> None:
        self._fit, self.records = fit, records
        if fit.method != "output_error":  # thousands of segments: as many periods as starts are compared on
            span_s = options.screening_periods * 2.0 * np.pi / estimate_scales(records).rate
            self.records = [cut_liveliest(one, span_s) for one in records]
        self._options = replace(
            options, screening_iterations=0, iterations=ITERATIONS, final_iterations=FINAL_ITERATIONS
        )

    def by(self, hold: str, simulation: Simulation | None = None, start: Fit | None = None) -> Fit | None:
        """Return the re-fit with one hold; None where it diverges."""
        records = [_held(one, hold) for one in self.records]
        simulation = simulation or (start or self._fit).simulation
        try:
            if self._fit.method == "output_error":
                return fit_output_error(simulation, records, self._options)
            # segments by themselves: pulled together, they show nothing more of a hold
            return fit_multiple_shooting(simulation, records, ShootingOptions(gaps=(), fit=self._options))
        except FitError:
            return None


def _held(record: FitRecord, hold: str) -> FitRecord:
    stimulus = record.stimulus
    return replace(record, stimulus=replace(stimulus, holds=dict.fromkeys(stimulus.holds, hold)))


def _beats(one: Fit | None, other: Fit | None) -> bool:
    """Return whether the records decide for `one`."""
    if one is None or other is None:
        return one is not None
    return _badness(one, [one, other]) + DECISIVE < _badness(other, [one, other])


def _badness(fit: Fit | None, compared: Sequence[Fit | None]) -> float:
    """Return the BIC with as many independent samples as the most coloured residual of those `compared` has."""
    if fit is None:
        return np.inf
    counts = {name: min(_independent(one, name) for one in compared if one is not None) for name in fit.rms}
    deviance = sum(2.0 * counts[name] * float(np.log(max(rms, 1e-300))) for name, rms in fit.rms.items())
    return deviance + len(fit.values) * float(np.log(sum(counts.values())))


def _independent(fit: Fit, output: str) -> float:
    """Return the number of independent samples in the residuals of an output."""
    power = fit.noise[output].power(FINE_LENGTH)
    whiteness = float(np.mean(power)) ** 2 / max(float(np.mean(power**2)), 1e-300)
    return max(1.0, whiteness * sum(len(outputs[output]) for outputs in fit.residuals.values()))


def _delay(fit: Fit | None, records: Sequence[FitRecord]) -> str:
    """Return the delay of a fit that has one, with its error."""
    if fit is None:
        return "a delay"
    whose = "drive" if fit.names[-1].startswith(LATER) else "readings"
    late_ms, half_ms = 1e3 * fit.values[-1], 0.5e3 * records[0].period_s
    error = _error(fit, records)
    return f"a delay of the {whose} of {late_ms:.3g} ms (error {error}; half a sample is {half_ms:.3g} ms)"


def _error(fit: Fit | None, records: Sequence[FitRecord]) -> str:
    """Return the residual over the variation of the first output (RMS)."""
    if fit is None:
        return "without bounds"
    output, rms = next(iter(fit.rms.items()))
    whole = np.concatenate([one.measured[output][one.first :] for one in records])
    return f"{100.0 * rms / float(np.std(whole)):.3g} %"
