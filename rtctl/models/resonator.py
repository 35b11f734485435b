"""A resonator as the loop's tuning sees it, from an oscillator's model file; lengths in um, drive in mA."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.border.model_file import ModelFile
from rtctl.models.harmonic_balance import backbone
from rtctl.models.oscillator import read_oscillator_model

BENDS = {"stiffness.cubic": "1/(um^2*s^2)", "stiffness.quintic": "1/(um^4*s^2)"}
"""Mechanisms that the backbone knows, each with the unit of its `coefficient`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResonatorModel:
    """z'' + damping z' + stiffness z + cubic z^3 + quintic z^5 = drive_gain u; z [um], u the commanded current [mA]."""

    damping: float
    """1/s."""
    stiffness: float
    """1/s^2."""
    cubic: float
    """1/(um^2 s^2)."""
    quintic: float
    """1/(um^4 s^2)."""
    drive_gain: float
    """um/s^2 a mA of the commanded amplitude, near resonance (the coil's loss is in it)."""
    identity: str
    """Of the device on which it was identified; "" where the file does not say."""
    not_considered: tuple[str, ...] = ()
    """Mechanisms of the file that neither tuning nor backbone know."""

    def __post_init__(self) -> None:
        for name in ("damping", "stiffness", "drive_gain"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be > 0 to control a resonator, got {getattr(self, name):g}")

    @property
    def resonance(self) -> float:
        """Linear resonance [rad/s]."""
        return math.sqrt(self.stiffness)

    @property
    def decay(self) -> float:
        """sigma = omega0 / 2Q [1/s]: the pole of amplitude and phase."""
        return 0.5 * self.damping

    @property
    def growth(self) -> float:
        """d amplitude / dt that a current gives at resonance [um/s/mA]."""
        return self.drive_gain / (2.0 * self.resonance)

    def holding_current(self, amplitude_um: float) -> float:
        """The current [mA] that keeps an amplitude at phase resonance."""
        return self.decay * amplitude_um / self.growth

    def backbone_hz(self, amplitude_um: float) -> float:
        """Frequency of free vibration with this first harmonic, NaN where there is none."""
        found = backbone(amplitude_um, stiffness=self.stiffness, cubic=self.cubic, quintic=self.quintic)
        return found.frequency_hz if found.converged else math.nan


def read_resonator(path: Path) -> ResonatorModel:
    """The model in the file. Raises InputError naming file and key."""
    try:
        return resonator_of(read_oscillator_model(path))
    except ValueError as error:
        raise InputError(f"{path}: model.parameters: {error}") from None


def resonator_of(file: ModelFile) -> ResonatorModel:
    """From a model file's tables. Raises InputError, ValueError."""
    bends = dict.fromkeys(BENDS, 0.0)
    for mechanism in file.model.mechanisms:
        if mechanism.id in BENDS:
            coefficient = mechanism.parameters.get("coefficient")
            bends[mechanism.id] = coefficient.to(BENDS[mechanism.id]) if coefficient else 0.0
    return ResonatorModel(
        damping=file.value("damping", "1/s"),
        stiffness=file.value("stiffness", "1/s^2"),
        cubic=file.value("stiffness_cubic", BENDS["stiffness.cubic"]) + bends["stiffness.cubic"],
        quintic=bends["stiffness.quintic"],
        drive_gain=file.value("drive_gain", "um/s^2/mA"),
        identity=str(file.provenance.get("identity", "")),
        not_considered=tuple(m.id for m in file.model.mechanisms if m.id not in BENDS),
    )
