"""Comparison of what machines compute: to the bit among themselves and with Python, in um with the recorded loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.export.c.folder import check_origin, digest, read_manifest
from rtctl.export.c.laws.law import nth
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.in_python import WORTH_COMPILING, PythonLaw
from rtctl.export.c.proof.machines import MACHINES, REALS, build, missing, run
from rtctl.export.c.proof.recorded import Rows, inputs_of, outputs_of
from rtctl.export.c.translated import translated
from rtctl.plant_control.lookup import support_of
from rtctl.session.closed_loop import planned_step
from rtctl.session.replay import Recorded, read_run
from rtctl.session.run_folder import MODEL


@dataclass(frozen=True, slots=True, kw_only=True)
class Computed:
    """One machine in one precision."""

    machine: str
    precision: str
    differing: int
    """Outputs that differ from Python in the same precision, in any field, to the bit; in double precision from the
    recording as well."""
    first: str
    """The first difference; "": there is none."""
    skipped: str = ""
    """Why the machine was left out; "": it computed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """What came of a replay on machines."""

    rows: int
    computed: tuple[Computed, ...]
    deviations: Mapping[str, Mapping[str, float]]
    """Of single precision from the recorded loop, beside its readings and commands, of `estimate`, `command` and
    further commands by their names: largest and mean in their units (`max_um`), and in percent of the range."""

    @property
    def same(self) -> bool:
        """Whether all machines that computed gave the same bits, gcc in both precisions among them."""
        ran = [one for one in self.computed if not one.skipped]
        return bool(ran) and all(one.differing == 0 for one in ran)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures for `--json`."""
        return {
            "rows": self.rows,
            "identical": self.same,
            "machines": [asdict(one) for one in self.computed],
            "single_precision": {name: dict(figures) for name, figures in self.deviations.items()},
        }


def prove(folder: Path, run_folder: Path, machines: Sequence[str] = tuple(MACHINES)) -> Proof:
    """Compute a recorded run with an exported loop on every machine whose tools are there.

    Args:
        folder: of `rtctl export c`.
        run_folder: of a run with the same model and scenario.
        machines: names in `MACHINES`.

    Raises:
        InputError: the folders do not belong together, or no compiler is there.
    """
    manifest, recorded = read_manifest(folder), read_run(run_folder)
    if manifest.model_sha256 != digest(run_folder / MODEL):
        raise InputError(f"{folder}: exported from another model than that of the run; export it anew")
    if missing(MACHINES["gcc"]):
        raise InputError(f"replay --export: {missing(MACHINES['gcc'])}")
    law = law_of(recorded.scenario, recorded.model, manifest.extrema)
    check_origin(folder, manifest, law)
    exported = translated(law)
    step, setpoints, _ = planned_step(recorded.scenario, recorded.model)
    computed, deviations = [], {}
    for precision, real in REALS.items():
        rows, samples = inputs_of(law, recorded, setpoints, step.preview_s, real)
        in_python = PythonLaw(*exported, real, compiled=len(rows) > WORTH_COMPILING)
        oracle = in_python(rows)
        if precision == "float":
            beside = in_python(rows, _applied(recorded, samples, len(rows)))
            deviations = _deviations(recorded, beside, samples)
        else:
            computed.append(_against_recording(recorded, oracle, samples))
        computed += [_on(folder, name, precision, rows, oracle) for name in machines]
    return Proof(rows=len(samples), computed=tuple(computed), deviations=deviations)


def _on(folder: Path, name: str, precision: str, rows: Rows, oracle: Rows) -> Computed:
    machine = MACHINES[name]
    reason = missing(machine)
    if not reason and precision not in machine.precisions:
        reason = "computes double precision in software that is not rounded exactly"
    if reason:
        return Computed(machine=machine.title, precision=precision, differing=0, first="", skipped=reason)
    found = run(build(folder, machine, precision), machine, rows, oracle.dtype)
    unequal, first = differences(found, oracle)
    return Computed(machine=machine.title, precision=precision, differing=unequal, first=first)


def differences(found: Rows, expected: Rows) -> tuple[int, str]:
    """Return how many rows differ in any field, to the bit, and the first difference in words; a NaN equals a NaN."""
    unequal = np.zeros(len(found), dtype=bool)
    first = ""
    for name in found.dtype.names or ():
        one, other = found[name], expected[name]
        bits = np.dtype(f"u{one.dtype.itemsize}")
        apart = np.ascontiguousarray(one).view(bits) != np.ascontiguousarray(other).view(bits)
        if one.dtype.kind == "f":
            apart &= ~(np.isnan(one) & np.isnan(other))
        if apart.any() and not first:
            row = int(np.argmax(apart))
            first = f"row {row}, {name}: {one[row]!r} for {other[row]!r}"
        unequal |= apart
    return int(unequal.sum()), first


def _recorded_values(
    recorded: Recorded, found: Rows, samples: Any
) -> list[tuple[str, FloatArray, FloatArray]]:
    """Return name, computed and recorded values of each column; a command is the output of the row before."""
    columns = outputs_of(recorded.signals, recorded.scenario)
    return [
        (name, found[name][samples - 1 if name.startswith("level") else samples].astype(np.float64), values)
        for name, values in columns.items()
    ]


def _against_recording(recorded: Recorded, found: Rows, samples: Any) -> Computed:
    """Compare the translated law in Python with the recorded loop."""
    unequal, first = np.zeros(len(samples), dtype=bool), ""
    for name, one, other in _recorded_values(recorded, found, samples):
        apart = (one.view(np.uint64) != other.view(np.uint64)) & ~(np.isnan(one) & np.isnan(other))
        if apart.any() and not first:
            row = int(np.argmax(apart))
            first = f"sample {int(recorded.signals['index'][row])}, {name}: {one[row]!r} for {other[row]!r}"
        unequal |= apart
    return Computed(
        machine="the recorded loop",
        precision="double",
        differing=int(unequal.sum()),
        first=first,
    )


def _applied(recorded: Recorded, samples: Any, count: int) -> FloatArray:
    """Return the recorded commands (count, commands) before each sample; NaN where a row is no sample."""
    names = [one.name for one in recorded.scenario.profile.commands]
    applied = np.full((count, len(names)), np.nan)
    applied[samples] = np.stack([np.asarray(recorded.signals[name]) for name in names], axis=1)
    return applied


def _deviations(recorded: Recorded, found: Rows, samples: Any) -> dict[str, dict[str, float]]:
    """Return how far single precision is from the recorded loop, fed the recorded readings and commands.

    With its own commands, which the recorded readings do not answer, an unstable controller of a stable loop would
    drift away by itself.
    """
    reach = support_of(recorded.scenario.scenario.plant).output_range(recorded.scenario, recorded.model)
    profile = recorded.scenario.profile
    units = {"estimate": ("estimate", profile.reference.unit)}
    units |= {
        nth("level", k): ("command" if k == 0 else one.name, one.unit)
        for k, one in enumerate(profile.commands)
    }
    report: dict[str, dict[str, float]] = {}
    for name, one, other in _recorded_values(recorded, found, samples):
        if name in units:
            apart, (title, unit) = np.abs(one - other), units[name]
            report[title] = {f"max_{unit}": float(apart.max()), f"mean_{unit}": float(apart.mean())}
    report["estimate"]["max_percent"] = (
        100.0 * report["estimate"][f"max_{profile.reference.unit}"] / reach.width
    )
    return report
