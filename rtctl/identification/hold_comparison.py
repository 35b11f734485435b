"""Whether another hold of the drive fits the records better than the manifest's: re-fits from the optimum.

    BIC = sum over outputs of n ln(mean square) + k ln(sum of n),   n = N / sum over lags of autocorrelation^2

n is the number of independent samples that know a mean square as well as N coloured ones do (Bartlett). A hold is told
only where it also beats the manifest's hold with a delay, since half a sample of delay is nearly the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.border.simulation import HasCatalogue, Simulation
from rtctl.identification.fit import Fit
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import FINE_LENGTH

HOLDS = ("zero", "linear", "band-limited")
LATER, EARLIER = "drive.delay", "timing.skew"
"""Mechanisms of an oscillator that act as a hold that is later, and as one that is earlier."""
DECISIVE = 10.0
"""Difference of BIC that decides: odds of 150. R. Kass, A. Raftery, J. Am. Stat. Assoc. 90 (1995) 773."""
LEAST_REDUCTION = 0.01
"""Part of the residual (RMS) that another hold has to take away to be told: less changes nothing that a user sees."""
CORRECTION = 'write hold = "{hold}" in [signals.{drive}] of {manifest}'
BETTER = (
    'the records fit hold = "{hold}" better: error {error} instead of {own}; {correction} and run rtctl identify '
    "again"
)
EITHER = (
    'the records do not tell hold = "{hold}" (error {error}) from hold = "{now}" with {late}, and both fit better than '
    "this model (error {own}): if the drive goes on so between its samples, {correction} and run rtctl identify again"
)


Refit = Callable[[Simulation, Sequence[FitRecord]], Fit | None]


class HoldDoubt(NamedTuple):
    """A doubt about the hold in the manifest."""

    text: str = ""
    """What to say; "": nothing."""
    correction: str = ""
    """What to write in the manifest before anything else; "": nothing that is certain."""


def compare_holds(fit: Fit, records: Sequence[FitRecord], refit: Refit, manifest: Path) -> HoldDoubt:
    """Return the doubt about the hold of an input; none where no other is better, or a delay is better still.

    Args:
        fit: The fit with the manifest's holds.
        records: The records to compare them on.
        refit: Fits a simulation again from its own values, by few iterations; None where it diverges.
        manifest: Where the holds are written.
    """
    for drive in records[0].stimulus.holds:
        if any(np.ptp(one.stimulus.inputs[drive]) > 0.0 for one in records):
            doubt = _compare_holds_of(drive, fit, records, refit, manifest)
            if doubt.text:
                return doubt
    return HoldDoubt()


def _compare_holds_of(
    drive: str, fit: Fit, records: Sequence[FitRecord], refit: Refit, manifest: Path
) -> HoldDoubt:
    now = records[0].stimulus.holds[drive]

    def held(hold: str, simulation: Simulation = fit.simulation) -> Fit | None:
        return refit(simulation, [_held(one, drive, hold) for one in records])

    own = held(now)
    others = {hold: held(hold) for hold in HOLDS if hold != now}
    hold, best = min(others.items(), key=lambda one: _badness(one[1], [own, *others.values()]))
    if best is None or not _beats(best, own) or _reduction(best, own) < LEAST_REDUCTION:
        return HoldDoubt()
    # what the optimum of the other hold does for this one is no merit of the hold
    if not _beats(best, held(now, best.simulation)):
        return HoldDoubt()
    correction = CORRECTION.format(hold=hold, drive=drive, manifest=manifest)
    error, of_own = _distinct((_share(best, records), _share(own, records)))
    said = {"hold": hold, "now": now, "correction": correction, "error": error, "own": of_own}
    better = HoldDoubt(BETTER.format(**said), correction)
    simulation = fit.simulation
    known = simulation.catalogue if isinstance(simulation, HasCatalogue) else (LATER, EARLIER)
    delayed, advanced = (LATER, EARLIER) if LATER in known else (f"input.{drive}.delay", "")
    shift = delayed if hold == "zero" else advanced
    if not shift or any(one.id in (delayed, advanced) for one in simulation.mechanisms):
        return better  # nothing but a hold is so much earlier; or each re-fit had a delay of its own
    # from half a sample and not from 0, where the integrator's steps change and no slope is right
    values = np.array([*(one.value for one in simulation.parameters), 0.5 * records[0].period_s])
    late = held(now, simulation.extended((shift,)).with_values(values))
    if _beats(best, late):
        return better
    return HoldDoubt() if _beats(late, best) else HoldDoubt(EITHER.format(**said, late=_delay(late, records)))


def _held(record: FitRecord, drive: str, hold: str) -> FitRecord:
    stimulus = record.stimulus
    return replace(record, stimulus=replace(stimulus, holds={**stimulus.holds, drive: hold}))


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
    (error,) = _distinct((_share(fit, records),))
    return f"a delay of the {whose} of {late_ms:.3g} ms (error {error}; half a sample is {half_ms:.3g} ms)"


def _share(fit: Fit | None, records: Sequence[FitRecord]) -> float:
    """Return the residual over the variation of the first output (RMS)."""
    if fit is None:
        return np.inf
    output, rms = next(iter(fit.rms.items()))
    whole = np.concatenate([one.measured[output][one.first :] for one in records])
    return rms / float(np.std(whole))


def _reduction(fit: Fit, own: Fit | None) -> float:
    """Return the largest part of an output's residual (RMS) that `fit` has less than `own`."""
    if own is None:
        return 1.0
    return max(1.0 - rms / max(own.rms[name], 1e-300) for name, rms in fit.rms.items())


def _distinct(shares: Sequence[float]) -> list[str]:
    """Return the shares in percent, with three digits or as many as tell them apart."""
    for digits in range(3, 9):
        texts = [f"{100.0 * one:.{digits}g} %" if np.isfinite(one) else "without bounds" for one in shares]
        if len(set(texts)) == len(set(shares)):
            break
    return texts
