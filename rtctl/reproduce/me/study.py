"""The study of the ME microresonator: its steps, and the errors of its paper."""

from rtctl.identification.oscillator.annealing import FAULTS
from rtctl.reproduce.me import printed
from rtctl.reproduce.me.steps import (
    array,
    coefficients,
    coil,
    continuation,
    harmonics,
    hysteresis,
    least_squares,
    noise,
    response,
    sensitivity,
)
from rtctl.reproduce.study import Step, Study

STUDY = Study(
    name="me",
    title="A magnetoelectric microresonator: Duffing's equation by simulated annealing",
    paper=(
        '"Modeling of Magnetoelectric Microresonator Using Numerical Method and Simulated Annealing Algorithm", '
        "Micromachines 14(10), 1878 (2023)"
    ),
    lead=(
        "A simulated resonator stands in for the paper's device: 7.5 kHz, quality 500 (ours: the paper gives "
        "none), the film's saturation by the paper's constants, and a spring that softens and then hardens, so "
        "that what is fitted (one cubic term) is not what made the data. The simulated device and the fitted "
        "models share no integrator: the device is marched by this project's simulated hardware, the annealing has "
        "a kernel of its own. Records are taken at 125 kHz at once: the paper's 1.25 MHz, its decimation and its "
        "band-pass from 6 to 40 kHz are not imitated. The reported seeds are not those on which anything was tuned. "
        "Times of fits are processor seconds of one thread."
    ),
    steps=(
        Step("coil", coil.compute),
        Step("coefficients", coefficients.compute),
        Step("least-squares", least_squares.compute),
        Step("noise", noise.compute),
        Step("response", response.compute),
        Step("harmonics", harmonics.compute),
        Step("sensitivity", sensitivity.compute),
        Step("array", array.compute),
        Step("table-a1", printed.compute),
        Step("hysteresis", hysteresis.compute),
        Step("continuation", continuation.compute),
    ),
    faults=(
        "Equation (1): the nonlinear damping is printed as mu z^3, a second cubic stiffness; mu z^2 z' is meant.",
        "Symbols clash: alpha is a stiffness and a cooling rate, gamma a cubic stiffness and the force's amplitude; "
        "figure 7 calls the force Gamma and the stiffness Delta.",
        *(f"Algorithm 1: {fault}" for fault in FAULTS),
        "Table A1 is no plausible oscillator as printed: with mass 0.066, Delta 0.36 and Alpha 0.28 the quality is "
        "about 0.5 whichever of the two is the stiffness, and the natural frequency (rad/s) is "
        '2e4 times below the drive of 46,633 rad/s. "All output values have been scaled", by factors not given.',
        '"Well-posed, implying the existence of a unique solution": a steady tone fixes one complex number, and the '
        "model has at least three (see the section on noise).",
        '"An average correlation coefficient of around 0.92 percent" is 0.92.',
    ),
)
