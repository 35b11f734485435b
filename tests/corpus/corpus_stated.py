"""What binary files state of their numbers in other words and at other places than beside the column itself."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from corpus_binary import IN_MM, NAMES, TIMED, UM, hdf5, made, mat, matlab73, table, tdms
from corpus_case import MANIFEST, RIGHT, ROWS, Right, Situation, T, U, Write, X, refused, text
from corpus_case import table as lines

RATE = "sample_rate_hz = 1000.0"
BY_MANIFEST = {"manifest": MANIFEST}
BY_TIME = {"manifest": MANIFEST.replace(RATE, 'time = "t"')}
AT_800_HZ = {"manifest": MANIFEST.replace(RATE, "sample_rate_hz = 800.0")}
FS_IS_1000 = 'beside its columns the file states 1000 Hz (by "fs")'
LOST = np.where(np.arange(ROWS) == 300, -999.0, X)
WITHOUT_300 = Right(remark="row 300", fewest=599)


def stated(key: str, value: Any, stretched: float = 1.0) -> Write:
    """x in another unit, whose attribute tells it."""
    return hdf5(UM | {"x": {key: value}}, x=stretched * X)


def around(key: str, value: Any, place: str = "run", unit: bool = True, stretched: float = 1.0) -> Write:
    """u and x in a group, with an attribute of the group or of the file."""

    def fill(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for name, values in (("t", T), ("u", U), ("x", stretched * X)):
                file[f"run/{name}"] = values
                if unit or name != "x":
                    file[f"run/{name}"].attrs["units"] = IN_MM[name]
            file[place].attrs[key] = value

    return made("r.h5", fill)


def virtual(
    *sources: Mapping[str, Any], own: Mapping[str, Any] | None = None, stretched: float = 1.0
) -> Write:
    """x as a virtual dataset of parts in other files, each with attributes."""

    def write(folder: Path) -> Path:
        parts = np.array_split(stretched * X, len(sources))
        layout = h5py.VirtualLayout(shape=(ROWS,), dtype="f8")
        first = 0
        for k, (values, attributes) in enumerate(zip(parts, sources, strict=True)):
            with h5py.File(folder / f"part{k}.h5", "w") as file:
                file["x"] = values
                file["x"].attrs.update(attributes)
            layout[first : first + len(values)] = h5py.VirtualSource(f"part{k}.h5", "x", shape=(len(values),))
            first += len(values)
        with h5py.File(folder / "r.h5", "w") as file:
            for name, values in (("t", T), ("u", U)):
                file[name] = values
                file[name].attrs["units"] = IN_MM[name]
            file.create_virtual_dataset("x", layout)
            file["x"].attrs.update(own or {})
        return folder / "r.h5"

    return write


def own_fill(chunks: int | None) -> Write:
    """A dataset that was created with a fill value of its own, and not written in row 300."""

    def fill(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for name, values in (("t", T), ("u", U)):
                file[name] = values
                file[name].attrs["units"] = IN_MM[name]
            made_x = file.create_dataset("x", (ROWS,), "f8", fillvalue=-999.0, chunks=chunks and (chunks,))
            made_x[:300], made_x[301:] = X[:300], X[301:]
            made_x.attrs["units"] = "mm"

    return made("r.h5", fill)


def put_period(path: Path) -> None:
    hdf5(t=None)(path.parent)
    with h5py.File(path, "a") as file:
        file["dt"] = 1.0
        file["dt"].attrs["units"] = "ms"


def in_structs73(fill: Callable[[h5py.File], None]) -> Write:
    """A MATLAB 7.3 file with texts, which it keeps as characters' codes."""
    return matlab73(fill)


def put_text(file: h5py.File, name: str, text: str) -> None:
    file[name] = np.array([[ord(one)] for one in text], dtype=np.uint16)
    file[name].attrs["MATLAB_class"] = np.bytes_("char")


def put_rate(file: h5py.File) -> None:
    file["fs"] = np.array([[1000.0]])
    file["fs"].attrs["MATLAB_class"] = np.bytes_("double")


RUN = {"t": T, "u": U, "x": 1e3 * X, "units": {"t": "s", "u": "V", "x": "um"}}
IN_RUN = {"inputs": "run.u", "outputs": {"displacement": "run.x"}, "time": "run.t"}
IN_UM = {"inputs": "u", "outputs": {"displacement": "x"}, "time": "t"}
ASK_MM = {"inputs": "u:V", "outputs": {"displacement": "x:mm"}, "time": "t:s"}

