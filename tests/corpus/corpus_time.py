"""Time: units, epochs, dates, zones, rounding, gaps, resets and clocks that disagree."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
from corpus_case import RIGHT, ROWS, Right, Situation, T, U, X, refused, table, text

HEAD = "t [s],u [V],x [mm]\n"
K = np.arange(ROWS)
CET, CEST = timezone(timedelta(hours=1)), timezone(timedelta(hours=2))
START = datetime(2026, 11, 21, 10, 0, 0)
EPOCH_S = 1_795_255_200.0
T_MS = {"time": "t:ms"}
HALF = Right(fewest=ROWS - 1)


def stamped(
    stamps: list[str] | np.ndarray,
    head: str = "time,u [V],x [mm]\n",
    separator: str = ",",
    name: str = "r.csv",
):
    return text(head + table(stamps, U, X, separator=separator), name)


def dates(form: str, start: datetime = START, digits: int = 3) -> list[str]:
    stamps = [start + timedelta(milliseconds=int(k)) for k in K]
    return [
        one.strftime(form).replace("@", f"{one.microsecond // 10 ** (6 - digits):0{digits}d}")
        for one in stamps
    ]


def over_midnight() -> list[str]:
    return dates("%H:%M:%S.@", datetime(2026, 11, 21, 23, 59, 59, 700_000))


def across_autumn(zoned: bool) -> list[str]:
    """The night in which clocks are set back: 02:59:59 CEST, then 02:00:00 CET."""
    instants = [
        datetime(2026, 10, 25, 0, 59, 59, 700_000, tzinfo=UTC) + timedelta(milliseconds=int(k)) for k in K
    ]
    turn = datetime(2026, 10, 25, 1, 0, 0, tzinfo=UTC)
    local = [one.astimezone(CEST if one < turn else CET) for one in instants]
    return [one.isoformat(timespec="milliseconds")[: None if zoned else 23] for one in local]


def cut(stamps: np.ndarray, *rows: int) -> np.ndarray:
    return np.delete(stamps, rows)


def columns(t: np.ndarray, keep: np.ndarray | None = None, head: str = HEAD, form: str = "{:.9g}"):
    kept = K if keep is None else keep
    return text(head + table([form.format(one) for one in np.asarray(t)[kept]], U[kept], X[kept]))


LOST = np.delete(K, 300)
LOST_MANY = np.delete(K, np.arange(300, 340))
ONES = (
    Situation("milliseconds by name", columns(1e3 * T, head="t_ms,u [V],x [mm]\n"), RIGHT),
    Situation("milliseconds in brackets", columns(1e3 * T, head="t [ms],u [V],x [mm]\n"), RIGHT),
    Situation("microseconds", columns(1e6 * T, head="t (us),u [V],x [mm]\n"), RIGHT),
    Situation("minutes", columns(T / 60.0, head="t [min],u [V],x [mm]\n", form="{:.12g}"), RIGHT),
    Situation("milliseconds that nobody states", columns(1e3 * T, head="t,u [V],x [mm]\n"), refused("r.csv", "unit of the time", "--time")),
    Situation("milliseconds that the user states", columns(1e3 * T, head="t,u [V],x [mm]\n"), RIGHT, T_MS),
    Situation("the user's unit of time against the file's", columns(T), refused("r.csv", "t [s]", "time_unit", "correct one"), {"time": "t:ms"}),
    Situation("a time in volts", columns(T, head="time [V],u [V],x [mm]\n"), refused("r.csv"), {"time": "time"}),
    Situation("seconds since 1970", columns(EPOCH_S + T, head="time,u [V],x [mm]\n", form="{:.3f}"), Right(remark="1970")),
    Situation("milliseconds since 1970", columns(1e3 * EPOCH_S + 1e3 * T, head="time,u [V],x [mm]\n", form="{:.0f}"), Right(remark="1970")),
    Situation("microseconds since 1970", columns(1e6 * EPOCH_S + 1e6 * T, head="time,u [V],x [mm]\n", form="{:.0f}"), Right(remark="1970")),
    Situation("nanoseconds since 1970", stamped([f"{int(EPOCH_S)}{int(1e6 * k):09d}" for k in K]), Right(remark="1970")),
    Situation("seconds since 1904 (LabVIEW)", columns(EPOCH_S + 2_082_844_800 + T, head="time,u [V],x [mm]\n", form="{:.3f}"), Right(remark="1970")),
    Situation("days of a spreadsheet", columns(46_000.0 + T / 86_400.0, head="Time,u [V],x [mm]\n", form="{:.12f}"), refused("r.csv", "Time", "days", "--time")),
    Situation("days of MATLAB", columns(739_900.0 + T / 86_400.0, head="time,u [V],x [mm]\n", form="{:.11f}"), refused("r.csv", "time", "days", "--time")),
    Situation("ticks of 100 ns (Windows)", stamped([str(134_000_000_000_000_000 + 10_000 * int(k)) for k in K]), refused("r.csv", "time", "--time")),
    Situation("a counter of samples", columns(K.astype(float), head="n,u [V],x [mm]\n"), refused("r.csv", "rate", "--sample-rate")),
    Situation("a counter of samples, with the rate", columns(K.astype(float), head="n,u [V],x [mm]\n"), RIGHT, {"sample_rate_hz": 1000.0}),
    Situation("a counter of 16 bits that wraps", columns((65_300 + K) % 65_536, head="tick [ms],u [V],x [mm]\n"), refused("r.csv", "tick [ms]"), {"time": "tick:ms"}),
    Situation("a counter of 32 bits in microseconds that wraps", columns((4_294_700_000 + 1000 * K) % 2**32, head="t [us],u [V],x [mm]\n", form="{:.0f}"), refused("r.csv", "t [us]"), {"time": "t:us"}),
    Situation("time from a trigger in the middle", columns(T - 0.3), RIGHT),
    Situation("time that starts anywhere", columns(12_345.678 + T, form="{:.3f}"), RIGHT),
    Situation("time in three digits", columns(12_345.678 + T, form="{:.3g}"), refused("r.csv", "t [s]"), {"time": "t:s"}),
    Situation("time in single precision after an hour", columns((3600.0 + T).astype(np.float32).astype(float), form="{:.9g}"), RIGHT),
    Situation("time in single precision after a month", columns((2.6e6 + T).astype(np.float32).astype(float), form="{:.9g}"), refused("r.csv", "t [s]"), {"time": "t:s"}),
    Situation("rounded stamps at 2048 Hz", columns(np.round(K / 2048.0, 6), form="{:.6f}"), Right(rate_hz=2048.0)),
    Situation("rounded stamps, alternating 0.3 and 0.4 ms", columns(np.round(K / 3000.0, 4), form="{:.4f}"), Right(rate_hz=3000.0)),
    Situation("a sample lost", columns(T, LOST), Right(remark="resampled", fewest=0, lost=LOST, within=0.02)),
    Situation("a gap", columns(T, LOST_MANY), Right(remark="a gap in time", fewest=560, lost=LOST_MANY)),
    Situation("two samples of one time", columns(np.where(K == 300, T[299], T)), refused("r.csv", "does not increase", "row 299"), {"time": "t:s"}),
    Situation("each stamp twice", columns(T - T % 0.002), refused("r.csv", "does not increase"), {"time": "t:s"}),
    Situation("stamps in blocks of 10, as drivers deliver them", columns(np.floor(K / 10) * 0.01), refused("r.csv", "does not increase"), {"time": "t:s"}),
    Situation("a reset in the middle", columns(np.where(K < 300, T, T - 0.3)), refused("r.csv", "does not increase", "row 299"), {"time": "t:s"}),
    Situation("time backwards", columns(T[::-1].copy()), refused("r.csv", "does not increase"), {"time": "t:s"}),
    Situation("a jump back of a clock that is set", columns(np.where(K < 300, T, T - 0.05)), refused("r.csv", "does not increase"), {"time": "t:s"}),
    Situation("a time that is constant", columns(0.0 * T), refused("r.csv", "does not increase"), {"time": "t:s"}),
    Situation("no stamp in one row", columns(np.where(K == 300, np.nan, T)), refused("r.csv", "t [s]", "row"), {"time": "t:s"}),
    Situation("a stamp of 9.9e37", columns(np.where(K == 300, 9.9e37, T)), refused("r.csv", "t [s]"), {"time": "t:s"}),
    Situation("dates of ISO 8601", stamped(dates("%Y-%m-%dT%H:%M:%S.@")), RIGHT),
    Situation("dates with a blank", stamped(dates("%Y-%m-%d %H:%M:%S.@")), RIGHT),
    Situation("dates in UTC", stamped(dates("%Y-%m-%dT%H:%M:%S.@Z")), RIGHT),
    Situation("dates with a zone", stamped(dates("%Y-%m-%dT%H:%M:%S.@+02:00")), RIGHT),
    Situation("dates with a comma, German separators", stamped(dates("%Y-%m-%d %H:%M:%S,@"), "Zeit;u [V];x [mm]\n", ";"), RIGHT),
    Situation("German dates", stamped(dates("%d.%m.%Y %H:%M:%S,@"), "Zeit;u [V];x [mm]\n", ";"), RIGHT),
    Situation("German dates with a point", stamped(dates("%d.%m.%Y %H:%M:%S.@"), "Zeit;u [V];x [mm]\n", ";"), RIGHT),
    Situation("German dates with years of two digits", stamped(dates("%d.%m.%y %H:%M:%S.@", datetime(2026, 11, 21, 23, 59, 59, 700_000)), "Zeit;u [V];x [mm]\n", ";"), RIGHT),
    Situation("dates with slashes and years of two digits", stamped(dates("%m/%d/%y %H:%M:%S.@")), RIGHT),
    Situation("the same over midnight, whose year nobody knows", stamped(dates("%y/%m/%d %H:%M:%S.@", datetime(2026, 11, 21, 23, 59, 59, 700_000))), refused("r.csv", "time", "2026-"), {"time": "time"}),
    Situation("dates with slashes, year first", stamped(dates("%Y/%m/%d %H:%M:%S.@")), RIGHT),
    Situation("dates with slashes, which may be of two countries", stamped(dates("%m/%d/%Y %H:%M:%S.@", datetime(2026, 3, 4, 10))), RIGHT),
    Situation("American dates over midnight", stamped(dates("%m/%d/%Y %H:%M:%S.@", datetime(2026, 3, 4, 23, 59, 59, 700_000))), refused("r.csv", "time", "2026-"), {"time": "time"}),
    Situation("dates with AM and PM", stamped(dates("%m/%d/%Y %I:%M:%S.@ %p", datetime(2026, 11, 21, 13))), RIGHT),
    Situation("times of day with AM and PM, over noon", stamped(dates("%I:%M:%S.@ %p", datetime(2026, 11, 21, 11, 59, 59, 700_000))), RIGHT),
    Situation("a logger's dates with thousandths after a colon", stamped(dates("%m/%d/%Y %H:%M:%S:@")), RIGHT),
    Situation("a logger's dates with hours of one digit", stamped([one.replace(" 0", " ") for one in dates("%m/%d/%Y %H:%M:%S:@", datetime(2026, 10, 20, 9, 15, 2))]), RIGHT),
    Situation("a logger's dates over midnight, whose day shows the order", stamped(dates("%m/%d/%Y %H:%M:%S:@", datetime(2026, 10, 20, 23, 59, 59, 700_000))), RIGHT),
    Situation("European dates with slashes over midnight, whose day shows the order", stamped(dates("%d/%m/%Y %H:%M:%S.@", datetime(2026, 10, 20, 23, 59, 59, 700_000))), RIGHT),
    Situation("times of day with thousandths after a colon", stamped(dates("%H:%M:%S:@")), RIGHT),
    Situation("a rate that the time column contradicts", columns(T), refused("r.csv", "--sample-rate 500", '"t [s]"', "1000 Hz", "--time -"), {"sample_rate_hz": 500.0}),
    Situation("a rate that contradicts the time column, which the user passes over", columns(2.0 * T), RIGHT, {"sample_rate_hz": 1000.0, "time": "-"}),
    Situation("a rate that a time column without unit agrees with in ms", columns(1e3 * T, head="time,u [V],x [mm]\n"), RIGHT, {"sample_rate_hz": 1000.0}),
    Situation("a rate that a time column without unit contradicts", columns(0.7 * T, head="time,u [V],x [mm]\n"), refused("r.csv", "read in seconds", "1428"), {"sample_rate_hz": 1000.0}),
    Situation("a rate beside a count of rows", columns(K, head="t,u [V],x [mm]\n"), RIGHT, {"sample_rate_hz": 1000.0}),
    Situation("a rate beside stamps that are rounded to ms", columns(np.round(T * 1.0004, 3)), Right(rate_hz=1000.0), {"sample_rate_hz": 1000.0}),
    Situation("a rate that dates contradict", stamped(dates("%Y-%m-%dT%H:%M:%S.@")), refused("r.csv", '"time"', "1000 Hz"), {"sample_rate_hz": 100.0}),
    Situation("dates to the second at 1 kHz", stamped(dates("%Y-%m-%dT%H:%M:%S")), refused("r.csv", "does not increase"), {"time": "time"}),
    Situation("times of day", stamped(dates("%H:%M:%S.@")), RIGHT),
    Situation("times of day over midnight", stamped(over_midnight()), RIGHT),
    Situation("times of day with a comma", stamped(dates("%H:%M:%S,@"), "Zeit;u [V];x [mm]\n", ";"), RIGHT),
    Situation("date and time of day in two columns", text("Date,Time,u [V],x [mm]\n" + table(dates("%Y-%m-%d"), dates("%H:%M:%S.@"), U, X)), RIGHT),
    Situation("the night of the clock change, with zones", stamped(across_autumn(zoned=True)), RIGHT),
    Situation("the night of the clock change, without zones", stamped(across_autumn(zoned=False)), refused("r.csv", "does not increase"), {"time": "time"}),
    Situation("the night of the clock change, without zones, nothing said", stamped(across_autumn(zoned=False)), refused("r.csv", '"time" goes back by 3600 s after row', "daylight-saving", "write the times in UTC", "--sample-rate")),
    Situation("the night of the clock change, without zones, and a rate", stamped(across_autumn(zoned=False)), RIGHT, {"sample_rate_hz": 1000.0}),
    Situation("an exposure time, which is no time of the rows", text("u [V],x [mm],exposure time [s]\n" + table(U, X, np.full(ROWS, 0.03))), refused("r.csv", "no column looks like a time", "constant, 0.03")),
    Situation("a time that goes back, nothing said", columns(np.concatenate([T[:300], T[:300]])), refused("r.csv", '"t [s]" goes back by 0.299 s after row 299', "divide the file", "--time -")),
    Situation("a time that is too coarse, nothing said", columns(np.floor(20.0 * T) / 20.0), refused("r.csv", '"t [s]" stays the same after row 0', "more digits")),
    Situation("a time without a number in one row", text(HEAD + table(T, U, X).replace("\n0.3,", "\n,")), refused("r.csv", '"t [s]" has no number in row 300', "remove the row")),
    Situation("a time with a word in one row", text(HEAD + table(T, U, X).replace("\n0.3,", "\nlate,")), refused("r.csv", '"t [s]" holds text', '"late", in row 300', "must be removed")),
    Situation("a date that is none", stamped([*dates("%Y-%m-%dT%H:%M:%S.@")[:-1], "2026-02-30T10:00:00.000"]), refused("r.csv", "time", "2026-"), {"time": "time"}),
    Situation("microseconds in dates", stamped([f"2026-11-21T10:00:00.{k * 1000:06d}" for k in K]), RIGHT),
    Situation("nanoseconds in dates", stamped([f"2026-11-21T10:00:00.{k * 1_000_000:09d}" for k in K]), RIGHT),
)  # fmt: skip
SITUATIONS = ONES
