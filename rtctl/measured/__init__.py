"""Measured data: a manifest beside ordinary files becomes one checked in-memory form, and back."""

from rtctl.measured.dataset import Dataset, Record, Signal
from rtctl.measured.reading import open_dataset, read_dataset
from rtctl.measured.stored import RecordHead, StoredDataset
from rtctl.measured.writer import write_dataset

__all__ = [
    "Dataset",
    "Record",
    "RecordHead",
    "Signal",
    "StoredDataset",
    "open_dataset",
    "read_dataset",
    "write_dataset",
]
