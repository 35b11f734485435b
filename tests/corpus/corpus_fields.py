"""Columns within columns: records of HDF5 and NumPy, structs of Arrow, complex numbers, links."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from corpus_binary import TIMED, made, mat
from corpus_case import RIGHT, ROWS, Right, Situation, T, U, Write, X, refused
from pyarrow import feather

RECORD = np.zeros(ROWS, dtype=[("t", "f8"), ("u", "f8"), ("x", "f8")])
for _name, _values in (("t", T), ("u", U), ("x", X)):
    RECORD[_name] = _values
IN_REC = {"inputs": "rec/u:V", "outputs": {"displacement": "rec/x:mm"}, "time": "rec/t:s"}
IN_STRUCT = {"inputs": "u:V", "outputs": {"displacement": "x.value:mm"}, "time": "t:s"}
NO_UNITS = {"inputs": "rec/u", "outputs": {"displacement": "rec/x"}}
NO_IMAGINARY = Right(remark='the imaginary parts of "u" are 0 in all rows')


def hdf5(fill: Callable[[h5py.File, Path], object], name: str = "r.h5") -> Write:
    def write(path: Path) -> None:
        with h5py.File(path, "w") as file:
            fill(file, path.parent)

    return made(name, write)


def record(**attributes: object) -> Write:
    """A compound dataset with attributes; x in um where its unit says so."""

    def fill(file: h5py.File, _: Path) -> None:
        values = RECORD.copy()
        if "um" in str(attributes):
            values["x"] *= 1e3
        file["rec"] = values
        file["rec"].attrs.update(attributes)

    return hdf5(fill)


def columns(**held: object) -> Write:
    def fill(file: h5py.File, _: Path) -> None:
        for name, values in ({"t": T, "u": U, "x": X} | held).items():
            file[name] = values

    return hdf5(fill)


def external(file: h5py.File, folder: Path) -> None:
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = X
    file["t"], file["u"], file["x"] = T, U, h5py.ExternalLink("other.h5", "x")


def matrix_in_record(file: h5py.File, _: Path) -> None:
    file["rec"] = np.zeros(ROWS, dtype=[("t", "f8"), ("block", "f8", (2,))])
    file["u"] = U


def linked(file: h5py.File, _: Path) -> None:
    file["raw/channel7"] = X
    file["t"], file["u"], file["x"] = T, U, h5py.SoftLink("/raw/channel7")


def linked_by_their_names(file: h5py.File, _: Path) -> None:
    for name, values in (("t", T), ("u", U), ("x", X)):
        file[f"raw/{name}"] = values
        file[name] = h5py.SoftLink(f"/raw/{name}")
    file["raw/loop"] = h5py.SoftLink("/raw")


def named_twice(file: h5py.File, _: Path) -> None:
    for name, values, unit in (("t", T, "s"), ("u", U, "V"), ("x", X, "mm")):
        file[f"run/{name}"] = values
        file[f"run/{name}"].attrs["unit"] = unit
    file["drive"] = h5py.SoftLink("/run/u")


HDF5 = (
    Situation("HDF5, a compound dataset", record(), RIGHT, IN_REC),
    Situation("HDF5, a compound dataset, nothing said", record(), refused("r.h5", "rec/u", "--input", "--output displacement=rec/x:UNIT")),
    Situation("HDF5, a compound dataset with a list of units", record(units=["s", "V", "um"]), RIGHT, NO_UNITS),
    Situation("HDF5, a compound dataset with units by field", record(FIELD_0_UNITS="s", FIELD_1_UNITS="V", FIELD_2_UNITS="um", FIELD_2_FILL=0), RIGHT, NO_UNITS),
    Situation("HDF5, a compound dataset with another unit than the user's", record(units=["s", "V", "um"]), refused("r.h5", '"um"', '"mm"', "correct"), IN_REC),
    Situation("HDF5, a compound dataset with scales by field", record(gain=[1.0, 1.0, 0.1]), Right(remark="gain = 0.1"), IN_REC),
    Situation("HDF5, a compound dataset with one unit for all", record(units="um"), refused("r.h5", "nobody states the unit", "rec/x"), NO_UNITS),
    Situation("HDF5, a field of several numbers", hdf5(matrix_in_record), refused("r.h5", "rec/block", "(2,) numbers in each row", "save each"), {"inputs": "u:V", "outputs": {"displacement": "rec/block:mm"}}),
    Situation("HDF5, complex numbers without imaginary part", columns(u=U.astype(complex)), NO_IMAGINARY, TIMED),
    Situation("HDF5, complex numbers", columns(u=U + 1j * X), refused("r.h5", "complex128", "real and its imaginary part"), TIMED),
    Situation("HDF5, a link to a dataset of another name", hdf5(linked), RIGHT, TIMED),
    Situation("HDF5, links to datasets of the same names", hdf5(linked_by_their_names), RIGHT, TIMED),
    Situation("HDF5, a link to the drive beside it", hdf5(named_twice), RIGHT),
    Situation("HDF5, a compound dataset with units by name", record(t_unit="s", u_unit="V", x_unit="um"), RIGHT, NO_UNITS),
    Situation("HDF5, a compound dataset with one scale for all", record(scale_factor=2.0), Right(remark='scale_factor = 2.0 of its group "rec", which is not applied'), IN_REC),
    Situation("HDF5, a link that leads nowhere", hdf5(lambda file, _: file.update({"t": T, "u": U, "x": h5py.SoftLink("/raw/x")})), refused("r.h5", '"x"', 'link to "/raw/x"', "correct the link"), TIMED),
    Situation("HDF5, a link into another file", hdf5(external), refused("r.h5", '"x"', "other.h5", "copy the dataset into this file"), TIMED),
)  # fmt: skip


def struct(name: str = "value", values: object = X) -> pa.StructArray:
    held = values if isinstance(values, pa.Array) else pa.array(values)
    return pa.StructArray.from_arrays([held, pa.array(np.ones(ROWS))], [name, "quality"])


def arrow(name: str, column: object) -> Write:
    put = feather.write_feather if name.endswith("feather") else pq.write_table
    return made(name, lambda path: put(pa.table({"t": T, "u": U, "x": column}), path))


GAPPY = pa.array([None if k == 300 else {"value": float(one)} for k, one in enumerate(X)])
LISTS = pa.array([[float(one)] for one in X])
OTHERS = (
    Situation("Parquet, a struct", arrow("r.parquet", struct()), RIGHT, IN_STRUCT),
    Situation("Feather, a struct", arrow("r.feather", struct()), RIGHT, IN_STRUCT),
    Situation("Parquet, a struct whose field has its unit", made("r.parquet", lambda path: pq.write_table(pa.table({"t [s]": T, "u [V]": U, "x": struct("value [mm]")}), path)), RIGHT),
    Situation("Parquet, a struct in a struct", arrow("r.parquet", pa.StructArray.from_arrays([struct()], ["a"])), RIGHT, IN_STRUCT | {"outputs": {"displacement": "x.a.value:mm"}}),
    Situation("Parquet, a struct that is missing in one row", arrow("r.parquet", GAPPY), Right(remark="row 300", fewest=ROWS - 1), IN_STRUCT),
    Situation("Parquet, a column with a point in its name", made("r.parquet", lambda path: pq.write_table(pa.table({"t": T, "u": U, "x.value": X}), path)), RIGHT, IN_STRUCT),
    Situation("Parquet, a list in a struct", arrow("r.parquet", struct(values=LISTS)), refused("r.parquet", "x.value", "a list in each row", "a column for each place"), IN_STRUCT),
    Situation("NumPy, a structured array", made("r.npz", lambda path: np.savez(path, rec=RECORD)), RIGHT, {"inputs": "rec.u:V", "outputs": {"displacement": "rec.x:mm"}, "time": "rec.t:s"}),
    Situation("NumPy, a packed structured array", made("r.npz", lambda path: np.savez_compressed(path, rec=RECORD)), RIGHT, {"inputs": "rec.u:V", "outputs": {"displacement": "rec.x:mm"}, "time": "rec.t:s"}),
    Situation("NumPy, complex numbers without imaginary part", made("r.npz", lambda path: np.savez(path, t=T, u=U.astype(complex), x=X)), NO_IMAGINARY, TIMED),
    Situation("MATLAB 5, complex numbers without imaginary part", mat(t=T, u=U.astype(complex), x=X), NO_IMAGINARY, TIMED),
    Situation("MATLAB 5, an imaginary part in one row", mat(t=T, u=U, x=X + 1j * (np.arange(ROWS) == 7)), refused("r.mat", '"x"', "complex128", "real and its imaginary part"), TIMED),
)  # fmt: skip
SITUATIONS = (*HDF5, *OTHERS)
