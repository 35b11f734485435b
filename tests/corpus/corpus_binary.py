"""Binary files: HDF5, NetCDF 4, MATLAB, NumPy, Parquet, Arrow, TDMS, UFF."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from corpus_case import RIGHT, ROWS, Right, Situation, T, U, Write, X, refused
from measured_files import uff58, write_tdms, write_uff
from pyarrow import feather
from scipy.io import savemat

NAMES = {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}
TIMED = NAMES | {"time": "t:s"}
IN_MM = {"t": "s", "u": "V", "x": "mm"}


def made(name: str, fill: Callable[[Path], object]) -> Write:
    def write(folder: Path) -> Path:
        fill(folder / name)
        return folder / name

    return write


def hdf5(
    attributes: Mapping[str, Mapping[str, Any]] | None = None, name: str = "r.h5", **columns: Any
) -> Write:
    """t, u and x with units, and attributes (or columns) in their place."""

    def fill(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for key, values in ({"t": T, "u": U, "x": X} | columns).items():
                if values is not None:
                    file[key] = values
            for key, unit in IN_MM.items():
                if key in file:
                    for attribute, value in (attributes or {}).get(key, {"units": unit}).items():
                        file[key].attrs[attribute] = value

    return made(name, fill)


def matlab73(fill: Callable[[h5py.File], None]) -> Write:
    def write(path: Path) -> None:
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in (("t", T), ("u", U), ("x", X)):
                file[name] = values[np.newaxis, :]
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
            fill(file)

    return made("r.mat", write)


def mat(**variables: Any) -> Write:
    return made("r.mat", lambda path: savemat(path, variables))


def by_reference(file: h5py.File, name: str, arrays: list[np.ndarray], kind: str = "") -> None:
    """As MATLAB 7.3 keeps the items of a cell and the fields of arrays of structs."""
    group = file.require_group("#refs#")
    references = []
    for values in arrays:
        place = f"{len(group):02x}"
        group[place] = values[np.newaxis, :]
        references.append(group[place].ref)
    file.create_dataset(name, data=np.array([references], dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
    if kind:
        file[name].attrs["MATLAB_class"] = np.bytes_(kind)


def simulink73(file: h5py.File) -> None:
    for name in "tux":
        del file[name]
    file["out/time"] = T[np.newaxis, :]
    by_reference(file, "out/signals/values", [U, X])


def timeseries73(file: h5py.File) -> None:
    del file["x"]
    file["x"] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], np.uint32)
    file["x"].attrs["MATLAB_class"] = np.bytes_("timeseries")
    file["x"].attrs["MATLAB_object_decode"] = np.int32(3)


def nothing(file: h5py.File) -> None:
    pass


def netcdf(path: Path) -> None:
    """A NetCDF 4 file: dimensions are scales, numbers are packed by the CF conventions."""
    with h5py.File(path, "w") as file:
        file["time"] = T
        file["time"].make_scale("time")
        file["time"].attrs["units"] = np.bytes_("seconds since 2026-11-21 10:00:00")
        step = float(np.abs(X).max()) / 30_000
        for name, values, unit in (("u", U, "V"), ("x", X, "mm")):
            scale = step if name == "x" else float(np.abs(U).max()) / 30_000
            packed = np.rint(values / scale).astype(np.int16)
            file.create_dataset(name, data=packed, fillvalue=np.int16(-32768))
            file[name].attrs.update(
                {
                    "units": np.bytes_(unit),
                    "scale_factor": scale,
                    "add_offset": 0.0,
                    "_FillValue": np.int16([-32768]),
                }
            )
            file[name].dims[0].attach_scale(file["time"])


def cell(*items: Any) -> np.ndarray:
    found = np.empty(len(items), dtype=object)
    found[:] = items
    return found


def signals(*arrays: np.ndarray) -> np.ndarray:
    """An array of structs, as Simulink's "structure with time" has it."""
    return np.array([(one, "label") for one in arrays], dtype=[("values", object), ("label", object)])


