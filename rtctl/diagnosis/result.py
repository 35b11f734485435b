"""What a diagnosis returns: verdict, causes with evidence, gain, extended model, next experiment; `diagnosis.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.experiment_design.isolability import Isolability
from rtctl.diagnosis.experiment_design.next_experiment import NextExperiment
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subject import Rehearsal
from rtctl.diagnosis.residual.bursts import IN_BURSTS
from rtctl.diagnosis.residual.localization import Location
from rtctl.diagnosis.residual.missing_force import MissingForce
from rtctl.diagnosis.residual.noise_floor import residual_over_noise
from rtctl.diagnosis.residual.parameter_estimates import estimates_by_mechanism
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.verification.whole_record_fits import Fits
from rtctl.identification.fit_record import FitRecord
from rtctl.models.derived.quantity import Derived

EXTENDED_MODEL = "model-extended.toml"
"""File of the extended model, beside `diagnosis.json`."""


ERROR = "the error"
"""The squared error of the nominal model above the noise."""


class Cause(NamedTuple):
    """A named effect that the model lacks, or a value that is off, with its evidence."""

    id: str
    """Mechanism of the catalogue, or `parameter.<name>`."""
    statement: str
    """One sentence with the fitted values."""
    kind: str
    """"mechanism" or "parameter"."""
    probability: float | None
    """From the BIC weights of all sets of causes of the same size; None where something else is left too, since those
    weights compare sets of the catalogue only, and for static loops that were learned anew, which have no rival."""
    parameters: Mapping[str, Estimate]
    share_removed: float
    """Fraction of the removable squared error that this cause removes beside those that remove more."""
    indistinguishable_from: tuple[str, ...]
    """Ids that would explain the data as well in its place."""
    same_law: tuple[str, ...] = ()
    """Those of `indistinguishable_from` that are one law with it by construction: no experiment tells them apart."""
    share_of: str = ERROR
    """What `share_removed` is a share of, in words."""

    @property
    def rivals(self) -> tuple[str, ...]:
        """Return the ids that would explain these data as well, and that other data may tell from it."""
        return tuple(one for one in self.indistinguishable_from if one not in self.same_law)

    @property
    def hold(self) -> str:
        """Return the hold that is nearer to how an input goes on than the manifest's; "" of any other cause."""
        if not (self.id.startswith("input.") and self.id.endswith(".hold")) or not self.parameters:
            return ""
        most = max(self.parameters, key=lambda name: self.parameters[name].value)
        return most.removeprefix("toward_").replace("_", "-") if self.parameters[most].value > 0.5 else ""

    @property
    def certainty(self) -> str:
        """Return the probability as text; where it is None, the share of the error that the cause removes."""
        if self.probability is None:
            return f"removes {share_text(self.share_removed)} of {self.share_of}"
        return f"{self.probability:.1%}"

    def as_json(self) -> dict[str, Any]:
        """Return the entry of `causes` in `diagnosis.json`."""
        fields = self._asdict()
        del fields["same_law"], fields["share_of"]
        return {
            **fields,
            "parameters": {
                name: {**estimate._asdict(), "unit": plain_unit(estimate.unit) or estimate.unit}
                for name, estimate in self.parameters.items()
            },
            "indistinguishable_from": list(self.indistinguishable_from),
        }


def correction_of(causes: Sequence[Cause], drive: str) -> str:
    """Return what to write in the manifest for causes that are mistakes there, as a wrong hold is; "": nothing.

    Args:
        causes: Causes of a diagnosis.
        drive: Name of the input whose hold has no name in its id.
    """
    wrong = {
        one.id.removeprefix("input").removesuffix("hold").strip(".") or drive: one.hold
        for one in causes
        if one.hold
    }
    lines = " and ".join(f'hold = "{hold}" in [signals.{name}]' for name, hold in wrong.items())
    return f"write {lines} of the manifest" if lines else ""


