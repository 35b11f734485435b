"""The campaign file: a model, a drive, a design over factors, and the outputs that are kept of each trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import Checked, Quantity, check, read_toml

OUTPUTS = (
    "kind", "kind_by_rule", "attractor", "period", "settled_s", "exponent", "lowest", "highest", "end_displacement",
    "end_velocity", "turning_points", "stroboscopic",
)  # fmt: skip
"""Outputs of a motion under harmonic drive."""
RECORD_OUTPUTS = ("rms_error", "nrmse")
"""Outputs of a simulation of records, one of each for each measured output."""
SETTINGS = ("frequency", "amplitude", "displacement", "velocity")
"""Factors beside the parameters of the model."""
Raw = str | int | float | dict[str, Any]


class CampaignTable(Checked):
    """Table [campaign]."""

    title: str
    model: str
    """A model file beside the campaign, or a bundled oscillator."""
    outputs: Annotated[tuple[str, ...], Field(min_length=1)]
    part: Annotated[int, Field(ge=1)] | None = None
    """Trajectories per task; None: some seconds' worth."""


class UnitsTable(Checked):
    """Table [units] of the data; without it those of the model's `[device]` table."""

    drive: str | None = None
    displacement: str | None = None


class DriveTable(Checked):
    """Table [drive]: amplitude cos(2 pi frequency t)."""

    frequency: Raw | None = None
    amplitude: Raw | None = None


class StartTable(Checked):
    """Table [start]: state at the drive's crest."""

    displacement: Raw | None = None
    velocity: Raw | None = None


class FollowTable(Checked):
    """Table [follow]: how long and how finely motions are integrated."""

    look: Annotated[float, Quantity("s"), Field(gt=0.0, allow_inf_nan=False)] = 100.0
    most: Annotated[float, Quantity("s"), Field(gt=0.0, allow_inf_nan=False)] = 1000.0
    steps_per_period: Annotated[int, Field(ge=32, le=100_000, multiple_of=32)] | None = None
    rounded_to: Raw | None = None

    @model_validator(mode="after")
    def _in_order(self) -> FollowTable:
        if self.most < self.look:
            raise ValueError(f"most = {self.most:g} s must not be below look = {self.look:g} s")
        return self


class RecordsTable(Checked):
    """Table [records]: records to simulate instead of a harmonic drive."""

    dataset: str
    """A manifest beside the campaign."""
    use: Literal["fit", "test", "all"] = "all"


class DesignTable(Checked):
    """Table [design]."""

    kind: Literal["grid", "latin-hypercube", "random"]
    samples: Annotated[int, Field(ge=1)] | None = None
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="after")
    def _counted(self) -> DesignTable:
        if self.kind == "grid" and self.samples is not None:
            raise ValueError('a grid has no samples; give each factor its "count" or "values"')
        if self.kind != "grid" and self.samples is None:
            raise ValueError(f'a {self.kind} design needs "samples"')
        return self


class FactorTable(Checked):
    """Table [factors.NAME]: an interval, or the values themselves."""

    low: Raw | None = None
    high: Raw | None = None
    count: Annotated[int, Field(ge=1)] | None = None
    values: tuple[Raw, ...] | None = None
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _one_way(self) -> FactorTable:
        interval = self.low is not None and self.high is not None
        if interval == (self.values is not None) or (self.low is None) != (self.high is None):
            raise ValueError('either "low" and "high" or "values" are needed')
        if self.values is not None and (not self.values or self.count is not None):
            raise ValueError('"values" are at least one and need no "count"')
        return self


class PictureTable(Checked):
    """Table [picture]: a plane of two factors coloured by an output, or an output over one factor."""

    kind: Literal["basins", "bifurcation"]
    x: str
    y: str | None = None
    show: str


class Campaign(Checked):
    """A whole campaign file."""

    campaign: CampaignTable
    units: UnitsTable = UnitsTable()
    drive: DriveTable = DriveTable()
    start: StartTable = StartTable()
    follow: FollowTable = FollowTable()
    records: RecordsTable | None = None
    design: DesignTable
    factors: Annotated[dict[str, FactorTable], Field(min_length=1)]
    picture: PictureTable | None = None

    @model_validator(mode="after")
    def _fits(self) -> Campaign:
        lines = self.output_findings()
        for name, factor in self.factors.items():
            in_grid = self.design.kind == "grid"
            if in_grid and factor.values is None and factor.count is None:
                lines.append(f'key "factors.{name}.count" is missing: a grid needs it, or "values"')
            if not in_grid and (factor.values is not None or factor.count is not None):
                lines.append(f'key "factors.{name}": a {self.design.kind} design takes "low" and "high" only')
        if self.picture is not None:
            lines += self.picture_findings(self.picture)
        if lines:
            raise ValueError("; ".join(lines))
        return self

    def output_findings(self) -> list[str]:
        """Return findings on unknown outputs and on tables without effect."""
        known = OUTPUTS if self.records is None else RECORD_OUTPUTS
        lines = [
            f'key "campaign.outputs": unknown value "{name}"{nearest(name, known)}'
            for name in self.campaign.outputs if name not in known
        ]  # fmt: skip
        if self.records is not None:
            for name in sorted({"drive", "start", "follow", "units"} & self.model_fields_set):
                lines.append(f'key "{name}": records bring their own; leave [{name}] out, or [records]')
        return lines

    def picture_findings(self, picture: PictureTable) -> list[str]:
        """Return findings on [picture]."""
        lines = []
        for key, name in (("x", picture.x), ("y", picture.y)):
            if name is not None and name not in self.factors:
                lines.append(f'key "picture.{key}": "{name}" is no factor{nearest(name, self.factors)}')
        if picture.show not in self.campaign.outputs:
            lines.append(f'key "picture.show": "{picture.show}" is not among campaign.outputs; add it there')
        if (picture.kind == "basins") != (picture.y is not None):
            lines.append('key "picture.y": basins have one, a bifurcation diagram has none')
        return lines


def read_campaign(path: Path) -> Campaign:
    """Return the checked file. Raises InputError with every finding."""
    return check(Campaign, read_toml(path), str(path))


def find_campaign(name: str) -> Path:
    """Return the path of a campaign, or of a bundled one by name. Raises InputError."""
    from rtctl.scenario.bundled import bundled_scenarios

    path = Path(name)
    if path.is_file():
        return path
    known = {file.stem: file for file in (bundled_scenarios() / "sweeps").glob("*.toml")}
    if not path.suffix and name in known:
        return known[name]
    raise InputError(f"{name}: no such campaign file{nearest(path.stem, known)}")