def table(metadata: Mapping[str, str] | None = None, **columns: Any) -> pa.Table:
    held = {"t": T, "u": U, "x": X} | columns
    held = {name: values for name, values in held.items() if values is not None}
    made = pa.table(
        {name: values if isinstance(values, pa.Array) else pa.array(values) for name, values in held.items()}
    )
    fields = [
        one.with_metadata({"unit": IN_MM[one.name]}) if one.name in IN_MM else one for one in made.schema
    ]
    return made.cast(pa.schema(fields, metadata=metadata))


def parquet(name: str = "r.parquet", **columns: Any) -> Write:
    return made(name, lambda path: pq.write_table(table(**columns), path))


def of_pandas(index: bool) -> Write:
    frame = pd.DataFrame({"u": U, "x": X}, index=pd.Index(T, name="t"))
    return made("r.parquet", lambda path: (frame if index else frame.reset_index()).to_parquet(path))


def tdms(properties: Mapping[str, Any], **columns: np.ndarray) -> Write:
    waveform = {"wf_increment": 1e-3, "wf_samples": ROWS, **properties}
    held = {"u": U, "x": X} | columns
    return made(
        "r.tdms",
        lambda path: write_tdms(
            path, held, {name: {**waveform, "unit_string": IN_MM[name]} for name in held}
        ),
    )


def uff(unit: str = "mm", **options: Any) -> Write:
    return made(
        "r.uff",
        lambda path: write_uff(
            path, [uff58(U, id1="drive", unit="V", **options), uff58(X, id1="x tip", unit=unit, **options)]
        ),
    )


def runs(path: Path) -> None:
    """An HDF5 file of two runs, each with its own time; that of the first is of another rate."""
    with h5py.File(path, "w") as file:
        for name, period in (("one", 2.0), ("two", 1.0)):
            for key, values in (("t", period * T), ("u", U), ("x", X)):
                file[f"{name}/{key}"] = values
                file[f"{name}/{key}"].attrs["units"] = IN_MM[key]


def structs(*periods: float) -> np.ndarray:
    """An array of structs, one a record, each with its own time."""
    kinds = [("time_s", object), ("u_V", object), ("x_mm", object)]
    return np.array([(period * T, U, X) for period in periods], dtype=kinds)


OF_TWO = {"inputs": "two/u", "outputs": {"displacement": "two/x"}}
OF_2 = {"inputs": "rec(2).u_V", "outputs": {"displacement": "rec(2).x_mm"}}
AXES_APART = np.array([(T, U), (2.0 * T, X)], dtype=[("t_s", object), ("y", object)])


def rated(place: str, key: str, value: Any, path: str = "") -> Write:
    """u and x in HDF5, with an attribute of the file, of a group, or of both datasets."""

    def fill(file_path: Path) -> None:
        with h5py.File(file_path, "w") as file:
            for name, values in (("u", U), ("x", X)):
                file[f"{path}{name}"] = values
                file[f"{path}{name}"].attrs["units"] = IN_MM[name]
            for one in (f"{path}u", f"{path}x") if place == "columns" else [place]:
                file[one].attrs[key] = value

    return made("r.h5", fill)


def volts(sensitivity: str) -> Write:
    """u in mV and x in V of transducers that an attribute tells."""
    told = {"u": {"units": "mV"}, "x": {"units": "V", "sensitivity": sensitivity}}
    return hdf5(UM | told, u=1e3 * U, x=0.25 * X)


UM = {"t": {"units": "s"}, "u": {"units": "V"}}
GAPS = np.where(np.arange(ROWS) == 300, np.nan, X)
MATRIX = np.column_stack([T, U, X])
FIRST = {"inputs": "data(:,2):V", "outputs": {"displacement": "data(:,3):mm"}, "time": "data(:,1):s"}

