"""Instants in several columns: date, time of day and parts of a second of loggers, stamps of ROS messages."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
from corpus_binary import made
from corpus_case import MANIFEST, RIGHT, ROWS, Right, Situation, T, U, Write, X, refused, table, text
from corpus_time import START, dates

K = np.arange(ROWS)
MS = [str(k) for k in K]
SPRING = datetime(2026, 4, 3, 23, 59, 59, 700_000)
LATE = datetime(2026, 11, 21, 23, 59, 59, 700_000)
MORNING = datetime(2026, 11, 21, 9, 59, 59, 700_000)
STAMPS_NS = [1_795_255_200_700_000_000 + 1_000_000 * int(k) for k in K]
"""Instants since 1970 [ns], the whole second of which changes on the way."""
SECS, NSECS = [str(one // 10**9) for one in STAMPS_NS], [str(one % 10**9) for one in STAMPS_NS]
NAMES = {"inputs": "field.u:V", "outputs": {"displacement": "field.x:mm"}}
JOINED = '"Date + Time"'
LATER = [*K[:300], *(K[300:] + 86_400_000)]
"""Milliseconds of a record whose second half is a day later."""


def parts(start: datetime, digits: int = 3) -> list[str]:
    """Parts of a second, without zeros in front."""
    return [str((start + timedelta(milliseconds=int(k))).microsecond // 10 ** (6 - digits)) for k in K]


def logged(head: str, *columns: list[str], separator: str = ";") -> Write:
    return text(f"{head}{separator}u [V]{separator}x [mm]\n" + table(*columns, U, X, separator=separator))


def after(milliseconds: list[int], form: str) -> list[str]:
    instants = [START + timedelta(milliseconds=int(one)) for one in milliseconds]
    return [one.strftime(form).replace("@", f"{one.microsecond // 1000:03d}") for one in instants]


DOTS, CLOCK = "%d.%m.%Y", "%H:%M:%S"
LOGGERS = (
    Situation("date, time and ms", logged("Date;Time;ms", dates(DOTS), dates(CLOCK), MS), RIGHT),
    Situation("date, time and ms in German", logged("Datum;Uhrzeit;Millisekunden", dates(DOTS, MORNING), dates(CLOCK, MORNING), parts(MORNING)), RIGHT),
    Situation("date, time and ms over midnight", logged("Date;Time;ms", dates(DOTS, LATE), dates(CLOCK, LATE), parts(LATE)), RIGHT),
    Situation("time of day and us", logged("Time;Microseconds [us]", dates(CLOCK, MORNING), parts(MORNING, 6)), RIGHT),
    Situation("stamp and ms", logged("Timestamp;Millisec", dates("%Y-%m-%d %H:%M:%S", MORNING), parts(MORNING)), RIGHT),
    Situation("date, time to noon and ms", logged("Date;Time;ms", dates("%m/%d/%Y", MORNING), dates("%I:%M:%S %p", MORNING), parts(MORNING)), RIGHT),
    Situation("date of a spreadsheet, time and ms", logged("Date;Time;ms", dates("%Y-%m-%d 00:00:00", MORNING), dates(CLOCK, MORNING), parts(MORNING)), RIGHT),
    Situation("date and time with a day between them", logged("Date,Time", after(LATER, "%Y-%m-%d"), after(LATER, "%H:%M:%S.@"), separator=","), Right(remark="about 86400000 rows are missing")),
    Situation("ms since power-up beside a time of day", logged("Time;millis", dates(CLOCK, MORNING), MS), RIGHT, {"sample_rate_hz": 1000.0}),
    Situation("date, time and ms in a manifest", logged("Date;Time;ms", dates(DOTS, MORNING), dates(CLOCK, MORNING), parts(MORNING)), RIGHT, {"manifest": MANIFEST.replace("sample_rate_hz = 1000.0", 'time = "Date + Time + ms"').replace('"u"', '"u [V]"').replace('"x"', '"x [mm]"')}),
    Situation("a date whose month does not show", logged("Date;Time;ms", dates("%d/%m/%Y", SPRING), dates(CLOCK, SPRING), parts(SPRING)), refused("r.csv", '"Date + Time + ms" may have the day or the month first', '"03/04/2026', "write its dates as")),
    Situation("a row without its time of day", logged("Date;Time;ms", dates(DOTS, MORNING), [*dates(CLOCK, MORNING)[:-1], ""], parts(MORNING)), refused("r.csv", '"Date + Time + ms"', "no date or time of day in row 599"), {"time": "Date + Time + ms"}),
    Situation("a row without its time of day, nothing said", logged("Date;Time;ms", dates(DOTS, MORNING), [*dates(CLOCK, MORNING)[:-1], ""], parts(MORNING)), refused("r.csv", '"Date + Time + ms"', "no date or time of day in row 599", "remove the row")),
)  # fmt: skip


def message(head: str, *stamps: list[str], names: tuple[str, str] = ("u [V]", "x [mm]")) -> Write:
    return text(f"{head},{names[0]},{names[1]}\n" + table(*stamps, U, X))


def of_groups(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["joint/header/stamp/sec"] = np.array(STAMPS_NS) // 10**9
        file["joint/header/stamp/nanosec"] = np.array(STAMPS_NS) % 10**9
        for name, values, unit in (("u", U, "V"), ("x", X, "mm")):
            file[f"joint/{name}"] = values
            file[f"joint/{name}"].attrs["unit"] = unit


def of_parquet(path: Path) -> None:
    stamps = {"stamp.sec": np.array(STAMPS_NS) // 10**9, "stamp.nanosec": np.array(STAMPS_NS) % 10**9}
    pd.DataFrame(stamps | {"u [V]": U, "x [mm]": X}).to_parquet(path)


def received(delay_ns: int, jitter_ns: int) -> list[str]:
    rng = np.random.default_rng(1)
    return [str(one + delay_ns + int(rng.integers(0, jitter_ns))) for one in STAMPS_NS]


FIELDS = ("field.u", "field.x")
MESSAGES = (
    Situation("ROS, secs and nsecs", message("header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id", MS, SECS, NSECS, ["base"] * ROWS), RIGHT),
    Situation("ROS 2, sec and nanosec", message("header.stamp.sec,header.stamp.nanosec", SECS, NSECS), RIGHT),
    Situation("ROS, tv_sec and tv_usec", message("tv_sec,tv_usec", SECS, [one[:-3] or "0" for one in NSECS]), RIGHT),
    Situation("ROS 2 in HDF5", made("r.h5", of_groups), Right(remark="there is no other")),
    Situation("ROS 2 in Parquet", made("r.parquet", of_parquet), RIGHT),
    Situation("ROS, a time of receipt and a stamp of ns", message("%time,field.header.stamp", received(200_000, 1), [str(one) for one in STAMPS_NS], names=FIELDS), Right(remark='s earlier than "time"'), NAMES),
    Situation("ROS, a time of receipt that jitters", message("%time,field.header.stamp", received(0, 900_000), [str(one) for one in STAMPS_NS], names=FIELDS), Right(remark='"time" is'), NAMES),
    Situation("ROS, two messages of different stamps", message("a.stamp.sec,a.stamp.nanosec,b.stamp.sec,b.stamp.nanosec", SECS, NSECS, SECS, [f"{int(one) // 2}" for one in NSECS]), refused("r.csv", '"a.stamp.sec + a.stamp.nanosec", "b.stamp.sec + b.stamp.nanosec"', "do not go on together", "--time")),
    Situation("two counts of one time", text("t_sec,t_ms,u [V],x [mm]\n" + table(1e3 * T, [f"{1e6 * one:.0f}" for one in T], U, X)), Right(rate_hz=1.0)),
)  # fmt: skip


def clock(start: datetime, *parts: str) -> list[list[str]]:
    """Numbers of the parts of a clock; seconds with their fraction where no thousandths follow."""
    instants = [start + timedelta(milliseconds=int(k)) for k in K]
    numbers = {part: [str(getattr(one, part)) for one in instants] for part in parts if part != "ms"}
    thousandths = [one.microsecond // 1000 for one in instants]
    if "ms" in parts:
        return [*numbers.values(), [str(one) for one in thousandths]]
    whole = [f"{one.second}.{part:03d}" for one, part in zip(instants, thousandths, strict=True)]
    return [*numbers.values(), whole]


YEAR_END = datetime(2026, 12, 31, 23, 59, 59, 700_000)
NUMBERS = (
    Situation("hours, minutes, seconds and ms", logged("Hour;Min;Sec;ms", *clock(MORNING, "hour", "minute", "second", "ms")), RIGHT),
    Situation("hours, minutes, seconds and ms over midnight", logged("Hour;Min;Sec;ms", *clock(LATE, "hour", "minute", "second", "ms")), RIGHT),
    Situation("year to seconds over the end of a year", logged("Year,Month,Day,Hour,Minute,Second", *clock(YEAR_END, "year", "month", "day", "hour", "minute"), separator=","), RIGHT),
    Situation("hours, minutes and whole seconds", logged("Hour;Min;Sec", *clock(MORNING, "hour", "minute", "second", "ms")[:3]), refused("r.csv", '"Hour + Min + Sec" stays the same after row 0', "more digits")),
    Situation("minutes that are none", logged("h;min;s", *clock(MORNING, "hour"), [f"{10 * k}" for k in K]), refused("r.csv", "sample rate is not known")),
)  # fmt: skip
SITUATIONS = (*LOGGERS, *MESSAGES, *NUMBERS)
