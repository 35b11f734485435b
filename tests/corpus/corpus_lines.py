"""Lines of text files besides the rows of numbers: below them, among them, and above them where they name columns."""

from __future__ import annotations

import numpy as np
from corpus_case import RIGHT, ROWS, Right, Situation, T, U, X, refused, table, text
from corpus_text import LVM

HEAD = "t [s],u [V],x [mm]\n"
BODY = table(T, U, X)
PLAIN = HEAD + BODY
ALIGNED = table(T, U, X, separator="   ", form="{:14.9f}")
FIRST, SECOND = (table(T[rows], U[rows], X[rows]) for rows in (slice(300), slice(300, None)))
NAMES_AGAIN = ("r.csv", "names comes again in row 300", "Divide the file")
ONE_COMMENT = Right(remark="1 comment below the numbers left out")


def fortran(form: str = "{:.8E}", letter: str = "D") -> str:
    return HEAD + table(T, U, X, form=form).replace("E", letter)


BELOW = (
    Situation("comments at the end, with the mark of the preamble", text("! run 5\n" + PLAIN + "! end\n! of data\n"), Right(remark='2 comments below the numbers left out, "! end" first')),
    Situation("a comment at the end with as many cells as a row", text(PLAIN + "# mean,0.1,0.2\n"), ONE_COMMENT),
    Situation("a comment at the end without line end", text(PLAIN + "# end"), ONE_COMMENT),
    Situation("a comment at the end between blanks", text("# t_s u_V x_mm\n" + ALIGNED + "# data end\n", "r.dat"), ONE_COMMENT),
    Situation("a comment and empty rows at the end", text(PLAIN + "\n# end\n,,\n\n"), Right(remark="1 empty row at the end left out; 1 comment below")),
    Situation("a comment of an unknown mark at the end", text(PLAIN + "// end\n"), refused("r.csv", "line 602", "// end", "write # in front")),
    Situation("a word at the end", text(PLAIN + "End,,\n"), refused("r.csv", "line 602", "End,,", "remove it")),
    Situation("a word alone at the end", text(PLAIN + "\nEND\n"), refused("r.csv", "line 603", "END", "remove it")),
    Situation("a mark of words in the last rows of a column in front", text("dir," + HEAD + table(["0"] * (ROWS - 9) + ["up"] * 9, T, U, X)), RIGHT),
    Situation("a count in hexadecimal numbers in front", text("n," + HEAD + table([f"{k:X}" for k in range(0xA11 - ROWS, 0xA11)], T, U, X)), RIGHT),
    Situation("statistics below dates", text("date,u [V],x [mm]\n" + table([f"2026-01-02 10:00:00.{k:03d}" for k in range(ROWS)], U, X) + "Mean,0.1,0.2\n"), refused("r.csv", "line 602", "Mean,0.1,0.2", "remove it")),
    Situation("statistics in two rows at the end", text(PLAIN + "Mean,0.1,0.2\nStd,0.1,0.2\n"), refused("r.csv", "line 602", "Mean,0.1,0.2", "remove it and what follows", "# in front of each")),
    Situation("a count with a word at the end", text(PLAIN + "600 rows\n"), refused("r.csv", "line 602 has 1 cells", "600 rows", "remove")),
    Situation("rows that have labels with the mark of a comment", text("n," + HEAD + table([f"#{k}" for k in range(ROWS)], T, U, X)), RIGHT),
    Situation("a spreadsheet's error in the last row", text("x [mm],t [s],u [V]\n" + table(X, T, U) + "#N/A,0.6,0.2\n"), Right(rows=ROWS + 1, remark="row 600")),
)  # fmt: skip

AMONG = (
    Situation("a comment among the rows", text(HEAD + FIRST + "# paused\n" + SECOND), refused("r.csv", "line 302", "# paused", "divide the file")),
    Situation("a comment among the rows with as many cells", text(HEAD + FIRST + "# paused, here, now\n" + SECOND), refused("r.csv", "comment in row 300", "divide the file")),
    Situation("the header again, and the time goes on", text(HEAD + FIRST + HEAD + SECOND), refused(*NAMES_AGAIN)),
    Situation("the header again in another order", text(HEAD + FIRST + "t [s],x [mm],u [V]\n" + table(T[300:], X[300:], U[300:])), refused(*NAMES_AGAIN)),
    Situation("the header and the units again", text("t,u,x\ns,V,mm\n" + FIRST + "t,u,x\ns,V,mm\n" + SECOND), refused(*NAMES_AGAIN)),
    Situation("a column of words that are names of columns", text(HEAD.replace("\n", ",note\n") + table(T, U, X, ["u [V]"] * ROWS)), RIGHT),
)  # fmt: skip

