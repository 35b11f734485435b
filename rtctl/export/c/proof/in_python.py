"""The exported law computed in Python, in the precision of the exported arithmetic: the oracle of all machines."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.export.c.laws.law import Law, aligned_dtype, numpy_dtype
from rtctl.export.c.printing.python_program import in_precision, python_program
from rtctl.export.c.proof.recorded import Rows
from rtctl.translation.inference import Program
from rtctl.translation.instances import Instance

WORTH_COMPILING = 50_000


class PythonLaw:
    """A law as a function of rows."""

    def __init__(
        self, law: Law, program: Program, entry: Instance, real: Any, *, compiled: bool = False
    ) -> None:
        """Prepare it.

        Args:
            law: the law.
            program: its kernels.
            entry: its function of a sample.
            real: np.float32 or np.float64.
            compiled: whether numba compiles it: worth ten seconds from `WORTH_COMPILING` rows on.
        """
        self._levels = [one.name for one in law.output.fields if one.name.startswith("level")]
        self._run = python_program(program, entry, real, self._levels, compiled=compiled)
        self._compiled = compiled
        self._constants = in_precision(law.constants, real)
        self._input, self._output = aligned_dtype(law.input, real), aligned_dtype(law.output, real)
        self._initial = np.zeros(1, dtype=numpy_dtype(law.state, real))
        for entry_of_memory in law.memory:
            self._initial[entry_of_memory.name] = entry_of_memory.value

    def __call__(self, rows: Rows, applied: FloatArray | None = None) -> Rows:
        """Return the outputs of inputs (n,).

        Args:
            rows: the inputs.
            applied: commands (n, commands) that are in force when a row is taken, NaN: the law's own; None: all are.
        """
        wide = np.zeros(rows.size, dtype=_wide(self._input))
        for name in rows.dtype.names or ():
            wide[name] = rows[name]
        outputs = np.zeros(rows.size, dtype=_wide(self._output))
        state, initial = self._initial.copy(), self._initial
        records = [state, wide, outputs, initial]
        if not self._compiled:
            records = [one.view(np.recarray) for one in records]
        if applied is None:
            applied = np.full((rows.size, len(self._levels)), np.nan)
        with np.errstate(all="ignore"):
            self._run(*records[:3], self._constants, records[3], applied)
        found = np.zeros(rows.size, dtype=self._output)
        for name in outputs.dtype.names or ():
            found[name] = outputs[name]
        return found


def _wide(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the record with integers as Python computes with them."""
    fields = [(name, np.int64 if dtype[name].kind == "i" else dtype[name]) for name in dtype.names or ()]
    return np.dtype(fields, align=True)
