"""Beyond the paper: the loop traces the unstable branch on simulated hardware over the wire, beside harmonic balance.

At constant current a Duffing resonator's phase falls steadily along its curve, folds or not, so a loop that holds the
phase (by the frequency) and the amplitude (by the current) stands on every point of it. At each phase three amplitudes
are held; where the current that they need is the wanted one is a point of the frequency response at that current.
"""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import RunError
from rtctl.border.units.quantities import parse_quantity, read_toml
from rtctl.models.frequency_response import OddOscillator, Response, cycle, frequency_response
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.elements.style import BLACK, BLUE, GREY, VERMILION, house_style, new_figure
from rtctl.reproduce.me.device import MU_0
from rtctl.reproduce.me.magnetisation import langevin
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.schema import load_scenario
from rtctl.session.closed_loop import track
from rtctl.wiring import build_driver, find_plant, model_of

DEVICE, SCENARIO = "me_a", "me_amplitude"
CURRENT = 150.0
"""Commanded current [mA]."""
PHASES = (-20, -35, -50, -65, -80, -90, -100, -110, -120, -130, -140, -150, -158)
"""Phases [deg] of the displacement behind the coil's current."""
LEVELS = (0.92, 1.0, 1.08)
"""Levels relative to the amplitude that a linear resonator would have at that phase and current."""
HOLD_S = 0.25
SEED = 301
LOW_HZ, HIGH_HZ = 7420.0, 7580.0


class Bench(NamedTuple):
    """Data of the device that harmonic balance needs, from its own file."""

    oscillator: OddOscillator
    force: FloatArray
    """Force over one cycle at `CURRENT` [um/s^2]."""
    peak: float
    """Amplitude of the linear resonance [um]."""


class Held(NamedTuple):
    """Operating point that the loop held."""

    phase_deg: float
    frequency_hz: float
    amplitude_um: float
    scatter_hz: float
    """Standard deviation of the held frequency."""


def bench() -> Bench:
    """Return the data of `DEVICE`."""
    tables = read_toml(find_plant(DEVICE, Path()))
    coil, film, beam = tables["coil"], tables["magnetisation"], tables["beam"]
    omega = 2.0 * math.pi * parse_quantity(beam["frequency"], "Hz")
    oscillator = OddOscillator(
        damping=omega / float(beam["quality"]),
        stiffness=omega**2,
        cubic=parse_quantity(beam["stiffness_cubic"], "1/(um^2*s^2)"),
        quintic=parse_quantity(beam.get("stiffness_quintic", "0 1/(um^4*s^2)"), "1/(um^4*s^2)"),
    )
    lag = omega * parse_quantity(coil["inductance"], "H") / parse_quantity(coil["resistance"], "ohm")
    field = 1e-3 * CURRENT * parse_quantity(coil["field"], "T/A") / math.hypot(1.0, lag)
    saturation = parse_quantity(film["saturation"], "A/m")
    argument = 3.0 * float(film["susceptibility"]) * field / (MU_0 * saturation)
    force = parse_quantity(beam["drive"], "um/s^2/(A/m)") * saturation * langevin(argument * np.cos(cycle()))
    size = 2.0 * float(np.mean(force * np.cos(cycle())))
    return Bench(oscillator, np.asarray(force), size / (oscillator.damping * omega))


