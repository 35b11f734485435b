"""Recording of a run: one row per sample, in memory or in a mapped file that outlives it; Parquet at the end."""

from rtctl.recording.parquet import write_parquet
from rtctl.recording.rows import CHUNK_ROWS, Columns, Recorder

__all__ = ["CHUNK_ROWS", "Columns", "Recorder", "write_parquet"]