HDF5 = (
    Situation("HDF5 with units", hdf5(), RIGHT),
    Situation("HDF5 named .hdf5", hdf5(name="r.hdf5"), RIGHT),
    Situation("HDF5 units as arrays of one", hdf5({key: {"units": np.array([unit.encode()])} for key, unit in IN_MM.items()}), RIGHT),
    Situation("HDF5 units in Latin-1", hdf5(UM | {"x": {"unit": np.bytes_("µm".encode("latin-1"))}}, x=1e3 * X), RIGHT),
    Situation("HDF5 units under NI's key", hdf5({key: {"NI_UnitDescription": unit} for key, unit in IN_MM.items()}), RIGHT),
    Situation("HDF5 without units", hdf5({"t": {}, "u": {}, "x": {}}), refused("r.h5", "unit", "--input")),
    Situation("HDF5 in a unit that is none", hdf5(UM | {"x": {"units": "EU"}}), refused("r.h5", "EU", "--output")),
    Situation("HDF5 in another unit than the user's", hdf5(), refused("r.h5", '"mm"', '"um"', "correct"), {"outputs": {"displacement": "x:um"}}),
    Situation("HDF5 packed by CF", hdf5(UM | {"x": {"units": "mm", "scale_factor": 1e-3, "add_offset": 0.0}}, x=1e3 * X), RIGHT),
    Situation("HDF5 with a fill value", hdf5(UM | {"x": {"units": "mm", "_FillValue": -999.0}}, x=np.where(np.arange(ROWS) == 300, -999.0, X)), Right(remark="row 300", fewest=599)),
    Situation("HDF5 with a gain in its own words", hdf5(UM | {"x": {"units": "mm", "gain": 2.0}}), Right(remark="gain")),
    Situation("HDF5 with a scale of zero", hdf5(UM | {"x": {"units": "mm", "scale_factor": 0.0}}), refused("r.h5", "x", "scale_factor of 0")),
    Situation("HDF5 in groups", hdf5(t=None, u=None, x=None, **{"run/t": T, "run/u": U, "run/x": X}), RIGHT, {"inputs": "run/u:V", "outputs": {"displacement": "run/x:mm"}, "time": "run/t:s"}),
    Situation("HDF5 with the rate of the file", rated("/", "sample_rate_Hz", 1000), RIGHT),
    Situation("HDF5 with the rate of a group", rated("run", "Sample Rate", "1 kHz", "run/"), RIGHT),
    Situation("HDF5 with the period of columns", rated("columns", "dt_ms", 1.0), RIGHT),
    Situation("HDF5 with a sampling interval in words", rated("/", "sampling_interval", "1000 µs"), RIGHT),
    Situation("HDF5 with a rate in a unit that is none", rated("/", "sample_rate", "1000 lines"), refused("r.h5", "rate", "--sample-rate")),
    Situation("HDF5 at another rate than the user's", rated("/", "fs", 1000), refused("r.h5", '"fs"', "1000 Hz", "500", "correct one"), {"sample_rate_hz": 500.0}),
    Situation("HDF5 in volts of a transducer, said as its sensitivity", volts("250 mV/mm"), RIGHT, {"scales": {"displacement": "250 mV/mm"}}),
    Situation("HDF5 in volts of a transducer, said as its scale", volts("250 mV/mm"), RIGHT, {"scales": ["displacement=4e-3 mm/mV"]}),
    Situation("HDF5 in volts of a transducer, whose unit alone is said", volts("250 mV/mm"), refused("r.h5", '"V"', '"mm"', "--scale"), {"outputs": {"displacement": "x:mm"}}),
    Situation("HDF5 of two runs, one of them named", made("r.h5", runs), RIGHT, OF_TWO),
    Situation("HDF5 with the time in a group apart", hdf5(t=None, **{"axis/time_s": T}), Right(remark="of another group"), {}),
    Situation("HDF5 with times in two groups apart", hdf5(t=None, **{"one/time_s": T, "two/time_s": 2.0 * T}), refused("r.h5", '"one/time_s", "two/time_s"', "other groups", "--time")),
    Situation("HDF5 as a row", hdf5(x=X[np.newaxis, :], u=U[:, np.newaxis]), RIGHT),
    Situation("HDF5 in single precision", hdf5(t=T.astype("f4"), u=U.astype("f4"), x=X.astype("f4")), RIGHT),
    Situation("HDF5 big-endian", hdf5(t=T.astype(">f8"), u=U.astype(">f4"), x=X.astype(">f8")), RIGHT),
    Situation("HDF5 as a matrix", hdf5(t=None, u=None, x=None, data=MATRIX), RIGHT, {"inputs": "data[:,1]:V", "outputs": {"displacement": "data[:,2]:mm"}, "time": "data[:,0]:s"}),
    Situation("HDF5 with images", hdf5(x=np.zeros((ROWS, 100, 100), "u1")), refused("r.h5", "x", "one dimension")),
    Situation("HDF5 with text", hdf5(x=np.array([b"a"] * ROWS)), refused("r.h5", "x", "text"), NAMES),
    Situation("HDF5 as a table of records", hdf5(t=None, u=None, x=None, run=np.rec.fromarrays([T, U, X], names="t,u,x")), refused("r.h5", "run")),
    Situation("HDF5 of pandas", hdf5(t=None, u=None, x=None, **{"df/axis0": np.array([b"u", b"x"]), "df/block0_values": np.column_stack([U, X])}), RIGHT,
              {"inputs": "df/block0_values[:,0]:V", "outputs": {"displacement": "df/block0_values[:,1]:mm"}, "sample_rate_hz": 1000.0}),
    Situation("HDF5 that was not written to its end", made("r.h5", lambda path: (hdf5()(path.parent), path.write_bytes(path.read_bytes()[:9000]))), refused("r.h5", "damaged")),
    Situation("NetCDF 4", made("r.h5", netcdf), Right(within=1e-3)),
    Situation("NetCDF 3 named .csv", made("r.csv", lambda path: path.write_bytes(b"CDF\x01" + bytes(64))), refused("r.csv", "NetCDF 3", "save it")),
)  # fmt: skip

