"""The identified VO2 model: heating, read-outs of resistance and deflection, and how well each fits.

Read-outs of resistance give `-ln R` [ln ohm]: it rises with temperature as the envelopes do, and an error is the
same fraction of R in the semiconductor and in the metal. The paper's GPI alone gives -R, as in the paper.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.errors import InputError, nearest
from rtctl.border.file_kinds import check_file_kind
from rtctl.border.model_file import MechanismTable, Value
from rtctl.border.units.quantities import parse_quantity, read_toml
from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.gap_free import GapFreeModel
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.models.span import Span
from rtctl.models.vo2_extensions import corrections_of, extension_tables, mechanisms_of

NOMINAL_TIME_CONSTANT_S = 1.8e-3
SURROGATE = ("surrogate", "mA")
"""Name and unit of the surrogate of temperature: the constant current that would hold it."""


class FitQuality(NamedTuple):
    """Errors of one model on the data that it was fitted to."""

    mean_abs: float
    max_abs: float
    rms: float
    unit: str
    range: float
    """Range of the output, in the same unit; the percentages refer to it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2Model:
    """Everything that estimator and tuning use. Currents in mA, resistances in ohm, deflections in um."""

    identity: str
    time_constant_s: float
    time_constant_error_s: float
    current: Span
    resistance: Span
    deflection: Span
    reading_error: float
    """Standard deviation of a single reading of ln R about the fine model."""
    deflection_error: float
    """Standard deviation of the fine deflection model on its data [um]."""
    resistance_gpi: GpiModel
    """GPI v -> -R [kohm] with an analytic inverse: the paper's composite, first half."""
    composite_egpi: EgpiModel
    """EGPI from the surrogate of that inverse to deflection: the paper's composite, second half."""
    resistance_gap_free: GapFreeModel
    """Gap-free model v -> -ln R, strictly increasing: its inverse has no gap."""
    gap_free_egpi: EgpiModel
    """EGPI from the surrogate of that inverse to deflection."""
    deflection_egpi: EgpiModel
    """EGPI v -> deflection, v the applied current: the best an EGPI can do with an exact surrogate (figure 8b)."""
    resistance_preisach: PreisachModel
    """Preisach model v -> -ln R on a fine grid."""
    deflection_preisach: PreisachModel
    """Preisach model v -> deflection on a fine grid."""
    direct_preisach: PreisachModel
    """Preisach model -ln R -> deflection, ten levels: the paper's first baseline."""
    direct_egpi: EgpiModel
    """EGPI -ln R -> deflection: the paper's second baseline."""
    quality: Mapping[str, FitQuality] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    corrections: Mapping[str, Value] = field(default_factory=dict)
    """Gains and offsets of its signals from a refit; empty for a model that is only identified."""
    timing_skew_rows: float = 0.0
    """Sample periods by which a row's readings are taken after its current has begun to act; 0: just before it acts."""
    reading_error_elsewhere: float | None = None
    """RMS error of the fine model of ln R on swings that it was not fitted to (cross-validation); None: not known."""
    deflection_error_elsewhere: float | None = None
    """The same of the fine deflection model [um]."""
    mechanisms: tuple[MechanismTable, ...] = ()
    """Extensions by their ids; estimators and tuning do not use them."""

    @property
    def reads_after(self) -> bool:
        """Whether a row's readings answer its own current, and not only that of the row before."""
        return self.timing_skew_rows > 0.5

    @property
    def kind(self) -> str:
        """Name of the model's kind of plant."""
        return "vo2"

    def with_provenance(self, **entries: str) -> Vo2Model:
        """Return the same model with its provenance."""
        return replace(self, provenance={**self.provenance, **entries})


_HYSTERESIS: dict[str, Any] = {
    "resistance_gpi": GpiModel,
    "composite_egpi": EgpiModel,
    "resistance_gap_free": GapFreeModel,
    "gap_free_egpi": EgpiModel,
    "deflection_egpi": EgpiModel,
    "resistance_preisach": PreisachModel,
    "deflection_preisach": PreisachModel,
    "direct_preisach": PreisachModel,
    "direct_egpi": EgpiModel,
}
_QUALITY = (
    "resistance_gpi",
    "composite",
    "gap_free_composite",
    "resistance_gap_free",
    "resistance_preisach",
    "deflection_egpi",
    "deflection_preisach",
    "direct_preisach",
    "direct_egpi",
)
_OPTIONAL = {
    "timing_skew_rows": ("dimensionless", 1.0),
    "reading_error_elsewhere": ("dimensionless", np.inf),
    "deflection_error_elsewhere": ("um", np.inf),
}
"""Fields that a model file need not have: unit and highest value; the lowest is 0."""
_SPANS = {"current": "mA", "resistance": "ohm", "deflection": "um"}


