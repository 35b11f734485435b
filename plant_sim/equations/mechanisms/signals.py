"""Mechanisms of inputs and outputs: the laws of the oscillator's drive and sensor, on any signal of a model.

What an input goes through before it reaches the equations, and what a reading goes through after it left them, does
not depend on the equations between.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

from plant_sim.equations.mechanisms.mechanism import EquationsMechanism, in_unit
from plant_sim.equations.mechanisms.sizes import Size, Sizes
from plant_sim.equations.system import System
from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.mechanisms.drive import (
    backlash,
    deadband,
    delay,
    gain_drift,
    input_hold,
    lag,
    offset,
)
from plant_sim.oscillator.mechanisms.sensor import drift, highpass, hum
from plant_sim.oscillator.mechanisms.sensor import lag as sensor_lag
from plant_sim.oscillator.mechanisms.sensor import offset as sensor_offset
from plant_sim.oscillator.mechanisms.sensor import saturation as sensor_saturation
from plant_sim.oscillator.mechanisms.timing import skew
from rtctl.border.mechanisms import Parameter, Scales

HUM_PERIODS = 10.0
"""Periods of a hum in the shortest record, at least."""


class SignalLaw(NamedTuple):
    """A law, and its sentences; {s} is the signal in the model's words."""

    law: OscillatorMechanism
    statement: str
    forms: Mapping[str, str] = {}
    inline: str = ""
    """The same as a text of the language, {x} being the signal; "" where it cannot be said so."""


def _clipping(forms: str) -> dict[str, str]:
    return {
        "curvature": forms + " saturates, with a curvature of {curvature}.",
        "clipped": forms + " is clipped at {limit}, of either sign: {clipped} of what is beyond is cut off.",
    }


INPUT_SATURATION = replace(
    sensor_saturation.MECHANISM,
    drive=lambda drive, p: drive._replace(nodes=sensor_saturation.bent(drive.nodes, p)),
    sensor=None, unread=None, stage=4, bends=True,
)  # fmt: skip
_DRIFTED = "where({settling_time} > 0, {settling_time}*(1 - exp(-t/{settling_time})), t)"
"""Drift over its first rate: see `rtctl.border.mechanisms.drift_of`."""
INPUTS: dict[str, SignalLaw] = {
    "delay": SignalLaw(delay.MECHANISM, "The {s} acts {delay} late."),
    "lag": SignalLaw(lag.MECHANISM, "The {s} lags with a time constant of {time_constant}."),
    "offset": SignalLaw(offset.MECHANISM, "The {s} has a constant part of {offset} that its samples do not show.",
                        inline="{x} + {offset}"),
    "gain_drift": SignalLaw(
        gain_drift.MECHANISM, "The gain of the {s} drifts by {rate} of itself from the start of each record.",
        {
            "settling_time": "The gain of the {s} drifts by {rate} of itself at the start of each record and settles "
            "with a time constant of {settling_time}."
        },
        inline="{x}*(1 + {rate}*" + _DRIFTED + ")",
    ),
    "saturation": SignalLaw(
        INPUT_SATURATION,
        "The {s} saturates, with a curvature of {curvature}, and {clipped} of what is beyond {limit} is cut off.",
        _clipping("The {s}"),
    ),
    "dead_band": SignalLaw(deadband.MECHANISM, "The first {width} of the {s}, of either sign, do nothing.",
                           inline="{x} - min(max({x}, -{width}), {width})"),
    "hold": SignalLaw(
        input_hold.MECHANISM,
        "Between its samples the {s} does not go on as the hold in the manifest says: a share of {toward_zero} goes on "
        'as hold = "zero" says, {toward_linear} as "linear", {toward_band_limited} as "band-limited".',
        {
            name: "Between its samples the {s} does not go on as the hold in the manifest says. "
            + input_hold.remedy(name, "NAME").replace("[signals.NAME]", "table of the manifest")
            for name in input_hold.HOLDS
        },
    ),
    "backlash": SignalLaw(
        backlash.MECHANISM,
        "The {s} has backlash: after each reversal it does nothing until it has gone back by twice {width}.",
    ),
}  # fmt: skip
OUTPUTS: dict[str, SignalLaw] = {
    "offset": SignalLaw(sensor_offset.MECHANISM, "The {s} reads {offset} too much.", inline="{x} + {offset}"),
    "lag": SignalLaw(sensor_lag.MECHANISM, "The {s} lags with a time constant of {time_constant}."),
    "highpass": SignalLaw(
        highpass.MECHANISM, "The {s} is AC-coupled: below a corner of {rate} it loses what is slow."
    ),
    "saturation": SignalLaw(
        sensor_saturation.MECHANISM,
        "The {s} saturates, with a curvature of {curvature}, and {clipped} of what is beyond {limit} is cut off.",
        _clipping("The {s}"),
    ),
    "hum": SignalLaw(hum.MECHANISM, "Hum at {frequency} is in the {s} ({cosine}, {sine})."),
    "drift": SignalLaw(
        drift.MECHANISM,
        "The {s} drifts by {rate} from the start of each record.",
        {
            "settling_time": "The {s} drifts by {rate} at the start of each record and settles with a time constant of "
            "{settling_time}."
        },
        inline="{x} + {rate}*" + _DRIFTED,
    ),
    "skew": SignalLaw(skew.MECHANISM, "The {s} is read {late} after the row's instant (below 0: before it)."),
}


