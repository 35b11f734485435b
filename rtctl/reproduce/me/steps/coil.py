"""Figures 2, 3 and 6 and Appendix A: the coil, the film's magnetisation, the beam's frequency from its layers."""

from __future__ import annotations

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.elements.style import BLUE, GREY, VERMILION, house_style, new_figure
from rtctl.reproduce.me.device import SENSITIVITY
from rtctl.reproduce.me.magnetisation import cycle_of, departure, distortion, magnetisation
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table

FIELDS = (0.28, 0.4, 0.8, 1.0, 3.5)
COIL_RESISTANCE, COIL_INDUCTANCE = 10.0, 1e-4
"""ohm, H: of our simulated bench; the paper gives none."""
LENGTH = 3e-3
CLAMPED_FREE = 1.8751040687119611
"""First root of cos x cosh x = -1."""
# (thickness m, density kg/m^3, C11, C12, C13, C33 in GPa), from the top: AlN, Si, FeCoSiB of Appendix A
LAYERS = (
    (2e-6, 3268.0, 410.0, 149.0, 99.0, 389.0),
    (50e-6, 2329.0, 216.0, 84.0, 84.0, 216.0),
    (2e-6, 7250.0, 150.0, 45.0, 45.0, 150.0),
)


def young(c11: float, c12: float, c13: float, c33: float) -> float:
    """Return E [Pa] along the beam: the inverse of the compliance's first entry."""
    stiffness = np.array([[c11, c12, c13], [c12, c11, c13], [c13, c13, c33]])
    return float(1e9 / np.linalg.inv(stiffness)[0, 0])


def bending_hz(layers: tuple[tuple[float, ...], ...], length: float = LENGTH) -> float:
    """Return the first bending mode [Hz] of a clamped beam of layers (Euler-Bernoulli, about its neutral axis)."""
    modulus = np.array([young(*layer[2:]) for layer in layers])
    thickness = np.array([layer[0] for layer in layers])
    density = np.array([layer[1] for layer in layers])
    middle = np.cumsum(thickness) - 0.5 * thickness
    neutral = float(np.sum(modulus * thickness * middle) / np.sum(modulus * thickness))
    rigidity = float(np.sum(modulus * (thickness**3 / 12.0 + thickness * (middle - neutral) ** 2)))
    return (
        CLAMPED_FREE**2
        / (2.0 * math.pi * length**2)
        * math.sqrt(rigidity / float(np.sum(density * thickness)))
    )


def commanded(frequency_hz: FloatArray) -> FloatArray:
    """Return the field per commanded current [mT/A] of a voltage-driven coil: it lags and shrinks by R and L."""
    return SENSITIVITY / np.hypot(1.0, 2.0 * math.pi * frequency_hz * COIL_INDUCTANCE / COIL_RESISTANCE)


def compute(run: Run) -> Section:
    """Return the section."""
    _draw(run)
    rows = tuple(
        (
            f"{field:g}",
            f"{1e-3 * float(magnetisation(np.array(field))):.2f}",
            f"{100.0 * departure(field):.2f}",
            f"{100.0 * distortion(magnetisation(cycle_of(field))):.3f}",
            f"{100.0 * distortion(magnetisation(cycle_of(field)) ** 2, 2):.3f}",
        )
        for field in FIELDS
    )
    comparison = Comparison(
        title="Coil, film and beam",
        rows=(
            Row(quantity="coil sensitivity at 7.5 kHz", unit="mT/A", paper=2.6, ours=SENSITIVITY,
                note="taken from the paper; a field a measured current is flat by geometry"),
            Row(quantity="the same a commanded current, 7.5 kHz", unit="mT/A", paper=None,
                ours=float(commanded(np.array(7500.0))),
                note="our bench's coil, 10 ohm and 0.1 mH: who drives by voltage must calibrate by current"),
            Row(quantity="field homogeneity along the beam", unit="%", paper=98.0, ours=None,
                note="not reproduced: the paper gives no turns, pitch or distance of its coil"),
            Row(quantity="first bending mode, finite elements", unit="kHz", paper=7.5,
                ours=1e-3 * bending_hz(LAYERS), note="beam theory with the three layers of Appendix A"),
            Row(quantity="the same, silicon alone", unit="kHz", paper=7.5, ours=1e-3 * bending_hz(LAYERS[1:2]),
                note="nearer to the measured 7.5 kHz: the films as printed are too stiff, or the beam is longer"),
            Row(quantity="field where nonlinearity begins", unit="mT", paper=1.0, ours=threshold(0.02),
                note="2 % below the tangent (the paper reads it off its curve)"),
            Row(quantity="M below its tangent at 1 mT", unit="%", paper=None, ours=100.0 * departure(1.0)),
            Row(quantity="M below its tangent at 3.5 mT", unit="%", paper=None, ours=100.0 * departure(3.5)),
        ),
    )  # fmt: skip
    return Section(
        title="Coil sensitivity and magnetisation (figures 2, 3, 6)",
        text=(
            "Langevin's function with the paper's M_s = 159.15 kA/m and susceptibility 40. Distortion is of a pure "
            "field's response over one cycle. With no bias field the magnetostriction follows M squared, so its "
            "fundamental is twice the drive's frequency; the paper drives at 7.5 kHz and sees 7.5 kHz, so its film "
            "must be biased (exchange bias), which it does not quantify."
        ),
        parts=(
            comparison,
            Table(
                title="Magnetisation and its distortion",
                headers=("field, mT", "M, kA/m", "below tangent, %", "THD of M, %", "THD of M squared, %"),
                rows=rows,
                numbers=(0, 1, 2, 3, 4),
            ),
            Picture(
                file="coil.png",
                caption="Left: field a current of the coil. Right: magnetisation and its tangent.",
                alt="Two curves: coil sensitivity over frequency, magnetisation over field",
            ),
        ),
    )


def threshold(share: float) -> float:
    """Return the field [mT] where M is by `share` below its tangent."""
    low, high = 1e-3, 10.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if departure(middle) < share else (low, middle)
    return high


def _draw(run: Run) -> None:
    with house_style():
        figure = new_figure(8.4, 3.0)
        left, right = figure.subplots(1, 2)
        frequency = np.linspace(1e3, 10e3, 200)
        left.plot(1e-3 * frequency, np.full(200, SENSITIVITY), color=BLUE, label="a measured current")
        left.plot(1e-3 * frequency, commanded(frequency), color=VERMILION, label="a commanded current")
        left.set(xlabel="frequency [kHz]", ylabel="sensitivity [mT/A]", ylim=(2.0, 2.8), title="Coil")
        left.legend()
        field = np.linspace(-5.0, 5.0, 400)
        right.plot(field, 1e-3 * magnetisation(field), color=BLUE, label="Langevin")
        slope = 1e-3 * float(magnetisation(np.array(1e-3))) / 1e-3
        near = np.abs(field) < 3.0
        right.plot(field[near], slope * field[near], color=GREY, linestyle="--", label="tangent")
        right.set(xlabel="field [mT]", ylabel="M [kA/m]", title="Film")
        right.legend()
        save_small_png(figure, run.pictures / "coil.png")
