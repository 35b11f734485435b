"""Arrow IPC, file (Feather version 2) or stream."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pyarrow as pa

from rtctl.measured.readers.table import Table, arrow_table

_FILE_MAGIC = b"ARROW1"


def read(path: Path) -> Table:
    """Columns of an Arrow file. Raises ValueError in words."""
    with path.open("rb") as file:
        is_file = file.read(len(_FILE_MAGIC)) == _FILE_MAGIC
    try:
        with pa.OSFile(str(path)) as source:
            opened = pa.ipc.open_file(source) if is_file else pa.ipc.open_stream(source)
            table = opened.read_all()
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(f"not an Arrow file: {error}") from None
    columns = {name: partial(table.column, k) for k, name in enumerate(table.column_names)}
    return arrow_table(columns, table.schema)
