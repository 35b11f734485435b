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
from numpy.typing import NDArray

from rtctl.border.errors import InputError
from rtctl.border.quantities import parse_quantity, read_toml
from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.gap_free import GapFreeModel
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.preisach import PreisachModel

FloatArray = NDArray[np.float64]
NOMINAL_TIME_CONSTANT_S = 1.8e-3


class Span(NamedTuple):
    """A closed range, in the unit that its owner says."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """high - low."""
        return self.high - self.low


class FitQuality(NamedTuple):
    """Errors of one model on the data that it was fitted to."""

    mean_abs: float
    max_abs: float
    rms: float
    unit: str
    range: float
    """Of the output, same unit; the percentages are of this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2Model:
    """Everything that estimator and tuning use. Currents mA, resistances ohm, deflections um."""

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
    """v -> -R [kohm] with an analytic inverse: the paper's composite, first half."""
    composite_egpi: EgpiModel
    """The surrogate of that inverse -> deflection: the paper's composite, second half."""
    resistance_gap_free: GapFreeModel
    """v -> -ln R, strictly increasing: inverse without a gap."""
    gap_free_egpi: EgpiModel
    """The surrogate of that inverse -> deflection."""
    deflection_egpi: EgpiModel
    """v -> deflection, v the applied current: what an EGPI can do if the surrogate is exact (figure 8b)."""
    resistance_preisach: PreisachModel
    """v -> -ln R on a fine grid."""
    deflection_preisach: PreisachModel
    """v -> deflection on a fine grid."""
    direct_preisach: PreisachModel
    """-ln R -> deflection, ten levels: the paper's first baseline."""
    direct_egpi: EgpiModel
    """-ln R -> deflection: the paper's second baseline."""
    quality: Mapping[str, FitQuality] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)

    def with_provenance(self, **entries: str) -> Vo2Model:
        """The same model, knowing where it comes from."""
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
_SPANS = {"current": "mA", "resistance": "ohm", "deflection": "um"}


def model_tables(model: Vo2Model) -> dict[str, Any]:
    """The model as TOML tables."""
    tau_ms, error_ms = model.time_constant_s * 1e3, model.time_constant_error_s * 1e3
    parameters: dict[str, Any] = {
        "thermal_time_constant": _interval(tau_ms, 2.0 * error_ms, "ms"),
        "reading_error": {"value": model.reading_error, "unit": "dimensionless"},
        "deflection_error": {"value": model.deflection_error, "unit": "um"},
    }
    for name, unit in _SPANS.items():
        span: Span = getattr(model, name)
        parameters[f"{name}_low"] = {"value": span.low, "unit": unit}
        parameters[f"{name}_high"] = {"value": span.high, "unit": unit}
    return {
        "model": {
            "kind": "vo2",
            "identity": model.identity,
            "provenance": dict(model.provenance),
            "parameters": parameters,
            "quality": {name: quality._asdict() for name, quality in model.quality.items()},
            "hysteresis": {name: getattr(model, name).to_table() for name in _HYSTERESIS},
        }
    }


def _interval(value: float, half_width: float, unit: str) -> dict[str, Any]:
    table: dict[str, Any] = {"value": value, "unit": unit}
    if np.isfinite(half_width):
        table |= {"low": value - half_width, "high": value + half_width}
    return table


def write_model(model: Vo2Model, path: Path) -> None:
    """Write the model file whole or not at all."""
    import tomli_w

    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(tomli_w.dumps(model_tables(model)), encoding="utf-8")
    part.replace(path)


def read_model(path: Path) -> Vo2Model:
    """Read a model file. Raises InputError naming file and key."""
    tables = read_toml(path).get("model")
    if not isinstance(tables, dict):
        raise InputError(f"{path}: table [model] is missing; a model file comes from `rtctl identify`")
    if tables.get("kind") != "vo2":
        raise InputError(
            f'{path}: key "model.kind": this is a model of {tables.get("kind")!r}, the scenario drives a "vo2" device'
        )
    try:
        return _from_tables(tables)
    except (KeyError, TypeError, ValueError) as error:
        what = f"key {error} is missing" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{path}: [model]: {what}; make it anew with `rtctl identify`") from None


def _from_tables(tables: dict[str, Any]) -> Vo2Model:
    parameters = tables["parameters"]

    def value(name: str, unit: str) -> float:
        number = parse_quantity({k: parameters[name][k] for k in ("value", "unit")}, unit)
        if not np.isfinite(number):
            raise ValueError(f"parameters.{name} = {number} {unit} must be finite")
        return number

    spans = {n: Span(value(f"{n}_low", unit), value(f"{n}_high", unit)) for n, unit in _SPANS.items()}
    for name, span in spans.items():
        if not span.low < span.high:
            raise ValueError(
                f"parameters.{name}_low = {span.low:g} must be below {name}_high = {span.high:g}"
            )
    tau = parameters["thermal_time_constant"]
    stored = tables["hysteresis"]
    hysteresis: dict[str, Any] = {name: kind.from_table(stored[name]) for name, kind in _HYSTERESIS.items()}
    tau_s = value("thermal_time_constant", "s")
    if not tau_s > 0.0:
        raise ValueError(f"parameters.thermal_time_constant must be > 0 s, got {tau_s!r}")
    half_ms = (tau["high"] - tau["low"]) / 2.0 if "high" in tau else float("inf")
    return Vo2Model(
        identity=str(tables.get("identity", "")),
        time_constant_s=tau_s,
        time_constant_error_s=half_ms / 2.0 * tau_s / max(float(tau["value"]), 1e-300),
        reading_error=value("reading_error", "dimensionless"),
        deflection_error=value("deflection_error", "um"),
        quality={name: FitQuality(**entry) for name, entry in tables.get("quality", {}).items()},
        provenance=dict(tables.get("provenance", {})),
        current=spans["current"],
        resistance=spans["resistance"],
        deflection=spans["deflection"],
        **hysteresis,
    )
