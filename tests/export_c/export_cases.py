"""An exported loop beside Python: what tests of all loops ask of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtctl.api.exporting.c import replay_export
from rtctl.export.c.laws.law import Law
from rtctl.export.c.proof.comparison import differences, prove
from rtctl.export.c.proof.corners import corner_rows
from rtctl.export.c.proof.in_python import PythonLaw
from rtctl.export.c.proof.machines import MACHINES, REALS, build, run
from rtctl.export.c.proof.recorded import Rows
from rtctl.export.c.translated import translated


def replayed_to_the_bit(folder: Path) -> dict[str, dict[str, float]]:
    """Check that gcc gives the bits of the run `folder/run` with the loop `folder/loop`; return the deviations."""
    proof = prove(folder / "loop", folder / "run", ["gcc"])
    assert [(one.machine, one.precision, one.first) for one in proof.computed] == [
        ("this computer, gcc", "float", ""),
        ("the recorded loop", "double", ""),
        ("this computer, gcc", "double", ""),
    ]
    return {name: dict(figures) for name, figures in proof.deviations.items()}


def same_on_every_machine(folder: Path) -> None:
    """Check that all machines whose tools are here give the bits of the run `folder/run` with `folder/loop`."""
    computed = [one for one in replay_export(folder / "run", folder / "loop").computed if not one.skipped]
    assert [one.first for one in computed] == [""] * len(computed)


def corners_to_the_bit(loop: Path, law: Law, precision: str, count: int) -> Rows:
    """Check that gcc gives the bits of Python for inputs that no healthy run has; return what Python gives."""
    exported = translated(law)
    rows = corner_rows(exported.law, count, REALS[precision], seed=2)
    oracle = PythonLaw(*exported, REALS[precision])(rows)
    machine = MACHINES["gcc"]
    found = run(build(loop, machine, precision), machine, rows, oracle.dtype)
    assert differences(found, oracle) == (0, "")
    assert {0, 1} <= set(np.unique(oracle["fault"]).tolist())
    return oracle