SHORTER = refused(
    "r.mat", "differ in length", '"u" has 600 rows, "x" has 300 rows, "t" has 600 rows', "resample"
)
MATLAB = (
    Situation("MATLAB with a signal of half the rows of the time", mat(t=T, u=U, x=X[:300]), SHORTER, TIMED),
    Situation("MATLAB with a signal without rows", mat(t=T, u=U, x=X[:0]), refused("r.mat", "differ in length", '"x" has no rows', "export what is so short again"), TIMED),
    Situation("MATLAB with signals of half the rows of a third one", mat(u=U, x=X, z=np.tile(X, 2), w=np.tile(U, 2)), RIGHT, NAMES | {"sample_rate_hz": 1000.0}),
    Situation("MATLAB 5", mat(t=T, u=U, x=X), RIGHT, TIMED),
    Situation("MATLAB 5 with a rate", mat(u=U, x=X, fs=1000.0), RIGHT, NAMES),
    Situation("MATLAB 5 with a period", mat(u=U, x=X, dt=1e-3), RIGHT, NAMES),
    Situation("MATLAB 5 with a rate that is not the user's", mat(u=U, x=X, fs=1000.0), refused("r.mat", '"fs"', "1000 Hz", "leave out --sample-rate"), NAMES | {"sample_rate_hz": 100.0}),
    Situation("MATLAB of two structs, and a rate that only the other one has", mat(rec=structs(2.0, 1.0)), RIGHT, OF_2 | {"sample_rate_hz": 1000.0}),
    Situation("MATLAB 5 without a rate", mat(u=U, x=X), refused("r.mat", "rate", "--sample-rate"), NAMES),
    Situation("MATLAB of two structs, one of them named", mat(rec=structs(2.0, 1.0)), RIGHT, OF_2),
    Situation("MATLAB of two structs with rates, one of them named", mat(rec=np.array([(500.0, U, X), (1000.0, U, X)], dtype=[("fs", object), ("u_V", object), ("x_mm", object)])), RIGHT, OF_2),
    Situation("MATLAB of channels with a time each", mat(ch=AXES_APART), refused("r.mat", '"ch(1).t_s", "ch(2).t_s"', "other groups"), {"inputs": "ch(1).y:V", "outputs": {"displacement": "ch(2).y:mm"}}),
    Situation("MATLAB of channels with the same time each", mat(ch=np.array([(T, U), (T, X)], dtype=[("t_s", object), ("y", object)])), RIGHT, {"inputs": "ch(1).y:V", "outputs": {"displacement": "ch(2).y:mm"}}),
    Situation("MATLAB 4", made("r.mat", lambda path: savemat(path, {"t": T, "u": U, "x": X}, format="4")), RIGHT, TIMED),
    Situation("MATLAB 5 packed", made("r.mat", lambda path: savemat(path, {"t": T, "u": U, "x": X}, do_compression=True)), RIGHT, TIMED),
    Situation("MATLAB 5, one matrix of all signals", mat(data=MATRIX), RIGHT, FIRST),
    Situation("MATLAB 5, one matrix, nothing said", mat(data=MATRIX), refused("r.mat", "data(:,2)", "--input")),
    Situation("MATLAB 5, one matrix across", mat(data=MATRIX.T), RIGHT, FIRST),
    Situation("MATLAB 5, a struct with a matrix", mat(run={"data": MATRIX}), RIGHT, {"inputs": "run.data(:,2):V", "outputs": {"displacement": "run.data(:,3):mm"}, "time": "run.data(:,1):s"}),
    Situation("MATLAB 5, cells", mat(t=T, c=cell(U, X)), RIGHT, {"inputs": "c{1}:V", "outputs": {"displacement": "c{2}:mm"}, "time": "t:s"}),
    Situation("Simulink, structure with time", mat(out={"time": T, "signals": signals(U, X)}), RIGHT, {"inputs": "out.signals(1).values:V", "outputs": {"displacement": "out.signals(2).values:mm"}, "time": "out.time:s"}),
    Situation("Simulink, array", mat(yout=np.column_stack([U, X]), tout=T), RIGHT, {"inputs": "yout(:,1):V", "outputs": {"displacement": "yout(:,2):mm"}, "time": "tout:s"}),
    Situation("dSPACE, X and Y", mat(rec={"X": signals(T), "Y": signals(U, X)}), RIGHT, {"inputs": "rec.Y(1).values:V", "outputs": {"displacement": "rec.Y(2).values:mm"}, "time": "rec.X.values:s"}),
    Situation("MATLAB 5, complex", mat(t=T, u=U, x=X + 1j), refused("r.mat", "x", "complex"), TIMED),
    Situation("MATLAB 5, sparse and text beside", mat(t=T, u=U, x=X, note="shaker"), RIGHT, TIMED),
    Situation("MATLAB 5, whole numbers", mat(t=np.arange(ROWS, dtype=np.int32), u=U, x=X), RIGHT, TIMED | {"time": "t:ms"}),
    Situation("MATLAB 7.3", matlab73(nothing), RIGHT, TIMED),
    Situation("MATLAB 7.3, one matrix of all signals", matlab73(lambda file: file.__setitem__("data", MATRIX.T)), RIGHT, FIRST),
    Situation("MATLAB 7.3, cells", matlab73(lambda file: by_reference(file, "c", [U, X], "cell")), RIGHT, {"inputs": "c{1}:V", "outputs": {"displacement": "c{2}:mm"}, "time": "t:s"}),
    Situation("MATLAB 7.3, Simulink's structure with time", matlab73(simulink73), RIGHT, {"inputs": "out.signals(1).values:V", "outputs": {"displacement": "out.signals(2).values:mm"}, "time": "out.time:s"}),
    Situation("MATLAB 7.3, a timeseries", matlab73(timeseries73), refused("r.mat", "x", "timeseries", "x.Time", "Data"), TIMED),
)  # fmt: skip


