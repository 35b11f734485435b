"""Words of text files that programs and people write in their own way: names with separators, dates, signs."""

from __future__ import annotations

import numpy as np
import pandas as pd
from corpus_binary import made
from corpus_case import RIGHT, ROWS, Right, Situation, T, U, Write, X, refused, table, text
from corpus_time import dates

K = np.arange(ROWS)
SINCE_1970 = [str(1_795_255_200_000 + int(k)) for k in K]
SURPLUS = ("r.csv", "more names than their 3 columns", "one name a column")
NAMES = (
    Situation("a comma in brackets of the time", text("Timestamp (ms since epoch, UTC+1),u [V],x [mm]\n" + table(SINCE_1970, U, X)), RIGHT),
    Situation("a comma in brackets of the last name", text("t [s],u [V],x (raw,laser) [mm]\n" + table(T, U, X)), RIGHT),
    Situation("a comma in brackets of a comment", text("# t (ms, UTC+1), u [V], x [mm]\n" + table(SINCE_1970, U, X)), RIGHT, {"time": "t (ms, UTC+1)"}),
    Situation("a name more than columns, the first", text("n,t [s],u [V],x [mm]\n" + table(T, U, X)), refused(*SURPLUS, '"x [mm]"')),
    Situation("a name more than columns, the last", text("t [s],u [V],x [mm],y [mm]\n" + table(T, U, X)), refused(*SURPLUS, '"y [mm]"')),
    Situation("a name more than columns, of comments", text("t [s],u [V],x [mm],Comment\n" + table(T, U, X)), RIGHT),
)  # fmt: skip
STAMPS = (
    *(
        Situation(f"a date with a zone, {zone.strip()}", text("time,u [V],x [mm]\n" + table(dates(f"%Y-%m-%d %H:%M:%S.@{zone}"), U, X)), RIGHT)
        for zone in (" +0100", " UTC", " GMT", "Z")
    ),
    Situation("a date with the name of its month", text("time,u [V],x [mm]\n" + table(dates("%d-Nov-%Y %H:%M:%S.@"), U, X)), RIGHT),
    Situation("a date with the name of its month in German", text("Zeit;u [V];x [mm]\n" + table(dates("%d. Dez %Y %H:%M:%S,@"), U, X, separator=";")), RIGHT),
    Situation("a date with the name of no month", text("time,u [V],x [mm]\n" + table(dates("%d-Nix-%Y %H:%M:%S.@"), U, X)), refused("r.csv", '"time"', "21-Nix-2026")),
    Situation("minutes and seconds", text("Time,u [V],x [mm]\n" + table([f"{int(one // 60):02d}:{one % 60:06.3f}" for one in 59.7 + T], U, X)), RIGHT),
    Situation("minutes and seconds that lost their hours", text("Time,u [V],x [mm]\n" + table([f"{int(one // 60) % 60:02d}:{one % 60:06.3f}" for one in 3599.7 + T], U, X)), refused("r.csv", "goes back by 3600 s", "without their hours")),
)  # fmt: skip


INDEX = pd.date_range("2026-11-21 10:00", periods=ROWS, freq="1ms", tz="Europe/Berlin")
LEVELS = pd.MultiIndex.from_tuples([("drive", "V"), ("displacement", "mm")], names=["signal", "unit"])
THREE = pd.MultiIndex.from_tuples([("u", "raw", "V"), ("x", "raw", "mm")])


def frame(index: pd.Index, names: object = ("u [V]", "x [mm]")) -> Write:
    columns = names if isinstance(names, pd.MultiIndex) else list(names)  # type: ignore[call-overload]
    return made("r.csv", lambda path: pd.DataFrame(np.stack([U, X], axis=1), index, columns).to_csv(path))


def twice(name: str, second: np.ndarray, unit: str = "s") -> Write:
    return text(f"{name},u,{name},x\ns,V,{unit},mm\n" + table(T, U, second, X))


TABLES = (
    Situation("pandas, dates as index", frame(INDEX), RIGHT),
    Situation("pandas, passed time as index", frame(pd.to_timedelta(T, unit="s")), RIGHT),
    Situation("pandas, seconds as index", frame(pd.Index(T)), Right(remark='nobody states the unit of "column_1"')),
    Situation("pandas, rows as index", frame(pd.RangeIndex(ROWS)), refused("r.csv", '"column_1"', "--sample-rate HZ")),
    Situation("pandas, rows as index, and a rate", frame(pd.RangeIndex(ROWS)), RIGHT, {"sample_rate_hz": 1000.0}),
    Situation("pandas, levels of names and units", frame(pd.Index(T, name="t [s]"), LEVELS), RIGHT),
    Situation("pandas, three levels", frame(pd.Index(T, name="t [s]"), THREE), RIGHT),
    Situation("a time beside each signal, the same twice", twice("Time", T), RIGHT),
    Situation("a time beside each signal, later by half a row", twice("Time", T + 5e-4), refused("r.csv", 'the time column "Time" is not clear', "rename one")),
    Situation("a time beside each signal, in two units", twice("Time", T, "ms"), refused("r.csv", 'the time column "Time" is not clear', "rename one")),
)  # fmt: skip
RATED = {"sample_rate_hz": 1000.0}
UNITS_BELOW = "Channel;u;x\nUnit;V;mm\n"
EMPTY = [""] * ROWS
COUNTED = [str(k) for k in K]
LABELS = (
    Situation("a row of factors above the numbers", text(UNITS_BELOW + "Factor;10;0.5\nOffset;0;0\n" + table(EMPTY, U, X, separator=";")), Right(remark="which is not applied"), RATED),
    Situation("rows of limits above the numbers", text(UNITS_BELOW + "Min;-4;-1\nMax;4;1\n" + table(COUNTED, U, X, separator=";")), RIGHT, RATED),
    Situation("a row of factors that change nothing", text("Name,t,u,x\nUnit,s,V,mm\nGain,1,1,1\n" + table(EMPTY, T, U, X)), RIGHT),
)  # fmt: skip
SITUATIONS = (*NAMES, *STAMPS, *TABLES, *LABELS)