NUMBERS = (
    Situation("numbers of Fortran", text(fortran()), RIGHT),
    Situation("numbers of Fortran in small letters, between blanks", text("t_s u_V x_mm\n" + table(T, U, X, form="{:.8e}", separator=" ").replace("e", "d"), "r.dat"), RIGHT),
    Situation("an exponent of Fortran without its letter", text(fortran().replace("0.00000000D+00", "1.00000000-104", 1)), RIGHT),
    Situation("exponents of two digits without a letter", text(fortran(letter="")), refused("r.csv", "t [s]", "0.00000000+00", "export it as numbers")),
)  # fmt: skip

IN_UM = table(T, U, 1e3 * X, form="{:.9g}")
UM_BLANKS = IN_UM.replace(",", "   ")
LETTERS = {"inputs": "u", "outputs": {"displacement": "x"}}
NAMES = (
    Situation("a comment with a label and units in words", text("# columns: t in s; u in V; x in um\n" + IN_UM), RIGHT, {"inputs": "u in V", "outputs": {"displacement": "x in um"}}),
    Situation("a comment with a label above another comment", text("# columns: t in s; u in V; x in um\n# operator: JD\n" + IN_UM), RIGHT),
    Situation("a comment with the numbers of columns", text("# col 1: time [s], col 2: drive [V], col 3: x [um]\n" + IN_UM), RIGHT, {"inputs": "drive [V]"}),
    Situation("a comment for each column", text("# column 1: time [s]\n# column 2: drive [V]\n# column 3: x [um]\n" + UM_BLANKS, "r.dat"), RIGHT),
    Situation("a comment for each column, from 0", text("# 0: time [s]\n# 1: drive [V]\n# 2: x [um]\n" + IN_UM), RIGHT),
    Situation("a comment for two of three columns", text("# 1: time [s]\n# 2: drive [V]\n" + IN_UM), refused("r.csv", "column_3", "--output")),
    Situation("names and units in comments with labels", text("# columns = t, u, x\n# units = s, V, um\n" + IN_UM), RIGHT, LETTERS),
    Situation("names and units in comments without labels", text("# t, u, x\n# s, V, um\n" + IN_UM), RIGHT, LETTERS),
    Situation("a line with a label and no mark", text("Columns: t in s; u in V; x in um\n" + IN_UM), RIGHT),
    Situation("names between bars in a comment", text("# t [s] | u [V] | x [um]\n" + IN_UM), RIGHT),
    Situation("a title, and names between blanks in a comment", text("shaker run\n# t_s u_V x_mm\n" + ALIGNED, "r.dat"), RIGHT),
    Situation("names between blanks behind another mark", text("! t_s u_V x_mm\n" + ALIGNED, "r.dat"), RIGHT),
    Situation("aligned names with a blank before their units", text("time [s]   u [V]    x [um]\n" + UM_BLANKS, "r.txt"), RIGHT, {"inputs": "u [V]"}),
    Situation("aligned names with a blank before a slash", text("time /s   u /V    x /um\n" + UM_BLANKS, "r.txt"), RIGHT),
    Situation("aligned names of several words", text("time (s)  drive volt (V)  tip disp (um)\n" + UM_BLANKS, "r.txt"), RIGHT, {"outputs": {"displacement": "tip disp (um)"}}),
    Situation("aligned names, one of them without unit", text("time [s]   u    x [um]\n" + UM_BLANKS, "r.txt"), refused("r.txt", 'column "u"', "--input u:UNIT")),
    Situation("names in a comment, and a note below them", text("# columns: t [s], u [V], x [um]\n# note: a, b, c\n" + IN_UM), RIGHT),
    Situation("channels with a label above names with units", text("# Channels: A0, A1, A2\n# t [s], u [V], x [um]\n" + IN_UM), RIGHT),
    Situation("units above names, both in comments", text("# s, V, um\n# t, u, x\n" + IN_UM), RIGHT, LETTERS),
    Situation("comments for each column in another order", text("# 2: u [V]\n# 1: t [s]\n# 3: x [um]\n" + IN_UM), RIGHT),
    Situation("names, and a comment below them with as many cells", text(HEAD + "# first, of, rows\n" + BODY), RIGHT),
    Situation("names, and a comment below them", text(HEAD + "# first\n" + BODY), refused("r.csv", "line 2", "# first", "remove it")),
    Situation("a line drawn below the names", text("t_s u_V x_mm\n# --- ---- ----\n" + ALIGNED, "r.dat"), RIGHT),
    Situation("numbered notes above names in a comment", text("# 1: sample mounted\n# 2: shaker warm\n# 3: done\n# t [s], u [V], x [um]\n" + IN_UM), RIGHT),
    Situation("a list of channels above names without units", text("# CH1: force [N]\n# CH2: tip [mm]\n# CH3: air [degC]\n# t_s, u_V, x_um\n" + IN_UM), RIGHT),
    Situation("a list of channels with a label above names without units", text("# Channels: A0, A1, A2\n# t_s, u_V, x_um\n" + IN_UM), RIGHT),
    Situation("numbered notes above numbers without names", text("# 1: sample was mounted\n# 2: shaker was warm\n# 3: all done\n" + IN_UM), RIGHT, {"inputs": "column_2:V", "outputs": {"displacement": "column_3:um"}, "time": "column_1:s"}),
    Situation("a comment for each column, and a note below them", text("# column 1: t [s]\n# column 2: u [V]\n# column 3: x [um]\n# on monday, by me, ok\n" + IN_UM), RIGHT),
    Situation("units in a comment, and no names", text("# units: s, V, um\n" + IN_UM), RIGHT, {"inputs": "column_2", "outputs": {"displacement": "column_3"}, "time": "column_1"}),
    Situation("names and units in comments above an empty one", text("# t, u, x\n# s, V, um\n#\n" + IN_UM), RIGHT, LETTERS),
    Situation("units below names, and a comment below them", text("t,u,x\ns,V,um\n# first, of, rows\n" + IN_UM), RIGHT, LETTERS),
    Situation("names between commas above numbers between blanks", text("t [s], u [V], x [um]\n" + UM_BLANKS, "r.txt"), RIGHT, {"inputs": "u [V]"}),
    Situation("names in quotes between blanks", text('"t [s]" "u [V]" "x [um]"\n' + UM_BLANKS, "r.txt"), RIGHT, {"inputs": "u [V]"}),
    Situation("a line drawn below names and units", text("t   u   x\ns   V   um\n------------\n" + UM_BLANKS, "r.txt"), RIGHT, LETTERS),
    Situation("a line drawn below names between commas", text("t [s],u [V],x [um]\n==================\n" + IN_UM), RIGHT),
    Situation("one word that is no unit below names", text("u,x\ndigits,digits\n" + table(U, X)), Right(remark='the file states "digits", which is no known unit'), {"inputs": "u:V", "outputs": {"displacement": "x:mm"}, "sample_rate_hz": 1000.0}),
    Situation("one word below units", text("t,u,x\ns,V,um\nrun1,run1,run1\n" + IN_UM), RIGHT, LETTERS),
    Situation("fewer names than columns between blanks", text("t_s u_V\n" + ALIGNED, "r.dat"), refused("r.dat", '"t_s u_V"', "3 columns", "write a name for each")),
    Situation("half as many names as columns, whose units are apart", text("t [s] u [V]\n" + table(T, U, X, X, separator=" "), "r.dat"), refused("r.dat", '"t [s] u [V]"', "4 columns", "write a name for each")),
    Situation("a name that is a unit alone", text('"in s","C1 in V","C2 in mm"\n' + BODY), RIGHT, {"inputs": "C1 in V", "outputs": {"displacement": "C2 in mm"}}),
    Situation("a name that is a unit alone, in ms", text("in ms,u in V,x in mm\n" + table(1e3 * T, U, X)), RIGHT),
)  # fmt: skip

