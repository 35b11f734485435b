"""Recording of a run: a row a step, into memory or into a mapped file that outlives the process; Parquet at the end.

`signals.parquet` holds no machine time, so a lockstep run repeated gives the same bytes; lateness, round trip
and compute time go to `timing.parquet`.
"""

from rtctl.recording.parquet import write_parquet
from rtctl.recording.rows import CHUNK_ROWS, Columns, Recorder

__all__ = ["CHUNK_ROWS", "Columns", "Recorder", "write_parquet"]
