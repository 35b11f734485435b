"""Table A1 as printed, and the kind of oscillator that its numbers describe."""

from __future__ import annotations

import math
from typing import NamedTuple

from rtctl.reproduce.study import Comparison, Row, Run, Section, Table


class Printed(NamedTuple):
    """A row of table A1: "Reconstructed Duffing coefficients for 0.4 mT driving force"; no units are given."""

    point: int
    delta: float
    alpha: float
    omega: float
    gamma: float
    mass: float


TABLE_A1 = (
    Printed(1, 0.361671999593, 0.278040544940, 4.66328953897e4, 0.339451442238, 0.065870878718),
    Printed(2, 0.363013075806, 0.309101936376, 4.66334492152e4, 0.337459733144, 0.064703821094),
    Printed(3, 0.362175254191, 0.302470915090, 4.66330440760e4, 0.337614422055, 0.065506621181),
    Printed(4, 0.362394000000, 0.303695603594, 4.66330521002e4, 0.340245000000, 0.065939000000),
    Printed(5, 0.363506320901, 0.283383704287, 4.66333831975e4, 0.332648966731, 0.064578975393),
    Printed(6, 0.362433330694, 0.299659422394, 4.66330872224e4, 0.340984715495, 0.065939000000),
    Printed(52, 0.361974686843, 0.330977245251, 4.66330944730e4, 0.336451973259, 0.066092226877),
    Printed(53, 0.362475601632, 0.296297000000, 4.6633521067e4, 0.340245000000, 0.0661028238),
    Printed(54, 0.3621115925123, 0.299697723699, 4.66331662856e4, 0.3387779527, 0.0647517934),
    Printed(55, 0.362820938412, 0.360317841738, 4.6633158936e4, 0.3553373737, 0.0683564117),
)


def quality(mass: float, stiffness: float, damping: float) -> float:
    """Return the quality factor of m z'' + d z' + k z = 0."""
    return math.sqrt(stiffness * mass) / damping


def below_the_drive(one: Printed) -> float:
    """Return the drive's angular frequency over sqrt(Delta / mass)."""
    return one.omega / math.sqrt(one.delta / one.mass)


def compute(run: Run) -> Section:
    """Return the section."""
    qualities = [quality(one.mass, one.delta, one.alpha) for one in TABLE_A1]
    swapped = [quality(one.mass, one.alpha, one.delta) for one in TABLE_A1]
    spread = max(one.omega for one in TABLE_A1) - min(one.omega for one in TABLE_A1)
    return Section(
        title="Table A1 as it is printed (not used)",
        text=(
            "Ten of the 55 points are printed. With Delta the stiffness and Alpha the damping, or the other way round, "
            "the numbers are no resonator that could be driven at 7.42 kHz: it would be damped almost critically, and "
            'its natural frequency lies four orders below the drive. The paper notes that "all output values have been '
            'scaled" and gives no factors, so the table cannot be turned back into an oscillator. It is kept '
            "here as flagged data; nothing in this study uses it but the spread of Omega (the section on the array)."
        ),
        parts=(
            Comparison(
                title="What the printed numbers would be",
                rows=(
                    Row(quantity="quality, Delta as stiffness (largest)", unit="", paper=max(qualities), ours=None,
                        note="a resonator of this kind has some hundreds"),
                    Row(quantity="quality, Alpha as stiffness (largest)", unit="", paper=max(swapped), ours=None),
                    Row(quantity="drive over natural frequency (least)", unit="",
                        paper=min(map(below_the_drive, TABLE_A1)), ours=None, note="1 in resonance"),
                    Row(quantity="spread of Omega", unit="rad/s", paper=spread, ours=0.0,
                        note="one generator has one frequency"),
                ),
            ),
            Table(
                title="As printed, units unknown",
                headers=("point", "Delta", "Alpha", "Omega", "Gamma", "mass", "quality", "drive over natural"),
                rows=tuple(
                    (str(one.point), f"{one.delta:.6f}", f"{one.alpha:.6f}", f"{one.omega:.4f}", f"{one.gamma:.6f}",
                     f"{one.mass:.6f}", f"{quality(one.mass, one.delta, one.alpha):.2f}", f"{below_the_drive(one):.0f}")
                    for one in TABLE_A1
                ),
                numbers=tuple(range(8)),
            ),
        ),
    )  # fmt: skip
