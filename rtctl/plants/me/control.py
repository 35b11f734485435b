"""The magnetoelectric resonator: amplitude and phase through the coil's current and frequency."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.controllers.agc_pll import AgcPllController, AgcPllOptions
from rtctl.controllers.agc_pll_tuning import tune_agc_pll
from rtctl.estimators.lock_in import LockInEstimator
from rtctl.interfaces import Estimator
from rtctl.models.resonator import ResonatorModel, read_resonator
from rtctl.models.span import Span
from rtctl.plant_control.support import Control
from rtctl.plants.me.tables import AgcPllTable
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import Scenario


class MeSupport:
    """`PlantSupport` of the resonator."""

    estimators: Mapping[str, Callable[[ResonatorModel], Estimator]] = {
        "lock_in": LockInEstimator,
    }

    def read_model(self, path: Path) -> ResonatorModel:
        """Read an oscillator's model file."""
        return read_resonator(path)

    def identity(self, model: ResonatorModel) -> str:
        """Return the identity of the device on which the model was identified."""
        return model.identity

    def unused(self, model: ResonatorModel) -> tuple[str, ...]:
        """Return the mechanisms that do nothing to the first harmonic; the tuning names what it has not considered."""
        return model.indifferent

    def output_range(self, scenario: Scenario, model: ResonatorModel) -> Span:
        """Amplitudes [um] from none to what the highest allowed current holds."""
        return Span(0.0, reachable(model, scenario.limits.high))

    def reading_at_rest(self, model: ResonatorModel) -> tuple[float, ...]:
        """Nothing moves."""
        return (0.0, 0.0)

    def limits(self, scenario: Scenario, model: ResonatorModel) -> tuple[CommandLimits, ...]:
        """Those of the scenario. Raises InputError where the model's resonance lies outside them."""
        current, frequency = scenario.limits.commands(scenario.profile)
        resonance_hz = model.resonance / (2.0 * math.pi)
        if not frequency.low < resonance_hz < frequency.high:
            raise InputError(
                f"limits.drive_frequency: the model's resonance, {resonance_hz:.6g} Hz, lies outside "
                f"{frequency.low:g} to {frequency.high:g} Hz"
            )
        return current.command_limits(), frequency.command_limits()

    def control(self, scenario: Scenario, model: ResonatorModel, delay: int) -> Control:
        """AGC and PLL."""
        table = scenario.controller
        if not isinstance(table, AgcPllTable):
            raise InputError(f'controller.kind = "{table.kind}" does not control an "me"; use "agc_pll"')
        try:
            tuning = tune_agc_pll(
                model,
                period_s=scenario.scenario.period_s,
                delay=delay,
                separation=table.separation,
                phase_bandwidth=_angular(table.pll_bandwidth_hz),
                amplitude_bandwidth=_angular(table.agc_bandwidth_hz),
            )
        except ValueError as error:
            raise InputError(str(error)) from None
        options = AgcPllOptions(phase_deg=table.phase_deg, gate=table.gate, kick=table.kick)
        return Control(AgcPllController(model, tuning, options), tuning)

    def predict(self, model: ResonatorModel, level: Mapping[str, float]) -> dict[str, float]:
        """Harmonic balance: the frequency that belongs to the measured amplitude, and how far off the loop is."""
        backbone_hz = model.backbone_hz(level["amplitude"])
        return {"backbone_hz": backbone_hz, "off_backbone_hz": level["drive_frequency"] - backbone_hz}


def reachable(model: ResonatorModel, current_mA: float) -> float:
    """Return the amplitude [um] that a current holds, by bisection where the damping depends on it."""
    high = current_mA / (model.decay / model.growth)
    if model.holding_current(high) <= current_mA * (1.0 + 1e-12):
        return high
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if model.holding_current(middle) <= current_mA else (low, middle)
    return low


def _angular(frequency_hz: float | None) -> float | None:
    return None if frequency_hz is None else 2.0 * math.pi * frequency_hz