def model_tables(model: Vo2Model) -> dict[str, Any]:
    """Return the model as TOML tables."""
    parameters: dict[str, Any] = {
        "thermal_time_constant": _interval(model.time_constant_s, model.time_constant_error_s, "s"),
        "reading_error": {"value": model.reading_error, "unit": "dimensionless"},
        "deflection_error": {"value": model.deflection_error, "unit": "um"},
    }
    for name, (unit, _) in _OPTIONAL.items():
        value = getattr(model, name)
        if value:
            parameters[name] = {"value": value, "unit": unit}
    for name, unit in _SPANS.items():
        span: Span = getattr(model, name)
        parameters[f"{name}_low"] = {"value": span.low, "unit": unit}
        parameters[f"{name}_high"] = {"value": span.high, "unit": unit}
    corrections, mechanisms = extension_tables(model.corrections, model.mechanisms)
    parameters |= corrections
    return {
        "model": {
            "kind": "vo2",
            "identity": model.identity,
            "provenance": dict(model.provenance),
            "parameters": parameters,
            "quality": {name: quality._asdict() for name, quality in model.quality.items()},
            "hysteresis": {name: getattr(model, name).to_table() for name in _HYSTERESIS},
        }
        | ({"mechanisms": mechanisms} if mechanisms else {})
    }


def _interval(value: float, standard_error: float, unit: str) -> dict[str, Any]:
    """Return a quantity with its standard error and two of them either side; the value alone where that is infinite."""
    table: dict[str, Any] = {"value": value, "unit": unit}
    if np.isfinite(standard_error):
        low, high = value - 2.0 * standard_error, value + 2.0 * standard_error
        table |= {"standard_error": standard_error, "low": low, "high": high}
    return table


def write_model(model: Vo2Model, path: Path) -> None:
    """Write the model file whole or not at all."""
    from rtctl.models.provenance import write_model_file

    write_model_file(path, model_tables(model), model.provenance)


def save_model(path: Path, model: Vo2Model) -> None:
    """Write the model file, as `write_model` does; the order of arguments that kinds of plant have in common."""
    write_model(model, path)


def read_model(path: Path) -> Vo2Model:
    """Read a model file. Raises InputError naming file and key."""
    found = read_toml(path)
    check_file_kind(found, path, "model")
    tables = found.get("model")
    if not isinstance(tables, dict):
        raise InputError(f"{path}: table [model] is missing; a model file comes from `rtctl identify`")
    if tables.get("kind") != "vo2":
        raise InputError(
            f'{path}: key "model.kind": this is a model of {tables.get("kind")!r}, the scenario drives a "vo2" device'
        )
    try:
        return _from_tables(tables)
    except (_WrongKeyError, InputError) as error:
        raise InputError(f"{path}: {error}; make the model anew with `rtctl identify`") from None


class _WrongKeyError(ValueError):
    """A key below [model] and what is wrong with it."""

    def __init__(self, key: str, what: str) -> None:
        super().__init__(f'key "model.{key}" {what}')


def _from_tables(model: dict[str, Any]) -> Vo2Model:
    parameters = _table(model, "parameters")
    spans = {name: _span_of(parameters, name, unit) for name, unit in _SPANS.items()}
    if not spans["current"].low >= 0.0:
        raise _WrongKeyError("parameters.current_low", f"must be >= 0 mA, got {spans['current'].low:g}")
    if not spans["resistance"].low > 0.0:
        raise _WrongKeyError("parameters.resistance_low", f"must be > 0 ohm, got {spans['resistance'].low:g}")
    tables = _table(model, "hysteresis")
    hysteresis: dict[str, Any] = {
        name: _hysteresis_of(_table(tables, name, "hysteresis."), name, kind)
        for name, kind in _HYSTERESIS.items()
    }
    optional: dict[str, Any] = {
        name: _within(parameters, name, unit, high)
        for name, (unit, high) in _OPTIONAL.items()
        if name in parameters
    }
    tau_s = _positive(parameters, "thermal_time_constant", "s")
    return Vo2Model(
        identity=str(model.get("identity", "")),
        time_constant_s=tau_s,
        time_constant_error_s=_standard_error_of(parameters, "thermal_time_constant", tau_s, "s"),
        current=spans["current"],
        resistance=spans["resistance"],
        deflection=spans["deflection"],
        reading_error=_positive(parameters, "reading_error", "dimensionless"),
        deflection_error=_positive(parameters, "deflection_error", "um"),
        quality=_quality_of(_table(model, "quality")),
        provenance={key: str(value) for key, value in _table(model, "provenance").items()},
        corrections=corrections_of(parameters),
        mechanisms=mechanisms_of(model),
        **optional,
        **hysteresis,
    )