def listed(path: Path) -> None:
    """As a data frame that has one row for each piece of a measurement."""
    halves = {
        name: [values[:300].tolist(), values[300:].tolist()]
        for name, values in zip("tux", (T, U, X), strict=True)
    }
    (pq.write_table if path.suffix == ".parquet" else feather.write_feather)(pa.table(halves), path)


COLUMNAR = (
    Situation("Parquet with a list in each row", made("r.parquet", listed), refused("r.parquet", "holds a list in each row", "explode"), TIMED),
    Situation("Feather with a list in each row", made("r.feather", listed), refused("r.feather", "holds a list in each row", "explode"), TIMED),
    Situation("NumPy", made("r.npz", lambda path: np.savez(path, t=T, u=U, x=X)), RIGHT, TIMED),
    Situation("NumPy packed", made("r.npz", lambda path: np.savez_compressed(path, t=T, u=U, x=X)), RIGHT, TIMED),
    Situation("NumPy, one matrix", made("r.npz", lambda path: np.savez(path, data=MATRIX)), RIGHT, {"inputs": "data[:,1]:V", "outputs": {"displacement": "data[:,2]:mm"}, "time": "data[:,0]:s"}),
    Situation("NumPy, one matrix in Fortran's order", made("r.npz", lambda path: np.savez(path, data=np.asfortranarray(MATRIX))), RIGHT, {"inputs": "data[:,1]:V", "outputs": {"displacement": "data[:,2]:mm"}, "time": "data[:,0]:s"}),
    Situation("NumPy packed, one matrix in Fortran's order", made("r.npz", lambda path: np.savez_compressed(path, data=np.asfortranarray(MATRIX))), RIGHT, {"inputs": "data[:,1]:V", "outputs": {"displacement": "data[:,2]:mm"}, "time": "data[:,0]:s"}),
    Situation("NumPy dates", made("r.npz", lambda path: np.savez(path, t=np.datetime64("2026-11-21", "ns") + (1e9 * T).astype("m8[ns]"), u=U, x=X)), RIGHT, NAMES),
    Situation("NumPy objects", made("r.npz", lambda path: np.savez(path, t=T, u=U, x=np.array([None] * ROWS))), refused("r.npz", "x", "objects"), TIMED),
    Situation("NumPy records", made("r.npz", lambda path: np.savez(path, run=np.rec.fromarrays([T, U, X], names="t,u,x"))), refused("r.npz", "run")),
    Situation("Parquet with units", parquet(), RIGHT),
    Situation("Parquet with units of the schema", made("r.parquet", lambda path: pq.write_table(pa.table({"t": T, "u": U, "x": X}).replace_schema_metadata({"units": json.dumps(IN_MM)}), path)), RIGHT),
    Situation("Parquet of pandas", of_pandas(index=False), RIGHT, TIMED),
    Situation("Parquet of pandas, time as index", of_pandas(index=True), RIGHT, TIMED),
    Situation("Parquet with dates", parquet(t=pa.array(np.datetime64("2026-11-21T10", "us") + (1e6 * T).astype("m8[us]"))), RIGHT),
    Situation("Parquet with dates of a zone", parquet(t=pa.array(np.datetime64("2026-11-21T10", "us") + (1e6 * T).astype("m8[us]")).cast(pa.timestamp("us", "Europe/Berlin"))), RIGHT),
    Situation("Parquet with durations", parquet(t=pa.array((1e9 * T).astype("m8[ns]"))), RIGHT),
    Situation("Parquet with decimals", parquet(x=pa.array(X).cast(pa.decimal128(20, 9))), RIGHT),
    Situation("Parquet with half precision", parquet(x=pa.array(X.astype(np.float16))), Right(within=2e-3)),
    Situation("Parquet with nulls", parquet(x=pa.array(GAPS, from_pandas=True)), Right(remark="row 300", fewest=599)),
    Situation("Parquet with lists", parquet(x=pa.array([[one] for one in X])), refused("r.parquet", "x"), TIMED),
    Situation("Parquet with numbers as text", parquet(x=pa.array([f"{one:.6f}" for one in X])), refused("r.parquet", "x", "text"), TIMED),
    Situation("Parquet of two columns of one name", made("r.parquet", lambda path: pq.write_table(pa.Table.from_arrays([pa.array(T), pa.array(U), pa.array(U), pa.array(X)], names=["t", "u", "u", "x"]), path)), refused("r.parquet", "same name")),
    Situation("Parquet with the rate of the file", made("r.parquet", lambda path: pq.write_table(table({"sample_rate_hz": "1000"}, t=None), path)), RIGHT),
    Situation("Feather", made("r.feather", lambda path: feather.write_feather(table(), path)), RIGHT),
    Situation("Feather, packed", made("r.feather", lambda path: feather.write_feather(table(), path, compression="lz4")), RIGHT),
    Situation("Feather, version 1", made("r.feather", lambda path: feather.write_feather(pa.table({"t": T, "u": U, "x": X}), path, version=1)), refused("r.feather", "version 1"), TIMED),
    Situation("CSV named .parquet", made("r.parquet", lambda path: path.write_text("t,u\n1,2\n")), refused("r.parquet", "Parquet")),
    Situation("TDMS waveforms", tdms({}), RIGHT, {"outputs": {"displacement": "x"}}),
    Situation("TDMS at a rate that contradicts", tdms({}), refused("r.tdms", "1000 Hz", "correct one"), {"sample_rate_hz": 500.0}),
    Situation("TDMS with an unknown scale", tdms({"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Magic"}), refused("r.tdms", "Magic", "save it scaled")),
    Situation("TDMS with the rate of a channel's property", tdms({"wf_increment": 0.0, "Sampling Rate": 1000.0}), RIGHT, {"outputs": {"displacement": "x"}}),
    Situation("TDMS with a sensitivity", tdms({"sensitivity": "1 mm/V"}), Right(remark="sensitivity = 1 mm/V"), {"outputs": {"displacement": "x"}}),
    Situation("TDMS without a rate", made("r.tdms", lambda path: write_tdms(path, {"u": U, "x": X}, {"u": {"unit_string": "V"}, "x": {"unit_string": "mm"}})), refused("r.tdms", "rate", "--sample-rate")),
    Situation("UFF 58", uff(), RIGHT),
    Situation("UFF 58b", uff(binary=True), RIGHT),
    Situation("UFF in single precision", uff(form=2), Right(within=1e-3)),
    Situation("UFF at another rate", uff(increment=1.0 / 2048.0), Right(rate_hz=2048.0)),
    Situation("UFF with abscissa in ms", uff(increment=1.0, abscissa_unit="ms"), RIGHT),
    Situation("UFF in microns", made("r.uff", lambda path: write_uff(path, [uff58(U, id1="drive", unit="V"), uff58(1e3 * X, id1="x tip", unit="um")])), RIGHT),
    Situation("UFF of frequency", uff(abscissa=18), refused("r.uff", "function of frequency")),
    Situation("UFF cut off", made("r.uff", lambda path: (uff()(path.parent), path.write_bytes(path.read_bytes()[:-7]))), refused("r.uff", "cut off")),
)  # fmt: skip
LATER = Right(remark="begin at different times", rows=590, fewest=590, lost=np.arange(5, 595))
LATER_END = LATER._replace(rows=595, fewest=595, lost=np.arange(5, 600))