@contextmanager
def served(device: str, seed: int) -> Iterator[str]:
    """Yield the address of `rtctl serve` of a bundled device in its own process, over Modbus TCP. Raises RunError."""
    command = [
        sys.executable, "-m", "rtctl", "serve", device, "--modbus-tcp", "127.0.0.1:0", "--seed", str(seed),
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            words = process.stdout.readline().split()
            if len(words) < 3 or words[0] != "ready":
                raise RunError(f'"{" ".join(command)}" did not start: {" ".join(words) or "no answer"}')
            yield words[2]
        finally:
            process.kill()


def hold(address: str, phase_deg: float, amplitude_um: float) -> Held | None:
    """Return the point at this phase and `CURRENT`, from three runs of the loop at amplitudes around `amplitude_um`.

    None where the currents that they need do not enclose it.
    """
    path = find_scenario(SCENARIO)
    levels = ", ".join(f'"{amplitude_um * share:.6g} um"' for share in LEVELS)
    scenario, _ = load_scenario(
        path,
        [
            "driver.kind=modbus-tcp", f"driver.address={address}", f"controller.phase={phase_deg:g} deg",
            f"reference.levels=[{levels}]", f"reference.hold={HOLD_S:g} s",
            f"scenario.duration={len(LEVELS) * HOLD_S:g} s",
        ],
    )  # fmt: skip
    driver = build_driver(scenario, path.parent)
    result, outcome = track(scenario, model_of(scenario, path.parent, None), driver, lambda: False)
    if outcome.fault is not None:
        raise RunError(f"phase {phase_deg:g} deg, {amplitude_um:.3g} um: {outcome.fault}: {outcome.message}")
    rows = round(HOLD_S / scenario.scenario.period_s)

    def settled(name: str) -> FloatArray:
        return np.asarray(result.signals[name]).reshape(-1, rows)[:, -rows // 3 :]

    current, frequency, amplitude = (
        settled(name).mean(axis=1) for name in ("coil_current", "drive_frequency", "amplitude")
    )
    if not current.min() <= CURRENT <= current.max():
        return None
    return Held(
        phase_deg,
        float(np.interp(CURRENT, current, frequency)),
        float(np.interp(CURRENT, current, amplitude)),
        float(settled("drive_frequency").std(axis=1).max()),
    )


def compute(run: Run) -> Section:
    """Return the section."""
    known = bench()
    curve = frequency_response(known.oscillator, known.force, 2.0 * math.pi * LOW_HZ, 2.0 * math.pi * HIGH_HZ)
    phases = (-130,) if run.short else PHASES
    with served(DEVICE, SEED) as address:
        tried = [hold(address, phase, known.peak * math.sin(math.radians(-phase))) for phase in phases]
    found = [one for one in tried if one is not None]
    if not found:
        raise RunError(f"at no phase do the amplitudes enclose {CURRENT:g} mA")
    rows, off, unstable = [], [], 0
    for one in found:
        hertz, amplitude, stable = on_the_curve(curve, one.phase_deg)
        off.append((one.frequency_hz - hertz, one.amplitude_um / amplitude - 1.0))
        unstable += not stable
        rows.append(
            (
                f"{one.phase_deg:g}", f"{one.frequency_hz:.3f}", f"{one.frequency_hz - hertz:+.3f}",
                f"{one.amplitude_um:.4f}", f"{100.0 * (one.amplitude_um / amplitude - 1.0):+.2f}",
                f"{1e3 * one.scatter_hz:.1f}", "stable" if stable else "unstable",
            )
        )  # fmt: skip
    _draw(run, curve, found)
    errors = np.abs(np.array(off))
    folds = ", ".join(f"{curve.rate[i] / (2.0 * math.pi):.2f} Hz" for i in curve.folds)
    return Section(
        title="Control-based continuation: the unstable branch on the hardware (beyond the paper)",
        text=(
            f"The simulated device {DEVICE} in a process of its own, over Modbus TCP in lockstep, {CURRENT:g} mA. The "
            "loop is the project's amplitude and phase control, tuned by its bundled model; the device is known only "
            f"through its lock-in. At each phase three amplitudes are held for {HOLD_S:g} s each, and frequency and "
            "amplitude read where the current is the wanted one. Harmonic balance is of the device file's own "
            f"numbers. Its folds: {folds}; between them an open-loop sweep jumps, and the loop stood on {unstable} "
            f"unstable {'point' if unstable == 1 else 'points'}."
        ),
        parts=(
            Comparison(
                title="Held points against harmonic balance at the same phase",
                rows=(
                    Row(quantity="points held", unit="", paper=None, ours=float(len(found)),
                        note=f"of {len(phases)} phases"),
                    Row(quantity="of these on the unstable branch", unit="", paper=None, ours=float(unstable)),
                    Row(quantity="largest error of frequency", unit="Hz", paper=None, ours=float(errors[:, 0].max()),
                        note=f"half-width {known.oscillator.damping / (4.0 * math.pi):.1f} Hz"),
                    Row(quantity="largest error of amplitude", unit="%", paper=None,
                        ours=100.0 * float(errors[:, 1].max())),
                ),
            ),
            Table(
                title="Points",
                headers=("phase, deg", "frequency, Hz", "off, Hz", "amplitude, um", "off, %", "scatter, mHz",
                         "by Floquet"),
                rows=tuple(rows), numbers=(0, 1, 2, 3, 4, 5),
            ),
            Picture(
                file="continuation.png",
                caption="Harmonic balance (dashed: unstable) and the points on which the loop stood.",
                alt="A resonance curve that leans right, with measured points on all of its branches",
            ),
        ),
    )  # fmt: skip


def on_the_curve(curve: Response, phase_deg: float) -> tuple[float, float, bool]:
    """Return frequency [Hz], amplitude [um] and stability at a phase behind the force, which falls along the curve."""
    phase = np.degrees(np.unwrap(np.angle(curve.phasors[:, 0])))
    at = int(np.abs(phase - phase_deg).argmin())
    hertz = np.interp(-phase_deg, -phase, curve.rate / (2.0 * math.pi))
    return float(hertz), float(np.interp(-phase_deg, -phase, curve.amplitude)), bool(curve.stable[at])


def _draw(run: Run, curve: Response, found: list[Held]) -> None:
    hertz, amplitude = curve.rate / (2.0 * math.pi), curve.amplitude
    with house_style():
        figure = new_figure(8.4, 3.6)
        axes = figure.subplots()
        axes.plot(hertz, np.where(curve.stable, amplitude, np.nan), color=BLUE, label="stable")
        axes.plot(
            hertz, np.where(curve.stable, np.nan, amplitude), color=BLUE, linestyle="--", label="unstable"
        )
        for unstable, colour in ((False, BLACK), (True, VERMILION)):
            points = [one for one in found if on_the_curve(curve, one.phase_deg)[2] != unstable]
            axes.plot(
                [one.frequency_hz for one in points],
                [one.amplitude_um for one in points],
                "o",
                color=colour,
                label="held on the unstable branch" if unstable else "held",
            )
        for fold in curve.folds:
            axes.axvline(hertz[fold], color=GREY, linewidth=0.6)
        near = [one.frequency_hz for one in found]
        axes.set(
            xlabel="drive frequency [Hz]", ylabel="amplitude [µm]", xlim=(min(near) - 10.0, max(near) + 15.0)
        )
        axes.legend()
        save_small_png(figure, run.pictures / "continuation.png")
