"""Measured data: a manifest beside ordinary files becomes one checked in-memory form, and back."""

from rtctl.measured.dataset import Dataset, Record, Signal
from rtctl.measured.reading import read_dataset
from rtctl.measured.writer import write_dataset

__all__ = ["Dataset", "Record", "Signal", "read_dataset", "write_dataset"]
