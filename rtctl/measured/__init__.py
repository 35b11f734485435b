"""Measured data: a manifest beside ordinary files is read into one checked in-memory form, and written back."""

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
