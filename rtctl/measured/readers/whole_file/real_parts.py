"""Columns of complex numbers whose imaginary parts are all 0, as programs save real signals: their real parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.measured.readers.table import Column, Table, length


def with_real_parts(table: Table) -> Table:
    """Return the table with real numbers in place of complex ones that have no imaginary part, which it remarks."""
    real = [name for name in table.columns if _is_real(table, name)]
    if not real:
        return table

    def load(name: str, first: int, end: int) -> Column:
        values = table.load(name, first, end)
        return np.ascontiguousarray(values.real) if name in real else values

    headers = {
        name: header._replace(dtype=np.dtype(np.float64)) if name in real else header
        for name, header in table.columns.items()
    }
    named = ", ".join(f'"{one}"' for one in real)
    remark = f"the imaginary parts of {named} are 0 in all rows: the complex numbers are read as real ones"
    return replace(table, columns=headers, load=load, load_together=None, remarks=(*table.remarks, remark))


def _is_real(table: Table, name: str) -> bool:
    header = table.columns[name]
    if header.refusal or header.dtype is None or header.dtype.kind != "c":
        return False
    try:
        samples = length(header.shape)
        return samples > 0 and not np.any(np.asarray(table.load(name, 0, samples)).imag)
    except ValueError:
        return False