def later_tdms(u: np.ndarray, x: np.ndarray, later_us: int = 5000) -> Write:
    start = np.datetime64("2026-11-21T10:00:00", "us")
    of = {
        name: {"wf_increment": 1e-3, "wf_start_offset": 0.0, "wf_start_time": time}
        for name, time in (("u", start), ("x", start + np.timedelta64(later_us, "us")))
    }
    return made("r.tdms", lambda path: write_tdms(path, {"u": u, "x": x}, of))


def later_uff(folder: Path) -> Path:
    write_uff(folder / "r.uff", [uff58(U[:595], id1="u"), uff58(X[5:], id1="x", start=0.005)])
    return folder / "r.uff"


SIMULATED_MDF = b"MDF     4.10    rtctl   " + bytes(400)
OTHERS = (
    Situation("TDMS with a waveform that begins 5 ms later", later_tdms(U[:595], X[5:]), LATER, NAMES),
    Situation("TDMS with a waveform that begins 5 ms later and ends with the other", later_tdms(U, X[5:]), LATER_END, NAMES),
    Situation("TDMS with a waveform that begins 5.4 ms later", later_tdms(U, X, 5400), refused("r.tdms", "not a whole number", "resample"), NAMES),
    Situation("UFF with an abscissa that begins 5 ms later", later_uff, LATER, NAMES),
    Situation("MDF without its package, or damaged", made("r.mf4", lambda path: path.write_bytes(SIMULATED_MDF)), refused("r.mf4", "measurement data file" if find_spec("asammdf") else "pip install 'rtctl[mdf]'")),
    Situation("MDF named .dat", made("r.dat", lambda path: path.write_bytes(SIMULATED_MDF)), refused("r.dat", "rename it to .mf4")),
    Situation("HDF5 named .dat", made("r.dat", lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(99))), refused("r.dat", "HDF5", "rename it to .h5")),
    Situation("TDMS named .txt", made("r.txt", lambda path: path.write_bytes(b"TDSm" + bytes(99))), refused("r.txt", "TDMS", "rename it")),
    Situation("a file of an unknown kind", made("r.bin", lambda path: path.write_bytes(bytes(99))), refused("r.bin", "no reader for the suffix", "convert")),
    Situation("a folder", made("r", lambda path: path.mkdir()), refused("r", "is a folder", "name its data files")),
)  # fmt: skip
SITUATIONS = (*HDF5, *MATLAB, *COLUMNAR, *OTHERS)
