"""Numbers: overflow codes, scales, counts, gaps, constants, outliers, and roles that contradict."""

from __future__ import annotations

import numpy as np
from corpus_case import MANIFEST, RIGHT, ROWS, A, Right, Situation, T, U, V, X, refused, table, text

HEAD = "t [s],u [V],x [mm]\n"
K = np.arange(ROWS)
COUNTS = np.rint(X / X.std() * 1000.0) + 2048.0
COUNTED = MANIFEST.replace(
    'column = "x"', f'column = "x"\nscale = {float(X.std()) / 1000.0!r}\noffset = {-2.048 * float(X.std())!r}'
)


def rows(u: np.ndarray = U, x: np.ndarray = X, t: np.ndarray = T, head: str = HEAD, form: str = "{:.9g}"):
    return text(head + table(t, u, x, form=form))


def at(values: np.ndarray, row: int, value: float) -> np.ndarray:
    changed = values.copy()
    changed[row] = value
    return changed


def said(manifest: str, change: str = "", to: str = "") -> dict[str, str]:
    assert change in manifest
    return {"manifest": manifest.replace(change, to) if change else manifest}


SITUATIONS = (
    Situation("a reading that overflowed (SCPI)", rows(x=at(X, 100, 9.9e37)), refused("r.csv", "x [mm]", "9.9e+37", "row 100", "rows =")),
    Situation("a reading that overflowed below", rows(x=at(X, 100, -9.9e37)), refused("r.csv", "x [mm]", "row 100")),
    Situation("no number (SCPI)", rows(u=at(U, 100, 9.91e37)), refused("r.csv", "u [V]", "row 100")),
    Situation("a largest double", rows(x=at(X, 100, 1.7e308)), refused("r.csv", "x [mm]", "row 100")),
    Situation("scales of 1e200", rows(x=1e200 * X), refused("r.csv", "x [mm]")),
    Situation("scales of 1e-200", rows(x=1e-200 * X), refused("r.csv", "x [mm]", "no instrument")),
    Situation("denormal numbers", rows(x=1e-310 * X), refused("r.csv", "x [mm]")),
    Situation("a constant output", rows(x=0.0 * X + 2.5), refused("r.csv", "x [mm]", "constant, 2.5")),
    Situation("a zero record", rows(u=0.0 * U, x=0.0 * X), refused("r.csv", "constant, 0")),
    Situation("a constant drive", rows(u=0.0 * U + 1.0), refused("r.csv", "u [V]", "constant, 1", "drive")),
    Situation("one row", text(HEAD + "0.0,1.0,2.0\n"), refused("r.csv", "two columns of numbers")),
    Situation("no row", text(HEAD), refused("r.csv", "two columns of numbers")),
    Situation("an empty file", text(""), refused("r.csv", "empty")),
    Situation("blank lines alone", text("\n\n\n"), refused("r.csv")),
    Situation("half of the rows are missing", rows(x=np.where(K % 2 == 0, X, np.nan)), refused("r.csv", "no two rows", "x [mm]", "correct")),
    Situation("a sensor that falls out in the middle", rows(x=np.where((K > 200) & (K < 260), np.nan, X)), Right(remark="59 rows left out", fewest=541)),
    Situation("a sensor that falls out twice", rows(x=np.where(np.isin(K, [*range(150, 190), *range(390, 430)]), np.nan, X)), Right(remark="3 parts, rows [0, 150], [190, 390], [430, 600], 80 rows left out", fewest=520)),
    Situation("a single row without a number", rows(x=np.where(K == 300, np.nan, X)), Right(remark="write the line between the neighbours into these cells", fewest=599)),
    Situation("single rows without numbers, many parts", rows(x=np.where(K % 10 == 5, np.nan, X)), refused("r.csv", "60 rows without numbers, first row 5", "write the line between the neighbours", "rows = [6, 15]")),
    Situation("single rows without numbers, short parts", rows(x=np.where(K % 40 == 20, np.nan, X)), refused("r.csv", "16 parts", "15 rows without numbers, first row 20", "write the line between the neighbours", "rows = [21, 60]")),
    Situation("rows that are lost with their times", rows(*(np.where((K > 249) & (K < 300), np.nan, one) for one in (U, X, T))), refused("r.csv", "no number in 50 rows, first row 250", "remove these rows")),
    Situation("a sensor that starts later", rows(x=np.where(K < 50, np.nan, X)), Right(remark="50 rows left out", fewest=550)),
    Situation("counts without a scale", rows(x=COUNTS, head="t [s],u [V],x [ADU]\n"), refused("r.csv", "x [ADU]", "unit", "--output")),
    Situation("counts with a scale in the manifest", rows(x=COUNTS, head="t,u,x\n"), Right(within=2e-3), said(COUNTED)),
    Situation("counts with a scale of zero", rows(x=COUNTS, head="t,u,x\n"), refused("dataset.toml", "signals.displacement.scale", "nothing"), said(MANIFEST, 'column = "x"', 'column = "x"\nscale = 0.0') | {"file": "manifest"}),
    Situation("a manifest in mm of a file in um", rows(x=1e3 * X, head="t,u [V],x [um]\n"), refused("r.csv", '"um"', '"mm"', "correct one"), said(MANIFEST.replace('"u"', '"u [V]"').replace('"x"', '"x [um]"'))),
    Situation("a manifest in um of a file in um", rows(x=1e3 * X, head="t,u [V],x [um]\n"), RIGHT, said(MANIFEST.replace('"u"', '"u [V]"').replace('"x"', '"x [um]"').replace('"mm"', '"um"'))),
    Situation("a manifest at another rate than the time", rows(head="t,u,x\n"), RIGHT, said(MANIFEST, "sample_rate_hz = 1000.0", 'time = "t"')),
    Situation("a manifest with a misspelt column", rows(head="t,u,x\n"), refused("r.csv", '"xx"', "did you mean"), said(MANIFEST, '"x"', '"xx"')),
    Situation("a manifest with the time as displacement", rows(head="t,u,x\n"), refused("r.csv", "t", "exclude"), said(MANIFEST, 'column = "x"', 'column = "t"') | {"skip": ""}),
    Situation("a manifest with rows beyond the file", rows(head="t,u,x\n"), refused("r.csv", "600 rows", "[0, 700]"), said(MANIFEST, "sample_rate_hz", "rows = [0, 700]\nsample_rate_hz")),
    Situation("a manifest whose unit hangs", rows(head="t,u,x\n"), refused("signals.displacement.unit", "cannot be read"), said(MANIFEST, '"mm"', '"9**9**9 mm"') | {"file": "manifest"}),
    Situation("a manifest in dB", rows(head="t,u,x\n"), refused("signals.displacement.unit", "dB to V"), said(MANIFEST, '"mm"', '"dB"') | {"file": "manifest"}),
    Situation("a manifest in degC", rows(head="t,u,x\n"), refused("signals.displacement.unit", "degC to K"), said(MANIFEST, '"mm"', '"degC"') | {"file": "manifest"}),
    Situation("a manifest in grams", rows(head="t,u,x\n"), refused("signals.displacement.unit", "standard gravity"), said(MANIFEST, '"mm"', '"g"') | {"file": "manifest"}),
    Situation("a manifest with NaN as rate", rows(head="t,u,x\n"), refused("sample_rate_hz", "above 0"), said(MANIFEST, "1000.0", "nan") | {"file": "manifest"}),
    Situation("an acceleration in g", text("t [s],u [V],acc [g]\n" + table(T, U, A / 9806.65, form="{:.9g}")), Right(units={"drive": "V", "acceleration": "mm/s^2"}, remark="9.80665")),
    Situation("an acceleration alone", text("t [s],u [V],a [m/s^2]\n" + table(T, U, 1e-3 * A, form="{:.9g}")), Right(units={"drive": "V", "acceleration": "mm/s^2"})),
    Situation("a velocity alone", text("t [s],u [V],v [mm/s]\n" + table(T, U, V, form="{:.9g}")), Right(units={"drive": "V", "velocity": "mm/s"})),
    Situation("displacement and velocity", text("t [s],u [V],x [mm],v [m/s]\n" + table(T, U, X, 1e-3 * V, form="{:.9g}")), RIGHT),
    Situation("a temperature beside", text("t [s],u [V],x [mm],T [degC]\n" + table(T, U, X, 20.0 + 0.01 * T)), RIGHT),
    Situation("a trigger channel beside", text("t [s],u [V],x [mm],trigger\n" + table(T, U, X, (K > 100).astype(float))), RIGHT),
    Situation("text beside", text("t [s],u [V],x [mm],note\n" + table(T, U, X, ["ok"] * ROWS)), RIGHT),
    Situation("two drives", text("t [s],force [N],voltage [V],x [mm]\n" + table(T, V, U, X)), refused("r.csv", "several columns may be the drive", "--input")),
    Situation("two displacements", text("t [s],u [V],x1 [mm],x2 [mm]\n" + table(T, U, X, X)), refused("r.csv", "x1 [mm]", "--output")),
    Situation("the drive repeated as the response", text("t [s],u [V],x [mm]\n" + table(T, U, U)), RIGHT, {"skip": ""}),
    Situation("a spectrum", text("f [Hz],H [mm/V]\n" + table(K.astype(float), X)), refused("r.csv", "spectrum", "time signals")),
    Situation("a column with its own scale in words", text("t [s],u [V] x10,x [mm]\n" + table(T, U / 10.0, X)), refused("r.csv", "u [V] x10", "--input")),
)  # fmt: skip
SITUATIONS = tuple(one for one in SITUATIONS if "skip" not in one.said)
