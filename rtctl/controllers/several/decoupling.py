"""Static decoupling: commands for each output alone, from the steady-state gains of a plant with several of both.

    y = G u at rest,   u = K v,   K = G' (G G')^-1,   so that G K = I: each v moves its own output, and no other at rest

With more commands than outputs, K is the choice of least commands, each over its range.

Reference: S. Skogestad, I. Postlethwaite, Multivariable Feedback Control, 2nd ed., sections 3.4.1 (decoupling) and 3.3
(singular values).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray

MOST_CONDITION = 100.0
"""Condition number beyond which gains are not inverted: 1 % of error in a gain is then an output's whole motion
(Skogestad and Postlethwaite, section 3.3.1, call plants of more than 10 hard to decouple)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoupler:
    """Gains of a plant and their inverse, in the units of commands and outputs."""

    gains: FloatArray
    """(outputs, commands)"""
    inverse: FloatArray
    """(commands, outputs)"""
    condition: float
    """Largest over smallest gain over all directions, ranges taken as units."""


def decoupler(
    gains: FloatArray,
    command_spans: FloatArray,
    output_spans: FloatArray,
    commands: Sequence[str],
    outputs: Sequence[str],
) -> Decoupler:
    """Return the decoupler of steady-state gains.

    Args:
        gains: Gains (outputs, commands) at the working point.
        command_spans: Range of each command (commands,).
        output_spans: Range of each output (outputs,).
        commands: Names for messages.
        outputs: Names for messages.

    Raises:
        ValueError: There are more outputs than commands, or some combination of outputs hardly answers.
    """
    if len(outputs) > len(commands):
        raise ValueError(
            f"{len(commands)} commands ({', '.join(commands)}) cannot hold {len(outputs)} outputs "
            f"({', '.join(outputs)}); leave out a reference, or add an input to the model"
        )
    scaled = gains * command_spans / output_spans[:, None]
    if not np.isfinite(scaled).all():
        raise ValueError(
            "the gains at rest are not finite; look at the equations at the middle of the limits"
        )
    left, sizes, _ = np.linalg.svd(scaled)
    condition = float(sizes[0] / sizes[-1]) if sizes[-1] > 0.0 else float("inf")
    if not condition <= MOST_CONDITION:
        raise ValueError(
            f"the steady-state gains of {', '.join(outputs)} by {', '.join(commands)} are nearly singular: condition "
            f"number {condition:.3g}, at most {MOST_CONDITION:g}; the combination {_combined(left[:, -1], outputs)} "
            "hardly answers to any command; leave out one of these references, or take an input that moves it"
        )
    inverse = (command_spans[:, None] * np.linalg.pinv(scaled)) / output_spans
    return Decoupler(gains=gains, inverse=inverse, condition=condition)


def _combined(weights: FloatArray, names: Sequence[str]) -> str:
    """Return a combination of outputs in words, shares of their ranges, without what hardly counts."""
    largest = float(np.abs(weights).max())
    weights = weights * np.sign(weights[int(np.abs(weights).argmax())])
    parts = [
        f"{weight:+.2g} {name}"
        for weight, name in zip(weights, names, strict=True)
        if abs(weight) > 0.1 * largest
    ]
    return " ".join(parts).removeprefix("+")
