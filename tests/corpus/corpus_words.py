"""Words of text files that programs and people write in their own way: names with separators, dates, signs."""

from __future__ import annotations

import numpy as np
from corpus_case import RIGHT, ROWS, Situation, T, U, X, refused, table, text

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
SITUATIONS = NAMES
