"""Columns of a matrix of all signals: `data(:,1)` of a MATLAB file, `data[:,0]` of others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.measured.readers.table import Column, Header, Table

MOST_COLUMNS = 64
"""Columns that a matrix may have; more are no channels of one measurement, but images or spectra."""


def with_matrix_columns(table: Table, *, matlab: bool) -> Table:
    """Return the table with the columns of its matrices beside them: those along the shorter of two dimensions."""
    headers: dict[str, Header] = {}
    parts: dict[str, tuple[str, int]] = {}
    places = dict(table.places)
    for name, header in table.columns.items():
        headers[name] = header
        if header.refusal or len(header.shape) != 2 or header.shape[0] == header.shape[1]:
            continue
        count, rows = sorted(header.shape)
        if 1 < count <= MOST_COLUMNS:
            for k in range(count):
                column = f"{name}(:,{k + 1})" if matlab else f"{name}[:,{k}]"
                headers[column] = header._replace(shape=(rows,))
                parts[column] = name, k
                if name in table.places:
                    whole = table.place(name)
                    places[column] = whole._replace(path=whole.path + column[len(name) :])
    if not parts:
        return table

    def load(name: str, first: int, end: int) -> Column:
        if name not in parts:
            return table.load(name, first, end)
        matrix, k = parts[name]
        across = int(np.argmin(table.columns[matrix].shape))
        return np.ascontiguousarray(np.take(table.load(matrix, first, end), k, axis=across))

    return replace(table, columns=headers, load=load, places=places)