HDF5 = (
    *(
        Situation(f"HDF5, a unit under {key}", stated(key, "um", 1e3), RIGHT, {"outputs": {"displacement": "x"}})
        for key in ("uom", "EngineeringUnits", "Unit_y", "engineering_units", "Unité", "physicalUnit", "unit-of-measure")
    ),
    Situation("HDF5, a unit under another word, and the user's another", stated("uom", "um", 1e3), refused("r.h5", '"um"', '"mm"', "correct"), {"outputs": {"displacement": "x:mm"}}),
    Situation("HDF5, the unit of the time is not the column's", hdf5(UM | {"x": {"units": "mm", "time_unit": "ms"}}), RIGHT),
    Situation("HDF5, a number as a unit", stated("units", 5), Right(remark="the number 5"), {"outputs": {"displacement": "x:mm"}}),
    Situation("HDF5, several units", stated("units", [b"mm", b"um"]), Right(remark="mm, um"), {"outputs": {"displacement": "x:mm"}}),
    Situation("HDF5, a unit in the attribute of the group", around("x_unit", "um", unit=False, stretched=1e3), RIGHT),
    Situation("HDF5, a unit in the attribute of the file", around("unit_x", "um", "/", unit=False, stretched=1e3), RIGHT),
    Situation("HDF5, a table of units of the file", around("units", json.dumps({"x": "um"}), "/", unit=False, stretched=1e3), RIGHT),
    Situation("HDF5, a unit of the group that does not say of which column", around("units", "mm"), Right(remark='units = "mm" of its group "run"')),
    Situation("HDF5, a scale of the group", around("scale_factor", 1e-3), Right(remark='scale_factor = 0.001 of its group "run"')),
    Situation("HDF5, a scale of the file", around("Calibration Factor", 2.5, "/"), Right(remark="Calibration Factor = 2.5 of itself")),
    Situation("HDF5, a scale of one column in the group", around("x_gain", 10.0), Right(remark="x_gain = 10.0")),
    Situation("HDF5, a scale that changes nothing", around("gain", 1.0), RIGHT),
    *(
        Situation(f"HDF5, {key} says nothing of the numbers", hdf5({name: {"units": unit, key: value * k} for k, (name, unit) in enumerate(IN_MM.items(), 1)}), RIGHT)
        for key, value in (("ts", 1.7e9), ("timestamp", 1.7e9), ("T0", 293.15), ("frames_per_second", 25.0), ("signal_to_noise", 40.0), ("missing", 0))
    ),
    Situation("HDF5, a period beside with its unit", made("r.h5", put_period), Right(remark="dt"), NAMES),
    Situation("HDF5, a quality factor is no scale", around("quality_factor", 120.0), RIGHT),
    Situation("HDF5, a sensitivity under its own key", hdf5(UM | {"x": {"units": "mm", "sensitivity_mV_per_mm": 22.4}}), Right(remark="sensitivity_mV_per_mm = 22.4")),
    *(
        Situation(f"HDF5, a fill value under {key}", hdf5(UM | {"x": {"units": "mm", key: -999.0}}, x=LOST), WITHOUT_300)
        for key in ("FillValue", "fill_value", "NoData", "missingValue", "Invalid_Value")
    ),
    Situation("HDF5, no fill value in words", hdf5(UM | {"x": {"units": "mm", "missing": "none"}}), RIGHT),
    Situation("HDF5, a fill value of the dataset", own_fill(None), WITHOUT_300),
    Situation("HDF5, a fill value of the dataset in chunks", own_fill(50), WITHOUT_300),
    Situation("HDF5, a virtual dataset whose source is scaled", virtual({"units": "mm", "scale_factor": 1e-3}, stretched=1e3), RIGHT),
    Situation("HDF5, a virtual dataset of two that are scaled alike", virtual(*[{"units": "mm", "scale_factor": 1e-3}] * 2, stretched=1e3), RIGHT),
    Situation("HDF5, a virtual dataset of two that are scaled differently", virtual({"units": "mm", "scale_factor": 1e-3}, {"units": "mm"}), refused("r.h5", "scale_factor", "sources differ"), {"outputs": {"displacement": "x:mm"}}),
    Situation("HDF5, a virtual dataset whose source has the unit", virtual({"units": "um"}, stretched=1e3), RIGHT),
    Situation("HDF5, a virtual dataset in another unit than its source has", virtual({"units": "um"}), refused("r.h5", '"um"', '"mm"', "correct"), {"outputs": {"displacement": "x:mm"}}),
    Situation("HDF5, a virtual dataset with its own scale", virtual({"scale_factor": 7.0}, own={"units": "mm", "scale_factor": 1e-3}, stretched=1e3), RIGHT),
    Situation("HDF5, a virtual dataset whose source has a fill value", virtual({"units": "mm", "_FillValue": float(X[300])}), WITHOUT_300),
    Situation("HDF5, a rate beside that is not the manifest's", hdf5(fs=1000.0), Right(remark=FS_IS_1000, rate_hz=800.0), AT_800_HZ),
    Situation("HDF5, a rate beside that is the manifest's", hdf5(fs=1000.0), RIGHT, BY_MANIFEST | {"file": "manifest"}),
)  # fmt: skip

