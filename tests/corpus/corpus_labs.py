"""What labs write that was read wrong without a word, or refused without a remedy: found by a stranger's 300 files."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
from corpus_binary import made, mat, tdms
from corpus_case import MANIFEST, RIGHT, ROWS, A, Right, Situation, T, U, Write, X, refused, table, text
from nptdms import ChannelObject, TdmsWriter

K = np.arange(ROWS)
LOGARITHM = "by its name a logarithm, which is no signal"
NANOSECONDS, MICROSECONDS = (1e9 * (1300.0 + T)).round(), (1e6 * (1300.0 + T)).round()
"""Counts of a clock that was switched on 1300 s before."""
SINCE_POWER_UP = ("r.csv", "since it was switched on", "--time t:UNIT", "--sample-rate")
MARKED = [f"{round(2000.0 * one / np.abs(X).max()):,d}" for one in X]
DSPACE = {
    "X": {"Name": "time", "Unit": "s", "Data": T},
    "Y": np.array(
        [{"Name": "u", "Unit": "V", "Data": U}, {"Name": "x", "Unit": "um", "Data": 1e3 * X}], dtype=object
    ),
}
BY_NUMBER = {
    "inputs": "run.Y{1}.Data:V",
    "outputs": {"displacement": "run.Y{2}.Data:mm"},
    "time": "run.X.Data:s",
}
IN_TORQUE = Right(units={"drive": "N*m", "displacement": "mm"})
IN_FORCE = Right(units={"drive": "N", "displacement": "mm"})


def grouped(path: object) -> None:
    with h5py.File(path, "w") as file:
        for name, unit, values in (("t", "s", T), ("u", "V", U), ("x", "um", 1e3 * X)):
            file[f"{name}/data"] = values
            file[name].attrs["unit"] = unit


def appended(pause_s: float, rows: int = 300) -> Write:
    """TDMS acquisitions of some rows in one file, each `pause_s` after the last."""

    def write(path: Path) -> None:
        for first in range(0, ROWS, rows):
            mode = "a" if first else "w"
            passed_ms = int(first + 1000 * pause_s * first / rows)
            start = np.datetime64("2026-11-21T10:00:00") + np.timedelta64(passed_ms, "ms")
            properties = {"wf_increment": 1e-3, "wf_start_time": start}
            channels = [
                ChannelObject("g", name, values[first : first + rows], {**properties, "unit_string": unit})
                for name, unit, values in (("u", "V", U), ("x", "mm", X))
            ]
            with TdmsWriter(path, mode=mode) as file:
                file.write_segment(channels)

    return made("r.tdms", write)


def counted(*lost: int) -> str:
    kept = np.delete(K, lost)
    return "# fs = 1000 Hz\nsample,u [V],x [mm]\n" + table(kept.astype(float), U[kept], X[kept])


UNITS = (
    Situation("torque in Nm", text("t [s],torque [Nm],x [mm]\n" + table(T, U, X)), IN_TORQUE),
    Situation("torque in mNm", text("t [s],torque [mNm],x [mm]\n" + table(T, 1e3 * U, X)), IN_TORQUE),
    Situation("force in kn", text("t [s],force [kn],x [mm]\n" + table(T, 1e-3 * U, X, form="{:.12g}")), IN_FORCE),
    Situation("metres per second squared without a slash", text("t [s],u [V],x [mm],acc (ms⁻²)\n" + table(T, U, X, 1e-3 * A)), RIGHT),
    Situation("the same in ASCII", text("t [s],u [V],x [mm],acc (mms^-2)\n" + table(T, U, X, A)), RIGHT),
    Situation("milli-g and milligrams", text("t [s],u [V],x [mm],acc [mg]\n" + table(T, U, X, A)), refused("r.csv", "--scale", "0.00980665 m/s^2/mg")),
    Situation("a weight in kg", text("t [s],load [kg],x [mm]\n" + table(T, U, X)), refused("r.csv", "--scale", "9.80665 N/kg")),
)  # fmt: skip
TIMES = (
    Situation("microseconds since power-up", text("t,u [V],x [mm]\n" + table(MICROSECONDS, U, X, form="{:.12g}")), refused(*SINCE_POWER_UP)),
    Situation("nanoseconds since power-up", text("t,u [V],x [mm]\n" + table(NANOSECONDS, U, X, form="{:.15g}")), refused(*SINCE_POWER_UP)),
    Situation("microseconds since power-up, said", text("t,u [V],x [mm]\n" + table(MICROSECONDS, U, X, form="{:.12g}")), RIGHT, {"time": "t:us"}),
    Situation("rows that a counter misses", text(counted(*range(300, 340))), Right(remark='"sample" counts the rows and misses 40, first before row 300', rows=560, fewest=560, lost=np.delete(K, np.arange(300, 340)))),
    Situation("LabVIEW's increment of 1 s beside a time", tdms({"wf_increment": 1.0}, t=T, u=U, x=X), Right(remark="as programs do where nobody set it"), {"inputs": "u:V", "outputs": {"displacement": "x:mm"}, "time": "t:s"}),
)  # fmt: skip
NAMED = (
    Situation("minutes at the end of a name", text("Zeit_min,u [V],x [mm]\n" + table(T / 60.0, U, X, form="{:.12g}")), RIGHT),
    Situation("a count of rows that is called an index in Spanish", text("; Frecuencia de muestreo: 1 kHz\nindice;u_V;x_mm\n" + table(K.astype(float), U, X, separator=";")), Right(remark="1000 Hz")),
    Situation("rows that are lost, with how many and where", text("t [s],u [V],x [mm]\n" + table(np.delete(T, [100, 300]), np.delete(U, [100, 300]), np.delete(X, [100, 300]))), Right(remark="2 rows are missing, first before row 100", fewest=0, lost=np.delete(K, [100, 300]), within=0.02)),
)  # fmt: skip
RATES = (
    Situation("PicoScope's Tinterval", mat(Tinterval=1e-3, A=U, B=X), Right(remark="1000 Hz"), {"inputs": "A:V", "outputs": {"displacement": "B:mm"}}),
    Situation("PicoScope's Tinterval, contradicted", mat(Tinterval=1e-3, A=U, B=X), refused("r.mat", "Tinterval", "--time -"), {"inputs": "A:V", "outputs": {"displacement": "B:mm"}, "sample_rate_hz": 500.0}),
    Situation("an oscilloscope's XInc", mat(XInc=1e-3, A=U, B=X), Right(remark="1000 Hz"), {"inputs": "A:V", "outputs": {"displacement": "B:mm"}}),
    Situation("a camera's frame rate", text("Frame rate: 1000 fps\nu [V],x [mm]\n" + table(U, X)), Right(remark="1000 Hz")),
    Situation("an output data rate", text("# ODR = 1000 Hz\nu [V],x [mm]\n" + table(U, X)), Right(remark="1000 Hz")),
    Situation("a sampling cycle", text("Sampling cycle: 1 ms\nu [V],x [mm]\n" + table(U, X)), Right(remark="1000 Hz")),
)  # fmt: skip
ACQUISITIONS = (
    Situation("two acquisitions in one TDMS", appended(600.0), Right(remark="2 acquisitions in one file, with a pause before row 300")),
    Situation("one acquisition in two pieces of TDMS", appended(0.0), RIGHT),
    Situation("sixty acquisitions in one TDMS", appended(600.0, rows=10), refused("r.tdms", "60 pieces with start times", "a file of its own")),
    Situation("a stream in sixty pieces of TDMS", appended(0.0, rows=10), RIGHT),
    Situation("two acquisitions in one TDMS as one record", appended(600.0), refused("r.tdms", "2 acquisitions", "rows = [300, 600]"), {"manifest": MANIFEST}),
)  # fmt: skip
LOGARITHMS = (
    Situation("a logarithm", text("t [s],u [V],log10 x [mm]\n" + table(T, U, X)), refused("r.csv", "log10 x [mm]", LOGARITHM)),
    Situation("a natural logarithm", text("t [s],u [V],ln(x)\n" + table(T, U, X)), refused("r.csv", "ln(x)", LOGARITHM)),
    Situation("a logarithm that is said to be mm", text("t [s],u [V],log10_x\n" + table(T, U, X)), refused("r.csv", "log10_x", LOGARITHM), {"outputs": {"displacement": "log10_x:mm"}}),
    Situation("a logarithm in a manifest of one's own", text("t [s],u [V],log10_x\n" + table(T, U, X)), Right(remark="its name says that it is a logarithm"), {"manifest": MANIFEST.replace('"x"', '"log10_x"').replace('"u"', '"u [V]"')}),
    Situation("what a logger wrote", text("t [s],log_u [V],log.x [mm]\n" + table(T, U, X)), RIGHT),
)  # fmt: skip
PLACES = (
    Situation("a unit in the struct of its array", mat(run=DSPACE), RIGHT),
    Situation("a unit in the struct of its array, contradicted", mat(run=DSPACE), refused("r.mat", '"um"', '"mm"'), BY_NUMBER),
    Situation("a unit of the group of its array", made("r.h5", grouped), RIGHT),
    Situation("marks of thousands among whole numbers", text("t [s]\tu [V]\tx [um]\n" + table([f"{one:.3f}" for one in T], [f"{one:.6f}" for one in U], MARKED, separator="\t"), "r.txt"), refused("r.txt", "marks of thousands", "export the file without")),
)  # fmt: skip
SITUATIONS = (*UNITS, *TIMES, *NAMED, *RATES, *ACQUISITIONS, *LOGARITHMS, *PLACES)