def _table(tables: dict[str, Any], name: str, within: str = "") -> dict[str, Any]:
    if name not in tables:
        raise _WrongKeyError(within + name, "is missing")
    table = tables[name]
    if not isinstance(table, dict):
        raise _WrongKeyError(within + name, f"must be a table, got {table!r}")
    return table


def _number(parameters: dict[str, Any], name: str, unit: str, part: str = "value") -> float:
    """Return `part` of the quantity `name`, in `unit`, finite."""
    table, key = _table(parameters, name, "parameters."), f"parameters.{name}"
    for needed in (part, "unit"):
        if needed not in table:
            raise _WrongKeyError(f"{key}.{needed}", "is missing")
    try:
        number = parse_quantity({"value": table[part], "unit": table["unit"]}, unit)
    except ValueError as error:
        raise _WrongKeyError(f"{key}.{part}", f": {error}") from None
    if not np.isfinite(number):
        raise _WrongKeyError(f"{key}.{part}", f"must be finite, got {number} {unit}")
    return number


def _positive(parameters: dict[str, Any], name: str, unit: str) -> float:
    number = _number(parameters, name, unit)
    if not number > 0.0:
        raise _WrongKeyError(f"parameters.{name}", f"must be > 0 {unit}, got {number:g}")
    return number


def _within(parameters: dict[str, Any], name: str, unit: str, high: float) -> float:
    """Return the quantity, from 0 to `high`."""
    number = _number(parameters, name, unit)
    if not 0.0 <= number <= high:
        limits = f"0 to {high:g}" if np.isfinite(high) else ">= 0"
        raise _WrongKeyError(f"parameters.{name}", f"must be {limits} {unit}, got {number:g}")
    return number


def _span_of(parameters: dict[str, Any], name: str, unit: str) -> Span:
    span = Span(_number(parameters, f"{name}_low", unit), _number(parameters, f"{name}_high", unit))
    if not span.low < span.high:
        raise _WrongKeyError(
            f"parameters.{name}_low",
            f"= {span.low:g} {unit} must be below {name}_high = {span.high:g} {unit}",
        )
    return span


def _standard_error_of(parameters: dict[str, Any], name: str, value: float, unit: str) -> float:
    """Return the standard error where it is written, else a quarter of low to high, else infinity."""
    written = _table(parameters, name).keys()
    if not written & {"low", "high", "standard_error"}:
        return float("inf")
    low, high = _number(parameters, name, unit, "low"), _number(parameters, name, unit, "high")
    if not low <= value <= high:
        raise _WrongKeyError(
            f"parameters.{name}.low", f"to high = {low:g} to {high:g} {unit} must hold {value:g} {unit}"
        )
    if "standard_error" not in written:
        return (high - low) / 4.0
    return _number(parameters, name, unit, "standard_error")


def _hysteresis_of(table: dict[str, Any], name: str, kind: Any) -> Any:
    try:
        return kind.from_table(table)
    except InputError as error:
        raise _WrongKeyError(f"hysteresis.{name}", f": {error}") from None


def _quality_of(tables: dict[str, Any]) -> dict[str, FitQuality]:
    quality = {}
    for name in _QUALITY:
        table = _table(tables, name, "quality.")
        for key in table.keys() | set(FitQuality._fields):
            where = f"quality.{name}.{key}"
            if key not in FitQuality._fields:
                raise _WrongKeyError(where, f"is unknown{nearest(key, FitQuality._fields)}")
            if key not in table:
                raise _WrongKeyError(where, "is missing")
            good = isinstance(table[key], str) if key == "unit" else isinstance(table[key], int | float)
            if not good or (key != "unit" and not 0.0 <= table[key] < np.inf):
                raise _WrongKeyError(
                    where, f"must be {'a unit' if key == 'unit' else '>= 0'}, got {table[key]!r}"
                )
        quality[name] = FitQuality(*(table[key] for key in FitQuality._fields))
    return quality
