"""A campaign made ready: units resolved, the design's axes, the parts that are the tasks."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.errors import InputError, nearest
from rtctl.border.mechanisms import without_brackets
from rtctl.border.model_file import ModelFile
from rtctl.border.units.quantities import parse_quantity
from rtctl.campaign.design import Axis, Design, grid_size
from rtctl.campaign.file import SETTINGS, Campaign, FactorTable, Raw, RecordsTable, read_campaign
from rtctl.identification.fit_record import FitRecord, make_fit_record
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.kinds import model_kind
from rtctl.orbits.forced import Forced
from rtctl.session.validation.model_validation import simulation_for
from rtctl.version import __version__
from rtctl.wiring import find_plant
from rtctl.wiring_models import build_forced, read_model

STEPS_PER_PERIOD = 128
STEPS_OF_FASTEST = 64.0
"""Steps a period of the model's fastest pole, at least."""
NS_A_SAMPLE = 100.0
"""Of a record, simulated by a lane."""
NS_A_STEP = 3.0
"""A lane's, with what is measured beside it; for the size of a part alone."""
PART_S = 4.0
LEAST_PARTS = 8
LANES = 64


class Plan(NamedTuple):
    """All that a task needs beside its number; it travels to workers as it is."""

    campaign: Campaign
    model: Any
    """Model of a kind of plant that can be simulated."""
    digest: str
    """Hash of the model's file and of the records."""
    units: Mapping[str, str]
    design: Design
    fixed: Mapping[str, float]
    """Settings that are no factors, in the units of the data."""
    steps_per_period: int
    rounded_to: float
    part: int
    """Trajectories a task."""
    records: tuple[FitRecord, ...] = ()
    """To simulate; empty: a harmonic drive."""

    @property
    def parts(self) -> int:
        """Number of tasks."""
        return math.ceil(self.design.samples / self.part)

    @property
    def fingerprint(self) -> str:
        """Return the hash of everything that the results depend on."""
        asked = self.campaign.model_copy(update={"picture": None}).model_dump_json()
        text = "|".join([__version__, asked, self.digest, str(self.steps_per_period), str(self.part)])
        return hashlib.sha256(text.encode()).hexdigest()

    def forced(self) -> Forced:
        """Return the model under harmonic drive, compiled where it is called."""
        return build_forced(self.model, self.units, self.campaign.campaign.model)


def read_plan(path: Path) -> Plan:
    """Return the plan of a campaign file. Raises InputError with every finding."""
    campaign = read_campaign(path)
    if campaign.records is not None:
        return _of_records(path, campaign, campaign.records)
    model_path = find_plant(campaign.campaign.model, path.parent)
    model = read_model(model_path, model_kind(model_path))
    units = _units(campaign, model, path)
    forced = build_forced(model, units, str(model_path))
    z, u = units["displacement"], units["drive"]
    own = {"frequency": "Hz", "amplitude": u, "displacement": z, "velocity": without_brackets(f"({z})/s")}
    resolved = _Resolved(path, {**own, **{one.name: one.unit for one in forced.parameters}})
    axes = tuple(resolved.axis(name, factor) for name, factor in campaign.factors.items())
    fixed = resolved.settings(campaign)
    rounded = resolved.number("follow.rounded_to", campaign.follow.rounded_to, units["displacement"], 0.1)
    resolved.raise_all()
    design = _design(campaign, axes)
    steps = campaign.follow.steps_per_period or _steps(forced, design, fixed)
    part = campaign.campaign.part or _part(campaign, design, fixed, steps)
    digest = hashlib.sha256(model_path.read_bytes()).hexdigest()
    return Plan(campaign, model, digest, units, design, fixed, steps, rounded, part)


def _design(campaign: Campaign, axes: tuple[Axis, ...]) -> Design:
    samples = grid_size(axes) if campaign.design.kind == "grid" else campaign.design.samples or 1
    return Design(campaign.design.kind, axes, samples, campaign.design.seed)


def _of_records(path: Path, campaign: Campaign, table: RecordsTable) -> Plan:
    """Return the plan of a model against measured records, with its parameters as factors."""
    model_path = find_plant(campaign.campaign.model, path.parent)
    dataset_path = path.parent / table.dataset
    simulation_for(
        model_path, open_dataset(dataset_path)
    )  # what does not fit is said before numbers are read
    dataset = read_dataset(dataset_path)
    simulation = simulation_for(model_path, dataset)
    model = read_model(model_path, simulation.kind)
    records = tuple(
        make_fit_record(record, dataset.holds)
        for record in dataset.records
        if table.use in ("all", record.use)
    )
    if not records:
        raise InputError(f'{path}: key "records.use": {dataset_path} has no records for "{table.use}"')
    resolved = _Resolved(path, {one.name: one.unit for one in simulation.parameters})
    axes = tuple(resolved.axis(name, factor) for name, factor in campaign.factors.items())
    resolved.raise_all()
    digest = hashlib.sha256(model_path.read_bytes())
    for record in records:
        for signal in (*record.stimulus.inputs.values(), *record.measured.values()):
            digest.update(np.ascontiguousarray(signal).tobytes())
    design = _design(campaign, axes)
    samples = sum(record.samples for record in records)
    wanted = min(PART_S / (samples * NS_A_SAMPLE * 1e-9), design.samples / LEAST_PARTS)
    part = campaign.campaign.part or LANES * max(1, min(1024, math.ceil(wanted / LANES)))
    return Plan(campaign, model, digest.hexdigest(), dataset.units, design, {}, 0, 0.0, part, records)


