"""Measured data: `read_dataset`, `write_dataset`, and what a call accepts as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rtctl.api.inputs import PathText, path_of
from rtctl.border.errors import InputError, RunError, nearest

if TYPE_CHECKING:
    from rtctl.measured.dataset import Dataset, Record
    from rtctl.measured.stored import StoredDataset


def read_dataset(path: PathText) -> Dataset:
    """Read a dataset's manifest (`dataset.toml`) and all its records into memory.

    Raises:
        InputError: A file is missing, or a key, a unit or the numbers are wrong; all findings at once, one a line.
    """
    from rtctl.measured.reading import read_dataset as read

    return read(path_of("dataset", path))


def dataset_of(dataset: Dataset | PathText) -> Dataset:
    """Return `dataset`, read from its manifest where it is a path. Raises InputError."""
    from rtctl.measured.dataset import Dataset

    return dataset if isinstance(dataset, Dataset) else read_dataset(dataset)


def stored_dataset_of(dataset: Dataset | PathText) -> StoredDataset:
    """Return the dataset as one whose records are read one at a time. Raises InputError."""
    from rtctl.measured.dataset import Dataset
    from rtctl.measured.reading import open_dataset
    from rtctl.measured.stored import RecordHead, StoredDataset

    if not isinstance(dataset, Dataset):
        return open_dataset(path_of("dataset", dataset))
    records = dataset.records
    return StoredDataset(
        path=dataset.path, name=dataset.name, plant=dataset.plant, identity=dataset.identity,
        units=dataset.units, holds=dataset.holds, read=lambda k: records[k], remarked=lambda: dataset.remarks,
        heads=tuple(RecordHead(one.name, one.file, one.use, one.repeat, one.conditions) for one in records),
    )  # fmt: skip


# 7 parameters because each is a table or a key of the manifest
def write_dataset(
    folder: PathText,
    records: Sequence[Record],
    *,
    name: str,
    plant: str,
    units: Mapping[str, str] | None = None,
    holds: Mapping[str, str] | None = None,
) -> Dataset:
    """Write arrays as a dataset: one Parquet file a record and the manifest `dataset.toml`.

    Args:
        folder: Where the files go.
        records: Signals as arrays of one length (n,), with sampling period and use.
        name: Name of the dataset.
        plant: Kind of plant, such as "oscillator" or "vo2".
        units: Unit of each signal, where the plant does not fix it (a vo2: mA, ohm, um).
        holds: Of each input between its samples: "zero" (the default), "linear" or "band-limited".

    Returns:
        The dataset; `dataset.path` is its manifest.

    Raises:
        InputError: An unknown plant, signal or unit, or samples that are not finite.
    """
    from rtctl.measured.writer import write_dataset as write
    from rtctl.registry import plant_kinds

    known = [kind for kind, record in plant_kinds().items() if record.has_datasets]
    if plant not in known:
        raise InputError(f'plant: there are no datasets of a "{plant}"{nearest(str(plant), known)}')
    try:
        manifest = write(
            path_of("folder", folder), name=name, plant=plant, records=records, units=units, holds=holds
        )
    except RunError as error:
        raise InputError(str(error)) from None
    return read_dataset(manifest)
