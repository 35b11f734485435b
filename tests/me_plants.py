"""ME resonators with single keys of their file replaced, their true backbone, model files that know them less well."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from plant_sim.catalogue import bundled_plant
from plant_sim.resonator.device_file import MeDeviceFile
from rtctl.border.units.quantities import check, read_toml
from rtctl.models.harmonic_balance import backbone

SILENT: dict[str, Any] = {
    "lock_in.white": "0 um/Hz^0.5",
    "lock_in.vibrometer": "0 um/Hz^0.5",
    "lock_in.converter_bits": 0,
}


def me_file(name: str = "me_a", keys: dict[str, Any] | None = None) -> MeDeviceFile:
    """`me_file("me_a", {"beam.quality": 50.0})`."""
    tables = read_toml(bundled_plant(name))
    for key, value in (keys or {}).items():
        table, last = key.split(".")
        tables[table][last] = value
    return check(MeDeviceFile, tables, name)


def truth_hz(device: MeDeviceFile, amplitude_um: float) -> float:
    """The backbone of the plant's own parameters."""
    beam = device.beam
    stiffness = (2.0 * math.pi * beam.frequency) ** 2
    found = backbone(
        amplitude_um, stiffness=stiffness, cubic=beam.stiffness_cubic, quintic=beam.stiffness_quintic
    )
    assert found.converged
    return found.frequency_hz


def model_file(
    name: str, folder: Path, *, drive: float = 1.0, damping: float = 1.0, off_hz: float = 0.0
) -> Path:
    """A model of a bundled device, off by factors of drive and damping and by some Hz."""
    device = me_file(name)
    coil, film, beam = device.coil, device.magnetisation, device.beam
    omega = 2.0 * math.pi * beam.frequency
    lag = omega * coil.inductance / coil.resistance
    field = coil.field * 1e-3 / (4e-7 * math.pi) / math.sqrt(1.0 + lag**2)
    path = folder / f"{name}_model.toml"
    path.write_text(f"""
[model]
kind = "oscillator"
[model.parameters]
damping = {{ value = {damping * omega / beam.quality!r}, unit = "1/s" }}
stiffness = {{ value = {(omega + 2.0 * math.pi * off_hz) ** 2!r}, unit = "1/s^2" }}
stiffness_cubic = {{ value = {beam.stiffness_cubic!r}, unit = "1/(um^2*s^2)" }}
drive_gain = {{ value = {drive * beam.drive * film.susceptibility * field!r}, unit = "um/s^2/mA" }}
[provenance]
identity = "{device.plant.name}"
""")
    return path
