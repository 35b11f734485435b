"""The channels of a device of equations: inputs are commands, outputs readings, one output the controlled one."""

from __future__ import annotations

from pathlib import Path

from plant_sim.equations.device_table import DeviceTable, Instrument, read_device_table
from plant_sim.equations.reading import read_equations
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError
from rtctl.border.records import DeviceProfile, device_profile
from rtctl.border.units.quantities import read_toml


def profile_of(model: EquationsFile, device: DeviceTable, source: str) -> DeviceProfile:
    """Return the channels of a device. Raises InputError where the registers have no room for them.

    The controlled output has its own name where the loop does not read it, else that with "reference_" before it.
    """
    outputs = model.model.outputs
    shown = device.reference or next(iter(outputs))
    sensed = {
        name: one.unit for name, one in outputs.items() if device.outputs.get(name, Instrument()).sensed
    }
    try:
        return device_profile(
            "equations",
            commands={name: one.unit for name, one in model.model.inputs.items()},
            sensed=sensed,
            reference=(f"reference_{shown}" if shown in sensed else shown, outputs[shown].unit),
        )
    except ValueError as error:
        raise InputError(f"{source}: no device of this model: {error}") from None


def read_profile(path: Path) -> DeviceProfile:
    """Return the channels of the device of a model file or plant file. Raises InputError."""
    path = model_file_of(path)
    model = read_equations(path)
    return profile_of(model, read_device_table(model, path), str(path))


def model_file_of(path: Path) -> Path:
    """Return the model file that a plant file names under `plant.model`; a model file itself. Raises InputError."""
    plant = read_toml(path).get("plant")
    if not isinstance(plant, dict):
        return path
    named = plant.get("model")
    unknown = sorted(plant.keys() - {"kind", "model"})
    if unknown:
        raise InputError(f'{path}: unknown key "plant.{unknown[0]}"; known: kind, model')
    if not isinstance(named, str):
        raise InputError(f'{path}: key "plant.model" must name a model file of equations, got {named!r}')
    return path.parent / named
