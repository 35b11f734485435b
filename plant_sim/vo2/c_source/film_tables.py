"""The film of a VO2 device file as C constants, for a board that simulates it (drivers/firmware/simulated_film/film.h).

Numbers are float32, written with the fewest digits that read back as the same bits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.vo2.device_file import DeviceFile
from plant_sim.vo2.domains import ELECTRICAL, STRUCTURAL, Domains, draw
from plant_sim.vo2.relays import banks
from rtctl.border.errors import InputError

MOST_DOMAINS = 65535
"""What a 16-bit index of a domain can tell apart."""
TRANSITIONS = {"electrical": ELECTRICAL, "structural": STRUCTURAL}


def film_tables(device: DeviceFile, source: Path) -> str:
    """Return the C source of `film` and of the board's nameplate.

    Args:
        device: The device.
        source: Its file, for messages.

    Raises:
        InputError: The C film lacks something that this device has.
    """
    hysteresis = device.hysteresis
    if not isinstance(hysteresis, Domains):
        raise InputError(
            f'{source}: key "hysteresis.kind": the film of the firmware has "domains" only, got "{hysteresis.kind}"; '
            "choose a device such as vo2_a or vo2_b"
        )
    if hysteresis.count > MOST_DOMAINS:
        raise InputError(
            f'{source}: key "hysteresis.count": the film of the firmware has at most {MOST_DOMAINS} domains, '
            f"got {hysteresis.count}"
        )
    if device.effects.any:
        raise InputError(
            f'{source}: key "effects": the film of the firmware has no effects; leave this table out, '
            "or serve the device by rtctl serve --serial"
        )
    return "\n".join((_HEAD, *_tables(hysteresis), *_nameplate(device), *_constants(device, hysteresis), ""))


_HEAD = """\
/* Tables of the simulated film, written by `rtctl firmware`. */
#include "film.h"
#include "rtctl_board.h"
"""


def _tables(hysteresis: Domains) -> Iterable[str]:
    sorted_banks = banks(draw(hysteresis))
    size = hysteresis.count
    for name, row in TRANSITIONS.items():
        yield _array("float", f"{name}_t_up", map(_number, sorted_banks.t_up[row]), size)
        yield _array("float", f"{name}_t_down", map(_number, sorted_banks.t_down[row]), size)
        yield _array("uint16_t", f"{name}_by_t_down", map(str, sorted_banks.by_t_down[row]), size)
        yield f"static uint8_t {name}_is_up[{(size + 7) // 8}];\n"


def _array(kind: str, name: str, numbers: Iterable[str], size: int) -> str:
    words = list(numbers)
    lines = (", ".join(words[k : k + 10]) for k in range(0, size, 10))
    body = ",\n    ".join(lines)
    return f"static const {kind} {name}[{size}] = {{\n    {body}\n}};\n"


def _nameplate(device: DeviceFile) -> Iterable[str]:
    current = device.current
    name = re.sub(r'([\\"?])', r"\\\1", device.plant.name)  # ??/ is a backslash of C99
    yield "const board_nameplate board = {"
    yield f'    .name = "{name}",'
    yield from _fields({"low_mA": current.low, "high_mA": current.high, "safe_mA": current.safe})
    yield "};\n"


def _constants(device: DeviceFile, hysteresis: Domains) -> Iterable[str]:
    heating, resistance, deflection, sensing = (
        device.heating, device.resistance, device.deflection, device.sensing,
    )  # fmt: skip
    half_counts = 2.0 ** (sensing.converter_bits - 1) if sensing.converter_bits else 0.0
    yield "const film_constants film = {"
    yield f"    .count = {hysteresis.count},"
    yield f"    .mixing = FILM_{resistance.mixing.name},"
    yield from _fields(
        {
            "ambient_degC": heating.ambient,
            "time_constant_s": heating.time_constant,
            "gain_K_per_mA2": heating.gain,
            "coupling_K": hysteresis.coupling,
            "ln_prefactor": math.log(resistance.prefactor),
            "activation_K": resistance.activation,
            "ln_metal": math.log(resistance.metal),
            "dimension": resistance.dimension,
            "rest_um": deflection.rest,
            "stroke_um": deflection.stroke,
            "expansion_um_per_K": deflection.expansion,
            "sense_A": 1e-3 * sensing.current,
            "white_V": sensing.white,
            "converter_V": sensing.converter_range,
            "converter_counts": half_counts,
            "reference_um": sensing.reference,
        }
    )
    yield "    .domains = {"
    for name in TRANSITIONS:
        yield f"        {{ {name}_t_up, {name}_t_down, {name}_by_t_down, {name}_is_up }},"
    yield "    },\n};"


def _fields(values: dict[str, float]) -> Iterable[str]:
    return (f"    .{name} = {_number(value)}," for name, value in values.items())


def _number(value: float | NDArray[Any]) -> str:
    """Return a float constant of C."""
    text = str(np.float32(value))
    return f"{text}f" if "." in text or "e" in text else f"{text}.0f"