class _Resolved:
    """Numbers in the units of the data, and what was found wrong so far."""

    def __init__(self, path: Path, units: Mapping[str, str]) -> None:
        self._path, self._lines, self._units = path, list[str](), units

    def raise_all(self) -> None:
        if self._lines:
            raise InputError("\n".join(f"{self._path}: {line}" for line in self._lines))

    def number(self, key: str, raw: Raw | None, unit: str, default: float) -> float:
        """Return a quantity of the file; NaN, about which nothing more is reported, where it is none."""
        if raw is None:
            return default
        try:
            value = parse_quantity(raw, unit)
        except ValueError as error:
            self._lines.append(f'key "{key}": {error}')
            return math.nan
        if not math.isfinite(value):
            self._lines.append(f'key "{key}": must be finite, got {raw!r}')
        return value

    def axis(self, name: str, factor: FactorTable) -> Axis:
        """Return the axis of a factor."""
        key = f"factors.{name}"
        if name not in self._units:
            self._lines.append(f'unknown factor "{name}"{nearest(name, self._units)}')
            return Axis(name, "", 0.0, 1.0, (0.0,))
        unit = self._units[name]
        if factor.values is not None:
            values = tuple(
                self.number(f"{key}.values.{k}", raw, unit, 0.0) for k, raw in enumerate(factor.values)
            )
            self._checked_sign(name, key, min(values))
            return Axis(name, unit, min(values), max(values), values)
        low = self.number(f"{key}.low", factor.low, unit, 0.0)
        high = self.number(f"{key}.high", factor.high, unit, 1.0)
        logarithmic = factor.scale == "log"
        if low >= high and factor.count != 1:
            self._lines.append(f'key "{key}.low": {low:g} must be below high = {high:g} {unit}')
        if logarithmic and low <= 0.0:
            self._lines.append(f'key "{key}.low": {low:g} {unit} must be above 0 for scale = "log"')
            logarithmic = False
        self._checked_sign(name, key, low)
        axis = Axis(name, unit, low, high, (), logarithmic)
        if factor.count is None:
            return axis
        shares = np.linspace(0.0, 1.0, factor.count)
        return axis._replace(values=tuple(axis.at(shares).tolist()))

    def settings(self, campaign: Campaign) -> dict[str, float]:
        """Return the settings that are no factors; frequency and amplitude of the drive must be given."""
        given = {
            "frequency": ("drive", campaign.drive.frequency), "amplitude": ("drive", campaign.drive.amplitude),
            "displacement": ("start", campaign.start.displacement), "velocity": ("start", campaign.start.velocity),
        }  # fmt: skip
        fixed = {}
        for name in SETTINGS:
            table, raw = given[name]
            if name in campaign.factors:
                if raw is not None:
                    self._lines.append(f'key "{table}.{name}" is a factor as well; keep one of both')
                continue
            if raw is None and table == "drive":
                self._lines.append(f'key "drive.{name}" is missing; give it, or make it a factor')
            fixed[name] = self.number(f"{table}.{name}", raw, self._units[name], 0.0)
            if raw is not None:
                self._checked_sign(name, f"{table}.{name}", fixed[name])
        return fixed

    def _checked_sign(self, name: str, key: str, least: float) -> None:
        if name == "frequency" and least <= 0.0:
            self._lines.append(f'key "{key}": a frequency must be above 0 Hz, got {least:g} Hz')


def _units(campaign: Campaign, model: ModelFile, path: Path) -> dict[str, str]:
    """Return the units of drive and displacement."""
    found = {}
    for name in ("drive", "displacement"):
        device = model.device.get(name)
        own = device.get("unit") if isinstance(device, dict) else None
        unit = getattr(campaign.units, name) or own
        if unit is None:
            raise InputError(f'{path}: key "units.{name}" is missing: the model has no [device] that says it')
        found[name] = str(unit)
    return found


def _range(design: Design, fixed: Mapping[str, float], name: str) -> tuple[float, float]:
    """Least and largest of a setting."""
    for axis in design.axes:
        if axis.name == name:
            return axis.low, axis.high
    return fixed[name], fixed[name]


def _steps(forced: Forced, design: Design, fixed: Mapping[str, float]) -> int:
    """Return the steps of a period of the slowest drive, a multiple of 32 that resolves the model's fastest pole."""
    own = np.array([one.value for one in forced.parameters])
    corners = np.array([own, own])
    for k, one in enumerate(forced.parameters):
        for axis in design.axes:
            if axis.name == one.name:
                corners[:, k] = axis.low, axis.high
    reach = max(abs(value) for value in _range(design, fixed, "displacement"))
    drive = max(abs(value) for value in _range(design, fixed, "amplitude"))
    fastest = forced.fastest_hz(corners, reach, drive)
    wanted = STEPS_OF_FASTEST * fastest / _range(design, fixed, "frequency")[0]
    return max(STEPS_PER_PERIOD, 32 * math.ceil(wanted / 32.0))


def _part(campaign: Campaign, design: Design, fixed: Mapping[str, float], steps: int) -> int:
    """Trajectories of some seconds' work, whatever the machine: a result must not depend on who computed it."""
    low, high = _range(design, fixed, "frequency")
    seconds = campaign.follow.look * math.sqrt(low * high) * steps * NS_A_STEP * 1e-9
    wanted = min(PART_S / seconds, design.samples / LEAST_PARTS)
    return LANES * max(1, min(1024, math.ceil(wanted / LANES)))


def described(plan: Plan) -> dict[str, Any]:
    """Return the content of DIR/campaign.json."""
    return {
        "title": plan.campaign.campaign.title,
        "fingerprint": plan.fingerprint,
        "version": __version__,
        "trajectories": plan.design.samples,
        "part": plan.part,
        "parts": plan.parts,
        "steps_per_period": plan.steps_per_period,
        "units": dict(plan.units),
        "factors": [axis.name for axis in plan.design.axes],
    }