def share_text(share: float) -> str:
    """Return a share in percent, with a digit more where it would be rounded to nothing or to everything."""
    if share > 0.9995:
        return "more than 99.9%"
    if share >= 0.995:
        return f"{share:.1%}"
    if 0.0 < share < 0.001:
        return "less than 0.1%"
    return f"{share:.0%}" if share >= 0.01 else f"{share:.1%}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """The answer of a diagnosis and all that its report shows."""

    verdict: str
    """"adequate", "explained", "partly_explained" or "unexplained"."""
    causes: tuple[Cause, ...]
    """Most probable first."""
    gain: Gain | None
    """Free-run errors on the test records before and after; None without test records."""
    where: tuple[Location, ...]
    """Coordinates along which the residual of the nominal model lives, largest share first."""
    search: SearchResult
    problem: Problem
    tests: tuple[FitRecord, ...]
    """Test records."""
    fits: Fits
    """Fits of whole records, which gain, extended model and figures are computed from."""
    before: Simulation
    """Simulation with the parameter values of the model file."""
    model: Any
    """Extended model, of the type of the subject's model file; without provenance."""
    units: Mapping[str, str]
    """Unit by signal name."""
    isolability: Isolability
    noise_rms: float
    """RMS of the noise of the subject's output, in its unit."""
    level: float
    """Significance level of the residual tests, shared by all of one set."""
    next_experiment: NextExperiment | None = None
    shape: MissingForce | None = None
    """Shape of the missing force, where causes do not explain all of it."""
    helps: bool = False
    """Whether on test records the error of another output, or that of any in units of the noise, certainly falls, and
    none certainly rises."""
    doubt: str = ""
    """Why the model that was diagnosed is to be identified again first; "": it is not."""
    kind_doubt: str = ""
    """Why the device may be no plant of the model's kind, one of `warnings` too; "": nothing speaks against it."""
    loop: Rehearsal | None = None
    """How the loop does with today's and with the extended model; None where no loop uses it or nothing is claimed."""
    warnings: tuple[str, ...] = field(default=())
    stopped: bool = False
    """Whether the user stopped it."""
    cut_by_clock: bool = False
    """Whether the wall-clock guard ended the search: then the answer depends on the machine."""

    @property
    def comes_in_bursts(self) -> bool:
        """Whether what is left is rare and large, which a noise, an average over whole records, does not say."""
        return any(IN_BURSTS in one for one in self.warnings)

    @property
    def undecided(self) -> bool:
        """Whether the search ended early and nothing it had found explains the data."""
        return self.verdict == "unexplained" and (self.stopped or self.search.out_of_time)

    @property
    def correction(self) -> str:
        """Return what to write in the manifest before anything else; "": nothing."""
        return correction_of(self.causes, self.problem.subject.drive)

    @property
    def withheld(self) -> str:
        """Why the extended model is not handed out; "": it is."""
        if not self.causes:
            return "no cause is claimed, so there is no extended model"
        if self.doubt:
            return "there is no extended model, because the model itself is to be identified again"
        if self.gain is not None and not (self.gain.ratio_low > 1.0 or self._helps_otherwise(self.gain)):
            return (
                "there is no extended model, because a gain on the test records is not certain: with the causes the "
                f"error is {self.gain.in_words}"
            )
        worst = self.problem.thresholds.verification.worst_loop_ratio
        if self.loop is not None and not self.loop.after <= worst * self.loop.before:
            return (
                f"there is no extended model, because the loop would do worse with it: {self.loop.scenario}, "
                f"{self.loop.before:.3g} {self.loop.unit} with the nominal model, {self.loop.after:.3g} with the other"
            )
        return ""

    def _helps_otherwise(self, gain: Gain) -> bool:
        """Whether the loop is much better with the extended model, or another error falls where this one does not rise.

        What `helps` says is of the fit: the model that is handed out may have no corrections of its signals.
        """
        least = self.problem.thresholds.verification.helpful_loop_ratio
        in_loop = self.loop is not None and self.loop.after * least <= self.loop.before
        return in_loop or (self.helps and gain.ratio_high >= 1.0)

    @property
    def kept(self) -> TestedHypothesis:
        """The fit that the answer is about: of the extended model, or where no cause is named of the nominal one."""
        return self.fits.after if self.causes else self.fits.before

    @property
    def derived(self) -> tuple[Derived, ...]:
        """Return what follows from the parameters of the extended model, or of the re-fitted nominal one."""
        estimates = estimates_by_mechanism(self.kept)
        return tuple(self.problem.subject.derive(self.model, estimates, self.units, self.problem))

    @property
    def json(self) -> dict[str, Any]:
        """Content of `diagnosis.json`, without provenance."""
        chosen = self.search.chosen
        content: dict[str, Any] = {
            "verdict": self.verdict,
            "causes": [cause.as_json() for cause in self.causes],
            "gain": None if self.gain is None else {"metric": "rms_error_test", **self.gain._asdict()},
            "where": [{"coordinate": place.coordinate, "share": place.share} for place in self.where],
        }
        if self.next_experiment is not None:
            content["next_experiment"] = dict(self.next_experiment.json)
        return content | {
            "model": None if self.withheld else EXTENDED_MODEL,
            "model_withheld": self.withheld,
            "derived": [one.as_json() for one in self.derived],
            "loop": None if self.loop is None else self.loop.as_json(),
            "warnings": list(self.warnings),
            "stopped": self.stopped,
            "cut_by_clock": self.cut_by_clock,
            "tests": [test.as_json() for test in chosen.tests],
            "p_value": chosen.p_value,
            "left_over_noise": residual_over_noise(chosen),
            "out_of_time": self.search.out_of_time,
            "isolability": {
                "ids": list(self.isolability.ids),
                "visible": self.isolability.visible.tolist(),
                "unseen": self.isolability.unseen.tolist(),
                "cosine": self.isolability.cosine.tolist(),
            },
        }
