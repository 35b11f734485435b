"""Recording of a run: one row per sample, in memory or in a mapped file that outlives it; Parquet at the end.

`signals.parquet` holds no machine time, so a lockstep run repeated gives the same bytes; lateness, round trip
and compute time go to `timing.parquet`.
"""

from rtctl.recording.parquet import write_parquet
from rtctl.recording.rows import CHUNK_ROWS, Columns, Recorder

__all__ = ["CHUNK_ROWS", "Columns", "Recorder", "write_parquet"]