def signal_mechanisms(system: System, units: Mapping[str, str], sizes: Sizes) -> list[EquationsMechanism]:
    """Return the mechanisms of all inputs and outputs.

    Args:
        system: Their names and units.
        units: Units of the data's signals by name; an output that was not measured has that of the model.
        sizes: Sizes of their courses, in these units.
    """
    found: list[EquationsMechanism] = []
    for source in system.inputs:
        found += input_mechanisms(source.name, units.get(source.name, source.unit), sizes[source.name])
    read = [one for one in system.outputs if one.name in units]
    alone = len(system.inputs) == 1 and len(read) == 1
    delays = tuple(f"input.{one.name}.delay" for one in system.inputs) if alone else ()
    for output in system.outputs:
        unit = units.get(output.name, output.unit)
        found += output_mechanisms(output.name, unit, sizes[output.name], delays)
    return found


def input_mechanisms(name: str, unit: str, size: Size) -> list[EquationsMechanism]:
    """Return the mechanisms of an input in its `unit` of the data."""
    words = f"input {name} [{unit}]"
    return [_bound(f"input.{name}.{key}", name, words, one, unit, size) for key, one in INPUTS.items()]


def output_mechanisms(name: str, unit: str, size: Size, delays: tuple[str, ...]) -> list[EquationsMechanism]:
    """Return the mechanisms of an output in its `unit` of the data.

    Args:
        name: Name of the output.
        unit: Its unit in the data.
        size: Sizes of its course.
        delays: Delays of inputs that no record tells from a reading before its time: that of a single input, where the
            output is the only one. Empty: the data tell.
    """
    words = f"output {name} [{unit}]"
    found = []
    for key, one in OUTPUTS.items():
        bound = _bound(f"output.{name}.{key}", name, words, one, unit, size)
        found.append(_other_side(bound, delays) if key == "skew" else bound)
    return found


def _bound(
    identity: str, signal: str, words: str, one: SignalLaw, unit: str, size: Size
) -> EquationsMechanism:
    def said(text: str) -> str:
        return text.replace("{s}", words)

    return EquationsMechanism(
        id=identity, statement=said(one.statement), forms={name: said(text) for name, text in one.forms.items()},
        parameters=tuple(_sized(in_unit(declared, unit), size, one.law.id) for declared in one.law.parameters),
        signal=signal, law=one.law, slow=one.law.slow,
    )  # fmt: skip


def _sized(declared: Parameter, size: Size, law: str) -> Parameter:
    """Return a parameter whose scale is that of its own signal."""
    scale: Callable[[Scales], float] = declared.scale
    reading = (
        size.rms if declared.name == "curvature" else size.deviation
    )  # it bends about 0, not about its mean

    def of_signal(scales: Scales) -> float:
        return scale(scales._replace(drive=size.rms, reading=reading, largest_reading=size.largest))

    if law == hum.MECHANISM.id and declared.is_shape:
        return replace(
            declared, scale=lambda scales: 1.0 / scales.period, default=None, shape_range=(0.0, 0.5),
            least_periods=HUM_PERIODS,
        )  # fmt: skip
    return replace(declared, scale=of_signal)


def _other_side(mechanism: EquationsMechanism, delays: tuple[str, ...]) -> EquationsMechanism:
    (late,) = mechanism.parameters
    opposite = delays[0] if delays else ""
    return replace(mechanism, parameters=(replace(late, opposite=opposite),))
