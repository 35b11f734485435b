"""Habits of instruments that change what the numbers mean: powers of ten in units, two times, codes for no reading."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pyuff
from corpus_binary import hdf5, made, mat
from corpus_case import RIGHT, ROWS, Right, Situation, T, U, Write, X, refused, table, text
from measured_files import uff58, write_uff
from scipy.io import savemat

NAMES = {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}
SAID = NAMES | {"time": "t:s"}
K = np.arange(ROWS)
LATE = np.where(K < 300, T, T + 3.0)
SLOWER = np.concatenate([T[:300], T[299] + 2e-3 * (1.0 + np.arange(ROWS - 300))])
LOST = np.delete(T, 300)


def three(unit: str, stretched: float) -> str:
    return f"t [s],u [V],x [{unit}]\n" + table(T, U, stretched * X, form="{:.9g}")


def timed(time: np.ndarray) -> str:
    rows = len(time)
    return "t [s],u [V],x [mm]\n" + table(time, U[:rows], X[:rows], form="{:.9g}")


def two_times(second: np.ndarray, name: str = "t2 [s]") -> str:
    return f"t1 [s],u [V],{name},x [mm]\n" + table(T, U, second, X, form="{:.9g}")


def coded(code: float, *rows: int) -> str:
    return "t [s],u [V],x [mm]\n" + table(T, U, np.where(np.isin(K, rows), code, X), form="{:.9g}")


UNITS = (
    Situation("a unit of 1e-3 m", text(three("1e-3 m", 1.0)), RIGHT),
    Situation("a unit of 10^-6 m", text(three("10^-6 m", 1e3)), RIGHT),
    Situation("a unit of 0.001 m in a row of units", text("t,u,x\ns,V,0.001 m\n" + table(T, U, X)), RIGHT),
    Situation("a unit of 1e-6 m, and the user's another", text(three("1e-6 m", 1e3)), refused("r.csv", '"1e-6 m"', '"m"', "correct one"), {"outputs": {"displacement": "x [1e-6 m]:m"}}),
    Situation("a unit with a number", text(three("0.1 mm", 1.0)), Right(remark='"0.1 mm", which is no known unit'), {"outputs": {"displacement": "x [0.1 mm]:mm"}}),
    Situation("a unit with a number, nothing said", text(three("0.1 mm", 1.0)), refused("r.csv", "x [0.1 mm]", "--output")),
    Situation("a power of ten before a square", text(three("1e-3 m^2", 1.0)), refused("r.csv", "x [1e-3 m^2]", "--output")),
    Situation("a power of ten before a unit of two", text(three("1e-3 V/m", 1.0)), RIGHT._replace(units={"drive": "V", "displacement": "mV/m"})),
    Situation("a unit in capitals", text(three("MM", 1.0)), RIGHT),
    Situation("HDF5, a unit of 1E-3*m", hdf5({"t": {"units": "s"}, "u": {"units": "V"}, "x": {"units": "1E-3*m"}}), RIGHT),
)  # fmt: skip

TIMES = (
    Situation("a rate, and a time with a gap", text(timed(LATE)), refused("r.csv", "t [s]", "row 299", "--time -"), {"sample_rate_hz": 1000.0}),
    Situation("a rate, and a time that slows down", text(timed(SLOWER)), refused("r.csv", "t [s]", "--time -"), {"sample_rate_hz": 1000.0}),
    Situation("the later rate, and a time that slows down", text(timed(SLOWER)), refused("r.csv", "t [s]", "--time -"), {"sample_rate_hz": 500.0}),
    Situation("a rate, and a time with a lost row", text(timed(LOST)), refused("r.csv", "t [s]", "--time -"), {"sample_rate_hz": 1000.0}),
    Situation("a rate, and a time that goes back", text(timed(np.concatenate([T[:300], T[299:289:-1], T[310:]]))), refused("r.csv", "t [s]", "goes back after row 300", "--time -"), {"sample_rate_hz": 1000.0}),
    Situation("a rate, and a time that is passed over", text(timed(T)), RIGHT, {"sample_rate_hz": 1000.0, "time": "-"}),
    Situation("two times of different rates", text(two_times(2.0 * T)), refused("r.csv", '"t1 [s]"', '"t2 [s]"', "--time")),
    Situation("two times in different units", text(two_times(2e3 * T, "t_x [ms]")), refused("r.csv", '"t1 [s]"', '"t_x [ms]"', "--time")),
    Situation("two times that are the same", text(two_times(T)), RIGHT),
    Situation("two times a constant apart", text(two_times(T + 5e-3)), Right(remark="0.005 s later")),
    Situation("two times, one of them named", text(two_times(2.0 * T)), RIGHT, {"time": "t1 [s]"}),
    *(
        Situation(f"a variable {name}", made("r.mat", lambda path, name=name, value=value: savemat(path, {"u": U, "x": X, name: value})), Right(remark=name), NAMES)
        for name, value in (("dt_ms", 1.0), ("dt_us", 1000.0), ("Ts_ms", 1.0), ("fs_kHz", 1.0), ("Ts", 1e-3), ("sample_interval_ms", 1.0))
    ),
    Situation("a variable dt and its unit beside", mat(u=U, x=X, dt=1.0, dt_unit="ms"), Right(remark="dt"), NAMES),
)  # fmt: skip

DAYS = 45000.5 + T / 86_400.0
SINCE = {"t": {"units": "milliseconds since 2026-11-21 10:00"}, "u": {"units": "V"}, "x": {"units": "mm"}}


def in_groups(path: Path) -> None:
    """Columns that numbers name, in groups."""
    with h5py.File(path, "w") as file:
        for name, values, unit in (("t", T, "s"), ("u", U, "V"), ("x/10", X, "mm")):
            file[name] = values
            file[name].attrs["units"] = unit


def in_millimetres(path: Path) -> None:
    """A universal file of ordinates without units, and a dataset 164 that says that lengths are in mm."""
    write_uff(path, [uff58(U, id1="drive", unit="V"), uff58(X, id1="x tip", unit="NONE")])
    file = pyuff.UFF(str(path))
    file.write_sets(
        {"type": 164, "units_code": 5, "units_description": "mm (milli-newton)", "temp_mode": 1, "length": 1000.0,
         "force": 1000.0, "temp": 1.0, "temp_offset": 273.15},
        "add",
    )  # fmt: skip


ORIGINS = (
    Situation("HDF5, milliseconds since a date", hdf5(SINCE, t=1e3 * T), RIGHT),
    Situation("a time in seconds that counts days", text("Time [s],u [V],x [mm]\n" + table(DAYS, U, X, form="{:.15g}")), Right(remark="as days of a spreadsheet", rate_hz=86_400_000.0)),
    Situation("UFF, units in a dataset of their own", made("r.uff", in_millimetres), Right(remark="1000 make a metre"), {"outputs": {"displacement": "x tip:mm"}}),
)  # fmt: skip

CODES = (
    Situation("a code for no reading in a block", text(coded(9999.0, *range(100, 110))), Right(remark="10 readings are 9999 mm", within=2e5)),
    Situation("a code for no reading, apart", text(coded(-999.25, 50, 200, 400)), Right(remark="3 readings are -999.25 mm", within=2e4)),
    Situation("one reading far from all others", text(coded(9999.0, 300)), Right(remark="row 300", within=2e5)),
)  # fmt: skip


def named(name: str, stretched: float = 1.0) -> Write:
    return text(f't [s],u [V],"{name}"\n' + table(T, U, stretched * X, form="{:.9g}"))


SCALED = ("r.csv", "scale in its name", "--output", "--scale 'displacement=")
NOT_APPLIED = Right(remark='the scale in its name, "*1000", is not applied')
SCALES = (
    *(
        Situation(f"a name with a scale, {name}", named(name), refused(*SCALED, name, per_number))
        for name, per_number in (
            ("x*1000 [m]", "0.001 UNIT"), ("1000*x [m]", "0.001 UNIT"), ("x (x1000)", "0.001 UNIT"), ("x [mm] x10", "0.1 UNIT"),
            ("x [mm*10]", "0.1 UNIT"), ("x/10", "10 UNIT"), ("y/10 [mm]", "10 UNIT"), ("x_div_10 [mm]", "10 UNIT"), ("x · 10^3 [m]", "0.001 UNIT"), ("x (1:10) [mm]", "10 UNIT"),
        )
    ),
    Situation("a name with a scale, and what a number counts", named("x*1000 [m]"), RIGHT, {"scales": "displacement=0.001 m"}),
    Situation("a name with a scale, and the unit of its numbers", named("x*1000 [m]"), NOT_APPLIED, {"outputs": {"displacement": "x*1000 [m]:mm"}}),
    Situation("a name with a scale, and a unit in a row of its own", text("t,u,x*1000\ns,V,m\n" + table(T, U, X)), refused(*SCALED, "0.001 UNIT")),
    Situation("a time with a scale in its name", text("t*1000 [s],u [V],x [mm]\n" + table(1e3 * T, U, X)), refused("r.csv", 't*1000 [s]', "scale", "--time 't*1000 [s]:UNIT'")),
    Situation("a time with a scale in its name, and its unit", text("t*1000 [s],u [V],x [mm]\n" + table(1e3 * T, U, X)), RIGHT, {"time": "t*1000 [s]:ms"}),
    Situation("a scale in its name as a power of ten", text("t [s],u [V],x (x10^-3) [m]\n" + table(T, U, X)), refused("r.csv", 'in its name, "x10^-3"', "--output"), {}),
    Situation("letters of channels above a row of units", text("Time,Channel (A),Channel (B)\ns,V,mm\n" + table(T, U, X)), RIGHT, {"inputs": "Channel (A)", "outputs": {"displacement": "Channel (B)"}}),
    Situation("a time whose name and row of units contradict each other", text("t [ms],u [V],x [mm]\ns,V,mm\n" + table(T, U, X)), refused("r.csv", 'the time column "t [ms]" is not clear', 'states "s", its name "ms"', "--time")),
    Situation("a name and a row of units that contradict each other", text("t [s],u [V],x [um]\ns,V,mm\n" + table(T, U, X)), refused("r.csv", "x [um]", 'states "mm", its name "um"', "--output")),
    Situation("a name and a row of units that agree", text("t [s],u [V],x [mm]\nsec,Volt,millimeter\n" + table(T, U, X)), RIGHT),
    *(Situation(f"a name with a number that is no scale, {name}", named(name), RIGHT) for name in ("x2 [mm]", "x10 [mm]", "pos 10 [mm]", "CH1/2 [mm]", "x*1 [mm]")),
    Situation("HDF5, a column 10 of a group x", made("r.h5", in_groups), RIGHT, {"outputs": {"displacement": "x/10"}}),
)  # fmt: skip

SITUATIONS = (*UNITS, *TIMES, *ORIGINS, *CODES, *SCALES)