TEKTRONIX = "Model,MSO54\nHorizontal Units,s\nSample Interval,0.001\nGating,0.0% to 100.0%\nProbe Attenuation,10,1\nVertical Offset,0,0\nLabel,u,x\nTIME,CH1,CH2\n"
NOTES = [
    "Record Length,600",
    "Sample Interval,1e-3",
    "Trigger Point,300",
    ",",
    "Source,CH1",
    "Vertical Scale,1",
]
CHANNELS = {"inputs": "CH1:V", "outputs": {"displacement": "CH2:mm"}}
COLUMNS = {"inputs": "column_5:V", "outputs": {"displacement": "column_6:mm"}}
LATE = LVM.replace("X_Columns\tOne", "X_Columns\tNo").replace("X0\t0.0\t0.0", "X0\t0.0\t0.004")


def beside(*notes: str) -> str:
    """Notes beside the first rows, as old oscilloscopes write them."""
    rows = zip(T - 0.3, U, X, strict=True)
    return "".join(
        f"{notes[k] if k < len(notes) else ','},,{t:.6f},{u:.8f},{x:.8f}\n"
        for k, (t, u, x) in enumerate(rows)
    )


PROGRAMS = (
    Situation("Tektronix, keys with a number for each channel", text(TEKTRONIX + BODY), RIGHT, CHANNELS),
    Situation("Tektronix, old: notes beside two channels", text(beside(*NOTES)), RIGHT, COLUMNS | {"time": "column_4:s"}),
    Situation("Tektronix, old: the rate by the notes", text(beside(*NOTES)), Right(remark="Sample Interval,1e-3"), COLUMNS),
    Situation("Tektronix, old: a rate in the notes that is not the time's", text(beside("Sample Interval,2e-3")), refused("r.csv", "500 Hz", "Sample Interval,2e-3", "correct one"), COLUMNS | {"time": "column_4:s"}),
    Situation("catman: rates and numbers below the units", text("Zeit\tKraft\tWeg\ns\tV\tmm\n1000 Hz\t1000 Hz\t1000 Hz\nSN=1\tSN=2\tSN=3\n" + table(T, U, X, separator="\t", comma=True), "r.asc"), RIGHT),
    Situation("catman: a row of rates, and no time", text("Kraft\tWeg\nV\tmm\n1000 Hz\t1000 Hz\n" + table(U, X, separator="\t"), "r.asc"), Right(remark="1000 Hz by line 3")),
    Situation("catman: a row of rates that differ", text("Kraft\tWeg\nV\tmm\n1000 Hz\t500 Hz\n" + table(U, X, separator="\t"), "r.asc"), refused("r.asc", "line 3", "several rates", "--sample-rate")),
    Situation("catman: a row of rates that are not the time's", text("Zeit\tKraft\tWeg\ns\tV\tmm\n500 Hz\t500 Hz\t500 Hz\n" + table(T, U, X, separator="\t"), "r.asc"), refused("r.asc", "500 Hz", "1000 Hz", "correct one")),
    Situation("a row of rates in kHz", text("u,x\nV,mm\n1 kHz,1 kHz\n" + table(U, X)), Right(remark="1000 Hz by line 3")),
    Situation("names, units and types in rows", text("t;u;x\ns;V;mm\ndouble;float;float\n" + table(T, U, X, separator=";")), RIGHT),
    Situation("LabVIEW .lvm, channels that begin at different times", text(LATE + table([""] * (ROWS - 4), U[:-4], X[4:], separator="\t"), "r.lvm"), Right(remark="begin at different times (X0)", rows=592, fewest=592, lost=np.arange(4, ROWS - 4)), LETTERS | {"test": "none"}),
    Situation("LabVIEW .lvm, a comment column and units by channel", text(LATE.replace("0.004", "0.0").replace("V\tmm\t\n", "V\tum\t\n") + table([""] * ROWS, U, 1e3 * X, separator="\t", last="\t"), "r.lvm"), RIGHT, LETTERS),
    Situation("LabVIEW .lvm, half a sample apart", text(LATE.replace("0.004", "0.0045") + table([""] * ROWS, U, X, separator="\t"), "r.lvm"), refused("r.lvm", "X0", "resample"), LETTERS),
    Situation("LabVIEW .lvm, different times and one column of them", text(LATE.replace("X_Columns\tNo", "X_Columns\tOne") + table(T, U, X, separator="\t"), "r.lvm"), Right(remark="share one column of times"), LETTERS),
    Situation("LabVIEW .lvm, steps that differ", text(LATE.replace("Delta_X\t0.001\t0.001", "Delta_X\t0.001\t0.002") + table([""] * ROWS, U, X, separator="\t"), "r.lvm"), refused("r.lvm", "Delta_X", "several rates", "--sample-rate"), LETTERS),
    Situation("LabVIEW .lvm, a second segment", text(LVM + table(T, U, X, separator="\t") + "\n" + LVM[LVM.index("Channels") :] + table(T, U, X, separator="\t"), "r.lvm"), refused("r.lvm", "Channels 2", "divide the file"), LETTERS),
)  # fmt: skip

SITUATIONS = (*BELOW, *AMONG, *NUMBERS, *NAMES, *PROGRAMS)