MATLAB = (
    Situation("MATLAB 5, units in a struct of the struct", mat(run=RUN), RIGHT, IN_RUN),
    Situation("MATLAB 5, another unit than the struct's", mat(run=RUN), refused("r.mat", '"um"', '"mm"', "correct"), IN_RUN | {"outputs": {"displacement": "run.x:mm"}}),
    Situation("MATLAB 5, a struct of units", mat(t=T, u=U, x=1e3 * X, Units={"t": "s", "u": "V", "x": "um"}), RIGHT, IN_UM),
    Situation("MATLAB 5, a unit in a text beside", mat(t=T, u=U, x=1e3 * X, x_unit="um", u_unit="V", unit_t="s"), RIGHT, IN_UM),
    Situation("MATLAB 5, a unit in a text beside, and the user's another", mat(t=T, u=U, x=1e3 * X, x_units="um"), refused("r.mat", '"um"', '"mm"', "correct"), ASK_MM),
    Situation("MATLAB 5, units that do not say of which column", mat(t=T, u=U, x=X, units="SI"), Right(remark='units = "SI"'), TIMED),
    Situation("MATLAB 5, a gain beside", mat(t=T, u=U, x=X, gain=10.0), Right(remark="gain = 10.0"), TIMED),
    Situation("MATLAB 5, a rate beside that is not the manifest's", mat(u=U, x=X, fs=1000.0), Right(remark=FS_IS_1000, rate_hz=800.0), AT_800_HZ),
    Situation("MATLAB 5, a rate beside that is not the time's", mat(t=2.0 * T, u=U, x=X, fs=1000.0), Right(remark="one of every 2 samples", rate_hz=500.0), BY_TIME | {"file": "manifest"}),
    Situation("MATLAB 5, a rate beside that no decimation gives", mat(t=0.7 * T, u=U, x=X, fs=1000.0), Right(remark=FS_IS_1000, rate_hz=1000.0 / 0.7), BY_TIME),
    Situation("MATLAB 7.3, a unit in a text beside", in_structs73(lambda file: put_text(file, "x_unit", "mm")), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x"}, "time": "t:s"}),
    Situation("MATLAB 7.3, another unit in a struct of units", in_structs73(lambda file: put_text(file, "units/x", "um")), refused("r.mat", '"um"', '"mm"', "correct"), ASK_MM),
    Situation("MATLAB 7.3, a rate beside that is not the manifest's", matlab73(put_rate), Right(remark=FS_IS_1000, rate_hz=800.0), AT_800_HZ),
)  # fmt: skip

COLUMNAR = (
    Situation("NumPy, a unit in a text beside", made("r.npz", lambda path: np.savez(path, t=T, u=U, x=1e3 * X, x_unit="um")), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x"}, "time": "t:s"}),
    Situation("NumPy, a rate beside that is not the manifest's", made("r.npz", lambda path: np.savez(path, u=U, x=X, fs=1000.0)), Right(remark=FS_IS_1000, rate_hz=800.0), AT_800_HZ),
    Situation("Parquet, a unit of a column in the schema", made("r.parquet", lambda path: pq.write_table(table({"x_unit": "mm"}), path)), RIGHT),
    Situation("Parquet, another unit of a column in the schema", made("r.parquet", lambda path: pq.write_table(pa.table({"t": T, "u": U, "x": X}).replace_schema_metadata({"x_unit": "um"}), path)), refused("r.parquet", '"um"', '"mm"', "correct"), ASK_MM),
    Situation("Parquet, attributes of pandas", made("r.parquet", lambda path: pandas_with_units().to_parquet(path)), RIGHT, IN_UM),
    Situation("Parquet, an entry a column", made("r.parquet", lambda path: pq.write_table(pa.table({"t": T, "u": U, "x": 1e3 * X}).replace_schema_metadata({"columns": json.dumps({"x": {"unit": "um"}})}), path)), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x"}, "time": "t:s"}),
    Situation("TDMS, a scale of the file in its own words", tdms({"calibration_factor": 2.0}), Right(remark="calibration_factor = 2.0"), {"outputs": {"displacement": "x"}}),
    Situation("TDMS, a date of calibration is no scale", tdms({"calibration_date": "2026-01-02"}), RIGHT, {"outputs": {"displacement": "x"}}),
)  # fmt: skip


def apart(starts: tuple[Any, Any], key: str = "t0") -> Write:
    """u and x without their first rows, as they begin at different times."""

    def fill(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for name, values, start in (("u", U, starts[0]), ("x", X, starts[1])):
                file[name] = values[4:] if name == "x" else values[:-4]
                file[name].attrs.update({"units": IN_MM[name], "dt": 1e-3, key: start})

    return made("r.h5", fill)


ALIGNED = Right(remark="begin", rows=592, fewest=592, lost=np.arange(4, ROWS - 4))
HALF_A_SAMPLE = ("r.h5", "begin", "sample")
CHANNELS = [{"name": "t", "unit": "s"}, {"name": "u", "unit": "V"}, {"name": "x", "unit": "um"}]
TEXT_UM = "t,u,x\n" + lines(T, U, 1e3 * X, form="{:.9g}")
TEXT_MM = "t [s],u [V],x [mm]\n" + lines(T, U, X)
NO_TESTS = {"test": "none"}
STARTS = (
    Situation("HDF5, columns that begin at different times", apart((0.0, 4e-3)), ALIGNED, NO_TESTS),
    Situation("HDF5, columns that begin at different milliseconds", apart((0.0, 4.0), "t_start_ms"), ALIGNED, NO_TESTS),
    Situation("HDF5, columns that begin at different dates", apart(("2026-11-28T10:00:00", "2026-11-28T10:00:00.004"), "start_time"), ALIGNED, NO_TESTS),
    Situation("HDF5, columns that begin half a sample apart", apart((0.0, 4.5e-3)), refused(*HALF_A_SAMPLE), NO_TESTS),
    Situation("HDF5, columns that begin together", hdf5({"t": {"units": "s"}, "u": {"units": "V", "t0": 5.0}, "x": {"units": "mm", "t0": 5.0}}), RIGHT),
)  # fmt: skip
ELSEWHERE = (
    Situation("Parquet, a list of channels", made("r.parquet", lambda path: pq.write_table(pa.table({"t": T, "u": U, "x": 1e3 * X}).replace_schema_metadata({"channels": json.dumps(CHANNELS)}), path)), RIGHT, IN_UM),
    Situation("Parquet, a table of scales", made("r.parquet", lambda path: pq.write_table(table({"scales": json.dumps({"u": 1.0, "x": 0.1})}), path)), Right(remark="scales.x = 0.1")),
    Situation("MATLAB 5, a struct of calibrations", mat(t=T, u=U, x=X, cal={"x": 0.1}, calibration={"x": 0.1}), Right(remark="calibration.x = 0.1"), TIMED),
    Situation("MATLAB 5, units a struct deeper", mat(t=T, u=U, x=1e3 * X, info={"units": {"x": "um", "u": "V", "t": "s"}}), RIGHT, IN_UM),
    Situation("HDF5, a group of units beside", hdf5(UM | {"x": {}}, x=1e3 * X, **{"metadata/x/unit": np.bytes_("um")}), RIGHT),
    Situation("MATLAB 5, units two structs deeper", mat(t=T, u=U, x=1e3 * X, log={"info": {"units": {"x": "um", "u": "V", "t": "s"}}}), RIGHT, IN_UM),
    Situation("HDF5, a group of calibrations beside", hdf5(**{"calibration/x/gain": np.array(0.1), "metadata/u/scale": np.array(3.0)}), Right(remark="calibration.x.gain = 0.1")),
    Situation("HDF5, a group of sensitivities beside", hdf5(**{"sensitivity/x": np.array(0.1)}), Right(remark="sensitivity.x = 0.1")),
    *(
        Situation(f"HDF5, a scale called {key}", hdf5(UM | {"x": {"units": "mm", key: value}}), Right(remark=f"{key} = "))
        for key, value in (("mm_per_V", 2.0), ("counts_to_mm", 0.1), ("resolution", 0.01), ("cal", 1.5), ("attenuation", 10.0), ("bias", 0.2), ("conversion", "x = 0.1 * raw"), ("SI_prefix", "d"), ("Kalibrierfaktor", 2.5))
    ),
    *(
        Situation(f"HDF5, a scale of x called {key}", hdf5(UM | {"x": {"units": "mm", key: 0.1}}), Right(remark=f'column "x": the file states {key} = 0.1'))
        for key in ("c1", "k", "b", "step", "range", "bits", "full_scale", "fsr", "norm", "power_of_ten")
    ),
    *(
        Situation(f"MATLAB 5, a scale called {key}", mat(t=T, u=U, x=X, **{key: 0.1}), Right(remark=f"{key} = 0.1"), TIMED)
        for key in ("c1", "k", "step", "adc_range", "bits", "full_scale", "Vref", "x_range", "k_x")
    ),
    Situation("MATLAB 5, numbers that are no scales", mat(t=T, u=U, x=X, time_step=0.1, frequency_range=np.array([0.1, 400.0]), run=3.0), RIGHT, TIMED),
    Situation("NumPy, coefficients", made("r.npz", lambda path: np.savez(path, t=T, u=U, x=X, c0=0.2, c1=0.1)), Right(remark="c0 = 0.2, c1 = 0.1"), TIMED),
    Situation("Parquet, coefficients in a table", made("r.parquet", lambda path: pq.write_table(table({"calibration": json.dumps({"x": {"k": 0.1}})}), path)), Right(remark="calibration.x.k = 0.1")),
    Situation("text, a range and bits above the columns", text("# Range: 10 V\n# Bits: 16\n" + TEXT_MM), Right(remark="Range = 10 V, Bits = 16")),
    Situation("MATLAB 5, a decimation beside a rate", mat(u=U, x=X, fs=1000.0, decimation=2.0), Right(remark="decimation = 2.0 beside its sample rate, 1000 Hz"), NAMES),
    Situation("MATLAB 5, a decimation beside a rate, and the rate of the rows", mat(u=U, x=X, fs=10_000.0, decimation=10.0), Right(remark="decimation = 10.0"), NAMES | {"sample_rate_hz": 1000.0, "time": "-"}),
    Situation("MATLAB 5, a decimation of 1", mat(u=U, x=X, fs=1000.0, decimation=1.0), RIGHT, NAMES),
    Situation("HDF5, a downsampling of x", hdf5({"t": {}, "u": {"units": "V", "fs": 1000.0}, "x": {"units": "mm", "fs": 1000.0, "downsampling": 10}}, t=None), Right(remark="downsampling = 10 beside its sample rate")),
    Situation("HDF5, a decimation of the file, and the rate of the rows", hdf5({"t": {}, "u": {"units": "V", "fs": 1e4}, "x": {"units": "mm", "fs": 1e4}}, t=None, Decimation=np.array(10)), Right(remark="Decimation = 10.0 beside"), {"sample_rate_hz": 1000.0}),
    Situation("text, a decimation above the columns", text("# fs = 1000 Hz\n# decimation: 4\nu [V],x [mm]\n" + lines(U, X)), Right(remark="decimation = 4 beside its sample rate")),
    Situation("HDF5, two rates", hdf5({"t": {}, "u": {"units": "V", "fs": 1000.0}, "x": {"units": "mm", "fs": 1000.0}}, t=None, Sampling_Rate=2000.0), Right(remark="two rates: 1000 Hz")),
    Situation("text, a unit above the columns", text("Unit of x: um\nUnit of u: V\n" + TEXT_UM), RIGHT, {"inputs": "u", "outputs": {"displacement": "x"}, "time": "t:s"}),
    Situation("text, a unit above the columns, and the user's another", text("Unit of x: um\n" + TEXT_UM), refused("r.csv", '"um"', '"mm"', "correct"), ASK_MM),
    Situation("text, units of all columns above", text("Y_Unit_Label\tV\tum\n" + TEXT_UM), RIGHT, {"inputs": "u", "outputs": {"displacement": "x"}, "time": "t:s"}),
    Situation("text, a scale above the columns", text("# scale x: 0.001 mm/count\n" + TEXT_MM), Right(remark="scale x = 0.001 mm/count")),
    Situation("text, a gain above the columns", text("# Multiplier = 0.001\n" + TEXT_MM), Right(remark="Multiplier = 0.001 of itself")),
    Situation("text, a number for no reading above the columns", text("# NoData = -9999\nt [s],u [V],x [mm]\n" + lines(T, U, np.where(np.arange(ROWS) == 300, -9999.0, X))), WITHOUT_300),
)  # fmt: skip


def pandas_with_units() -> pd.DataFrame:
    frame = pd.DataFrame({"t": T, "u": U, "x": 1e3 * X})
    frame.attrs = {"units": {"t": "s", "u": "V", "x": "um"}, "operator": "A"}
    return frame


SITUATIONS = (*HDF5, *MATLAB, *COLUMNAR, *STARTS, *ELSEWHERE)
