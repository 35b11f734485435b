"""Text files: spreadsheets, loggers and oscilloscopes."""

from __future__ import annotations

import numpy as np
from corpus_case import RIGHT, ROWS, A, Right, Situation, T, U, Write, X, refused, table, text

HEAD = "t [s],u [V],x [mm]\n"
BODY = table(T, U, X)
PLAIN = HEAD + BODY
GERMAN = "Zeit [s];Kraft [V];Weg [mm]\n"
K = np.arange(ROWS)
VOLTS = {"inputs": "CH1", "outputs": {"displacement": "CH2"}}
IN_V = Right(units={"drive": "V", "displacement": "V"})
SAID = {"inputs": "u:V", "outputs": {"displacement": "x:mm"}, "time": "t:s"}


def with_cell(row: int, cell: str, *, column: int = 2, separator: str = ",") -> str:
    lines = PLAIN.splitlines(keepends=True)
    cells = lines[row + 1].rstrip("\n").split(",")
    cells[column] = cell
    lines[row + 1] = ",".join(cells) + "\n"
    return "".join(lines)


SPREADSHEETS = (
    Situation("plain", text(PLAIN), RIGHT),
    Situation("a row with too few cells", text("\n".join(one if k != 301 else one.rpartition(",")[0] for k, one in enumerate(PLAIN.split("\n")))), refused("r.csv", "line 302 has 2 cells", "3 columns")),
    Situation("a row with too many cells, below lines of blanks", text("\n".join(one if k != 301 else one + ",7" for k, one in enumerate(PLAIN.split("\n"))).replace("\n", "\n  \n", 9)), refused("r.csv", "line 311 has 4 cells", "3 columns")),
    Situation("a row with too many cells, old Macintosh line ends", text("\r".join(one if k != 301 else one + ",7" for k, one in enumerate(PLAIN.split("\n")))), refused("r.csv", "a row has 4 cells", "3 columns")),
    Situation("German: semicolons, decimal commas", text(GERMAN + table(T, U, X, separator=";", comma=True)), RIGHT),
    Situation("German with exponents", text(GERMAN + table(T, U, X, separator=";", comma=True, form="{:.6E}")), RIGHT),
    Situation("decimal commas between tabs", text(GERMAN.replace(";", "\t") + table(T, U, X, separator="\t", comma=True)), RIGHT),
    Situation("decimal commas, every cell quoted", text(HEAD + table(T, U, X, comma=True, quoted=True)), RIGHT),
    Situation("every cell quoted", text('"t [s]","u [V]","x [mm]"\n' + table(T, U, X, quoted=True)), RIGHT),
    Situation("whole numbers in the first rows", text(GERMAN + "0;0;0\n" + table(T[1:], U[1:], X[1:], separator=";", comma=True)), Right(within=2e-3)),
    Situation("tabs", text(PLAIN.replace(",", "\t"), "r.txt"), RIGHT),
    Situation("blanks, aligned", text("# t_s u_V x_mm\n" + table(T, U, X, separator="   ", form="{:12.6f}"), "r.dat"), RIGHT),
    Situation("Windows line ends", text(PLAIN.replace("\n", "\r\n")), RIGHT),
    Situation("old Macintosh line ends", text(PLAIN.replace("\n", "\r")), RIGHT),
    Situation("blank lines between", text(PLAIN.replace("\n", "\n\n")), RIGHT),
    Situation("UTF-8 with mark", text(PLAIN, before=b"\xef\xbb\xbf"), RIGHT),
    Situation("UTF-16 with mark", text(PLAIN, encoding="utf-16"), RIGHT),
    Situation("UTF-16 big-endian without mark", text(PLAIN, encoding="utf-16-be"), RIGHT),
    Situation("UTF-32", text(PLAIN, encoding="utf-32"), RIGHT),
    Situation("gzip", text(PLAIN, "r.csv.gz"), RIGHT),
    Situation("gzip under the name of plain text", text(PLAIN, "r.csv.gz"), RIGHT, {"renamed": "r.csv"}),
    Situation("Latin-1 micro sign", text(GERMAN.replace("mm", "µm") + table(T, U, 1e3 * X, separator=";", comma=True), encoding="latin-1"), RIGHT),
    Situation("micro sign of Windows 1252 in a units row", text("t;u;x\ns;V;µm\n" + table(T, U, 1e3 * X, separator=";"), encoding="cp1252"), RIGHT),
    Situation("Greek mu", text(HEAD.replace("mm", "μm") + table(T, U, 1e3 * X)), RIGHT),
    Situation("sep=", text("sep=;\n" + GERMAN + table(T, U, X, separator=";", comma=True)), RIGHT),
    Situation("units in a row of their own", text("t,u,x\ns,V,mm\n" + BODY), RIGHT),
    Situation("units in brackets in a row", text("t,u,x\n[s],[V],[mm]\n" + BODY), RIGHT),
    Situation("units in words", text("t,u,x\nsec,Volts,Millimeter\n" + BODY), RIGHT),
    Situation("units behind a slash", text("t/s;u/V;Weg/mm\n" + table(T, U, X, separator=";")), RIGHT),
    Situation("units row above the names", text("s,V,mm\nt,u,x\n" + BODY), RIGHT),
    Situation("comma at the end of each line", text("t [s],u [V],x [mm],\n" + table(T, U, X, last=",")), RIGHT),
    Situation("comma at the end of the numbers alone", text(HEAD + table(T, U, X, last=",")), RIGHT),
    Situation("index of pandas in front", text(",t [s],u [V],x [mm]\n" + table(K.astype(float), T, U, X)), RIGHT),
    Situation("names that are numbers", text("t [s],1,2\n" + BODY), RIGHT, {"inputs": "1:V", "outputs": {"displacement": "2:mm"}}),
    Situation("no names", text(BODY), RIGHT, {"inputs": "column_2:V", "outputs": {"displacement": "column_3:mm"}, "time": "column_1:s"}),
    Situation("two columns of one name", text("t [s],u [V],u [V],x [mm]\n" + table(T, U, U, X)), refused("r.csv", "u [V]", "rename")),
    Situation("two columns of one name that nobody needs", text("t [s],u [V],x [mm],n,n\n" + table(T, U, X, U, U)), RIGHT),
    Situation("names with commas in quotes", text('"t [s]","u, drive [V]","x, tip [mm]"\n' + BODY), RIGHT),
    Situation("a preamble", text("Operator: A. Smith\nDate: 2026-11-21\nGain: 10\n\n" + PLAIN), RIGHT),
    Situation("a preamble of numbers", text("1;2\n3;4;5;6;7\n\n" + PLAIN), RIGHT),
    Situation("a preamble of 400 lines", text("".join(f"note {k}\n" for k in range(400)) + PLAIN), RIGHT),
    Situation("a preamble of 290 lines", text("".join(f"note {k}\n" for k in range(290)) + PLAIN), RIGHT),
    Situation("a preamble of 400 comments", text("".join(f"# note {k}\n" for k in range(400)) + PLAIN), RIGHT),
    Situation("a preamble of 400 keys with numbers", text("".join(f"key {k};{k}\n" for k in range(400)) + GERMAN + table(T, U, X, separator=";", comma=True)), RIGHT),
    Situation("a preamble of 900 lines above blanks", text("".join(f"note {k}\n" for k in range(900)) + "t_s u_V x_mm\n" + table(T, U, X, separator="  "), "r.dat"), RIGHT),
    Situation("one column of 6000 rows", text("x [mm]\n" + "0.5\n1.5\n" * 3000), refused("r.csv", "two columns of numbers", '"x [mm]" (6000 numbers)')),
    Situation("one column of 6000 rows of words", text("x [mm]\n" + "red dog\n" * 6000), refused("r.csv", "two columns of numbers", 'holds text, numbers are needed: "red dog"')),
    Situation("another table of more columns below the first", text(PLAIN + "t,u,v,x\n" + table(T, U, U, X) * 2), refused("r.csv", "line 602 has 4 cells", "3 columns")),
    Situation("another table of dates below the first", text("when;x [mm]\n" + "2026-11-21 10:00:00;0.5\n" * 320 + GERMAN + table(T, U, X, separator=";")), refused("r.csv", "line 322 has 3 cells", "2 columns")),
    Situation("a preamble of 6000 lines", text("".join(f"note {k}\n" for k in range(6000)) + PLAIN), refused("r.csv", "line 6001 has 4 cells", "first 5000 lines", "remove what stands above")),
    Situation("a preamble of 6000 comments", text("".join(f"# note {k}\n" for k in range(6000)) + PLAIN), refused("r.csv", "first 5000 lines", "remove what stands above")),
    Situation("a cell of 5 MB", text(with_cell(500, "x" * 5_000_000)), refused("r.csv", "line 502 is longer than 256 kB", "correct or remove")),
    Situation("a cell of 5 MB in an early row", text(with_cell(5, "1" * 5_000_000)), refused("r.csv", "line 7 is longer than 256 kB", "correct or remove")),
    Situation("a line of totals at the end", text(PLAIN + "Mean,0.1,0.2\n"), refused("r.csv", "text", "Mean")),
    Situation("a comment at the end", text(PLAIN + "# end of measurement\n"), Right(remark="1 comment below the numbers left out")),
    Situation("empty rows of a spreadsheet at the end", text(PLAIN + ",,\n,,\n"), Right(remark="2 empty rows")),
    Situation("the header again in the middle", text(PLAIN + PLAIN), refused("r.csv", "names comes again", "row 600", "Divide the file")),
    Situation("the last number cut off", text(PLAIN[: PLAIN.rindex(".") + 2]), Right(remark="cut off", fewest=ROWS - 1, rows=ROWS - 1)),
    Situation("the last line without its end", text(PLAIN.rstrip("\n")), RIGHT),
    Situation("zeros of a crashed logger at the end", text(PLAIN + "\0" * 4096), Right(remark="cut off")),
    Situation("zeros in the middle", text(PLAIN[:4000] + "\0" * 512 + PLAIN[4000:]), refused("r.csv", "x [mm]", "\\x00", "row 133")),
    Situation("thousands in quotes", text(HEAD + table(T, U, [f'"{1000 + one:,.4f}"' for one in X])), refused("r.csv", "x [mm]", "1,")),
    Situation("German thousands", text(GERMAN + table(T, U, [f"1.{one:07.3f}".replace(".", ",").replace("1,", "1.", 1) for one in 100 + X], separator=";", comma=False)), refused("r.csv", "Weg [mm]")),
    Situation("typographic minus", text(PLAIN.replace("-", "\u2212")), refused("r.csv", "u [V]", "\u2212")),
    Situation("apostrophes of Switzerland", text(HEAD + table(T, U, [f"1'{one:07.3f}" for one in 100 + X])), refused("r.csv", "x [mm]")),
    Situation("percent signs", text("t [s],u [V],x [mm]\n" + table(T, U, [f"{one:.5f}%" for one in X])), refused("r.csv", "x [mm]", "%")),
    Situation("units in every cell", text("t,u,x\n" + table(T, U, [f"{one:.5f} mm" for one in X])), refused("r.csv", "x", "mm")),
    Situation("hexadecimal counts", text("t [s],u [V],x\n" + table(T, U, [hex(int(1e4 * (one + 9))) for one in X])), refused("r.csv", "0x")),
    Situation("line break inside quotes", text(HEAD + BODY[: BODY.index("\n", 900) + 1] + '0.5,"a\nb",0.1\n'), refused("r.csv", "quote")),
    Situation("a spreadsheet's own file", text("PK\x03\x04" + "x" * 300, "r.xlsx"), refused(".xlsx", "convert")),
    Situation("a spreadsheet's file named .csv", text("PK\x03\x04\x14\0\x06\0" + "\x01\x02" * 300, "r.csv", "latin-1"), refused("r.csv", "spreadsheet", "save it as CSV")),
    Situation("a web page named .csv", text("<!DOCTYPE html>\n<html><body>Sign in</body></html>\n"), refused("r.csv", "web page")),
    Situation("JSON named .csv", text('{"t": [0, 1, 2], "x": [1, 2, 3]}\n'), refused("r.csv")),
)  # fmt: skip

NO_READING = tuple(
    Situation(f"{word!r} where nothing was read", text(with_cell(300, word)), Right(fewest=ROWS - 1, remark="row 300"))
    for word in ("", "NaN", "nan", "#N/A", "NULL", "n/a", "NA", "-1.#IND", "1.#QNAN", "1e999")
) + tuple(
    Situation(f"{word!r} among numbers", text(with_cell(300, word)), refused("r.csv", "x [mm]", "row 300"))
    for word in ("----", "OVLD", "OL", "Err", "1.#INF", "\u221e", "9.91E+37", "-9.9e37", "12..5", "1 5",
                 "TRUE")
)  # fmt: skip

TEK_OLD_HEAD = [
    "Record Length,600",
    "Sample Interval,1.0e-03",
    "Trigger Point,300",
    "",
    "",
    "",
    "Source,CH1",
    "Vertical Units,V",
]
LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tNo\n"
    "X_Columns\tOne\nTime_Pref\tRelative\nDate\t2026/11/21\nTime\t10:00:00,000\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    "Samples\t600\t600\t\nDate\t2026/11/21\t2026/11/21\t\nTime\t10:00:00\t10:00:00\t\nY_Unit_Label\tV\tmm\t\n"
    "X_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.001\t0.001\t\n***End_of_Header***\t\t\t\nX_Value\tu\tx\tComment\n"
)  # fmt: skip

INSTRUMENTS = (
    Situation("Keysight", text("x-axis,1,2\nsecond,Volt,Volt\n" + table(T - 0.3, U, X, form="{:+.8E}")), IN_V, {"inputs": "1", "outputs": {"displacement": "2"}}),
    Situation("Keysight, nothing said", text("x-axis,1,2\nsecond,Volt,Volt\n" + table(T - 0.3, U, X, form="{:+.8E}")), refused("r.csv", "which motion", "--output")),
    Situation("Tektronix, new", text("Model,MSO44\nFirmware,1.2\n\nPoint Format,Y\nHorizontal Units,s\nSample Interval,1e-3\nRecord Length,600\n\n\nLabels,,\nTIME,CH1,CH2\n" + table(T - 0.3, U, X, form="{:.8E}")), IN_V, {"inputs": "CH1:V", "outputs": {"displacement": "CH2:V"}}),
    Situation("Tektronix, old: notes beside the numbers", text("".join(
        f"{(TEK_OLD_HEAD[k] if k < len(TEK_OLD_HEAD) and TEK_OLD_HEAD[k] else ',')},,{t:.6f},{x:.6f},\n" for k, (t, x) in enumerate(zip(T, X, strict=True)))), refused("r.csv")),
    Situation("Rigol: rows are counted, the rate stands above", text("X,CH1,CH2,Start,Increment\nSequence,Volt,Volt,0.0,1.0e-3\n" + table(K.astype(float), U, X, last=",,")), refused("r.csv", "Increment = 1.0e-3", "without its unit", "--sample-rate"), VOLTS),
    Situation("Rigol, with the rate", text("X,CH1,CH2,Start,Increment\nSequence,Volt,Volt,0.0,1.0e-3\n" + table(K.astype(float), U, X, last=",,")), IN_V, VOLTS | {"sample_rate_hz": 1000.0}),
    Situation("Siglent", text("Record Length,Analog:600\nSample Interval,0.001\nVertical Units,V\nVertical Scale,1.0\nHorizontal Units,s\nModel Number,SDS1104\nSource,CH1,CH2\nSecond,Volt,Volt\n" + table(T, U, X)), IN_V, {"inputs": "CH1", "outputs": {"displacement": "CH2"}}),
    Situation("PicoScope: units in brackets, ms and mV", text("Time,Channel A,Channel B\n(ms),(V),(mV)\n\n" + table(1e3 * T, U, 1e3 * X)), IN_V, {"inputs": "Channel A", "outputs": {"displacement": "Channel B"}}),
    Situation("PicoScope, out of range", text("Time,Channel A,Channel B\n(ms),(V),(mV)\n\n" + table(1e3 * T, U, 1e3 * X)[:-60].rpartition("\n")[0] + "\n599,0.1,\u221e\n"), refused("r.csv", "Channel B", "\u221e"), {"inputs": "Channel A", "outputs": {"displacement": "Channel B"}}),
    Situation("LeCroy: one channel", text("LECROYWS422,51765,Waveform\nSegments,1,SegmentSize,600\nSegment,TrigTime,TimeSinceSegment1\n#1,01-Jan-2026 10:00:00,0\nTime,Ampl\n" + table(T, X)), refused("r.csv", "Ampl", "one signal", "both channels")),
    Situation("Saleae", text("Time [s],Channel 0,Channel 1\n" + BODY), IN_V, {"inputs": "Channel 0:V", "outputs": {"displacement": "Channel 1:V"}}),
    Situation("LabVIEW measurement file", text(LVM + table(T, U, X, separator="\t"), "r.txt"), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}),
    Situation("LabVIEW .lvm", text(LVM + table(T, U, X, separator="\t"), "r.lvm"), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}),
    Situation("LabVIEW .lvm, a tab at the end of each row", text(LVM + table(T, U, X, separator="\t", last="\t"), "r.lvm"), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}),
    Situation("LabVIEW .lvm, a tab at the end of each row and of the names", text(LVM.replace("Comment", "Comment\t") + table(T, U, X, separator="\t", last="\t"), "r.lvm"), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}),
    Situation("LabVIEW .lvm without times, a tab at the end of each row", text(LVM.replace("X_Columns\tOne", "X_Columns\tNo") + table([""] * ROWS, U, X, separator="\t", last="\t"), "r.lvm"), RIGHT, {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}),
    Situation("DIAdem: names, units, types in rows", text("t;u;x\ns;V;mm\n" + table(T, U, X, separator=";", comma=True)), RIGHT),
    Situation("catman: names, long preamble, Latin-1", text("HBM_CATMAN_DATAFILE_40\nProjekt:\tPrüfstand\nKanäle:\t3\n\nZeit [s]\tu [V]\tWeg [µm]\n" + table(T, U, 1e3 * X, separator="\t", comma=True), "r.txt", "latin-1"), RIGHT),
    Situation("Dewesoft: units in brackets, acceleration in g", text("Time (s);Force (N);acc (g)\n" + table(T, U, A / 9806.65, separator=";")), Right(units={"drive": "N", "acceleration": "mm/s^2"})),
    Situation("ANSYS: blanks and a header of words", text("Time   Force   Disp\n(s)   (N)   (mm)\n" + table(T, U, X, separator="  ")), Right(units={"drive": "N", "displacement": "mm"})),
    Situation("numpy.savetxt", text("# t u x\n" + table(T, U, X, separator=" ", form="{:.18e}"), "r.txt"), RIGHT, SAID),
    Situation("numpy.savetxt without header", text(table(T, U, X, separator=" ", form="{:.18e}"), "r.txt"), RIGHT, {"inputs": "column_2:V", "outputs": {"displacement": "column_3:mm"}, "time": "column_1:s"}),
    Situation("semicolons in a .tsv", text(GERMAN + table(T, U, X, separator=";"), "r.tsv"), RIGHT),
    Situation("decibels", text("t [s],u [V],x [dB]\n" + BODY), refused("r.csv", "dB")),
    Situation("an unknown unit", text("t [s],u [V],x [blorp]\n" + BODY), refused("r.csv", "x [blorp]", "unit", "--output")),
    Situation("a unit that pint would work out for ever", text("t [s],u [V],x [9**9**9 mm]\n" + BODY), refused("r.csv", "x [9**9**9 mm]", "--output")),
    Situation("a unit of 5000 characters", text(f"t [s],u [V],x [{'mm' * 2500}]\n" + BODY), refused("r.csv", "--output")),
    Situation("the user's unit against the file's", text(PLAIN), refused("r.csv", '"mm"', '"um"', "correct"), {"outputs": {"displacement": "x:um"}}),
    Situation("mV that are called V", text(HEAD.replace("[V]", "[mV]") + BODY), refused("r.csv", '"mV"', '"V"'), {"inputs": "u:V"}),
    Situation("mV", text(HEAD.replace("[V]", "[mV]") + table(T, 1e3 * U, X)), RIGHT),
    Situation("nm and kV", text("t [s],u [kV],x [nm]\n" + table(T, 1e-3 * U, 1e6 * X)), RIGHT),
    Situation("inches", text("t [s],u [V],x [in]\n" + table(T, U, X / 25.4)), RIGHT),
    Situation("mil", text("t [s],u [V],x [mil]\n" + table(T, U, X / 0.0254)), RIGHT),
)  # fmt: skip
UX = table(U, X)
NAMED = "u [V],x [mm]\n"
UNTIMED = LVM.replace("X_Columns\tOne", "X_Columns\tNo") + table([""] * ROWS, U, X, separator="\t")
HAND = """
[dataset]
name = "r"
plant = "oscillator"
[signals.drive]
role = "input"
column = "u [V]"
unit = "V"
[signals.displacement]
role = "output"
column = "x [mm]"
unit = "mm"
[[records]]
file = "FILE"
"""
ASKED = ("r.csv", "--sample-rate")


def above(line: str) -> Write:
    """u and x without a time, and lines above them."""
    return text(f"{line}\n{NAMED}{UX}")


RATES = (
    Situation("a rate in a comment", above("# Shaker test 12\n# Sampling rate: 1000 Hz\n# Operator: JD"), Right(remark='1000 Hz by line 2 "# Sampling rate: 1000 Hz"')),
    Situation("a rate between tabs, without unit", text("Sample Rate\t1000\nChannels\t2\n\nForce (N)\tDisp (mm)\n" + table(U, X, separator="\t"), "r.txt"), Right(remark="taken in Hz", units={"drive": "N", "displacement": "mm"})),
    Situation("a rate behind an equals sign, in kHz", above("fs = 1 kHz"), RIGHT),
    Situation("an interval between commas, with its unit in a cell", above('"Sample Interval",1.0e-3,s\n"Model","TDS"'), RIGHT),
    Situation("a period in a comment, and names between commas above numbers between blanks", text("% dt=0.001\n% u [V], x [mm]\n" + table(U, X, separator=" "), "r.dat"), Right(remark="taken in s")),
    Situation("names between blanks with units in a comment, above the rate", text("% u [V] x [mm]\n% dt = 1 ms\n" + table(U, X, separator=" "), "r.dat"), RIGHT),
    Situation("a German rate", text("Abtastrate: 1000 Hz;\nAnregung [V];Weg [mm]\n" + table(U, X, separator=";", comma=True)), RIGHT),
    Situation("a German period with a decimal comma, its unit in the key", text("Abtastzeit [ms]: 1,0\nAnregung [V];Weg [mm]\n" + table(U, X, separator=";", comma=True)), RIGHT),
    Situation("a French rate in Latin-1", text("Fréquence d'échantillonnage : 1 kHz\nu [V];x [mm]\n" + table(U, X, separator=";", comma=True), encoding="latin-1"), RIGHT),
    Situation("a rate with its unit in the key", above("Sampling rate (kHz): 1"), RIGHT),
    Situation("a rate in samples, behind a date", above("Date: 2026-11-21 10:00:00, Sampling rate: 1 kS/s; N = 600"), RIGHT),
    Situation("a rate and nothing else", above("rate 1000"), RIGHT),
    Situation("a period in us", above("Δt = 1000 µs"), RIGHT),
    Situation("a rate for each column, the same", above("Sample Rate,1000,1000"), RIGHT),
    Situation("rates of columns that differ", above("Sample Rate,1000,500"), refused(*ASKED, "line 1", "several rates")),
    Situation("a rate between names and numbers", text(NAMED + "# fs = 1000 Hz\n" + UX), RIGHT),
    Situation("a rate above numbers that no line names", text("Sample Rate,1000\n" + UX), RIGHT, {"inputs": "column_1:V", "outputs": {"displacement": "column_2:mm"}}),
    Situation("a rate and a counter of samples", text("# fs = 1000 Hz\nn," + NAMED + table(K.astype(float), U, X)), RIGHT),
    Situation("a rate and an interval that agree", above("fs = 1000 Hz\ndt = 1 ms"), RIGHT),
    Situation("a rate and an interval that contradict each other", above("fs = 2000 Hz\nnote\ndt = 1 ms"), refused(*ASKED, 'line 1 "fs = 2000 Hz" (2000 Hz) and line 3 "dt = 1 ms" (1000 Hz) contradict')),
    Situation("a rate and an interval that contradict each other, which the user settles", above("fs = 2000 Hz\ndt = 1 ms"), Right(remark="contradict each other"), {"sample_rate_hz": 1000.0}),
    Situation("a rate that the time column contradicts, above it", text("# fs = 1500 Hz\n" + PLAIN), refused("r.csv", "line 1", "1500 Hz", "1000 Hz", "correct one")),
    Situation("a rate of the device, of which the file has every tenth sample", text("# fs = 10 kHz\n" + PLAIN), Right(remark="one of 10 of those samples")),
    Situation("a rate that a wrong unit makes 1000 times as large", text("# fs = 1000 kHz\n" + PLAIN), refused("r.csv", "line 1", "1000000 Hz", "1000 Hz")),
    Situation("an interval that is rounded, and a time column", text("# dt = 0.49 ms\n" + HEAD + table(K / 2048.0, U, X, form="{:.9f}")), Right(rate_hz=2048.0)),
    Situation("a rate that tells the unit of a time column", text("# fs = 1000 Hz\ntime,u [V],x [mm]\n" + table(1e3 * T, U, X)), RIGHT),
    Situation("a rate that is not the user's", above("# fs = 1000 Hz"), refused("r.csv", "line 1", "1000 Hz", "700", "correct one"), {"sample_rate_hz": 700.0}),
    Situation("a rate for a manifest without one", above("# fs = 1000 Hz"), RIGHT, {"manifest": HAND}),
    Situation("a rate against that of a manifest", above("# fs = 1000 Hz"), refused("line 1", "1000 Hz", "sample_rate_hz = 700"), {"manifest": HAND + "sample_rate_hz = 700.0\n", "file": "manifest"}),
    Situation("an interval without unit for a manifest without rate", above("interval: 500"), refused("line 1", "interval: 500", "add sample_rate_hz"), {"manifest": HAND, "file": "manifest"}),
    Situation("an interval without unit", above("interval: 500"), refused(*ASKED, 'line 1 "interval: 500"', "without its unit")),
    Situation("a long period without unit", above("dt = 1"), refused(*ASKED, "line 1", "no unit")),
    Situation("a sampling time that may be the duration", above("Sampling time: 60 s"), refused(*ASKED, "line 1", "duration")),
    Situation("a rate with thousands or decimals", above("Sample rate: 1,000 Hz"), refused(*ASKED, "line 1", "thousands")),
    Situation("a German rate with thousands or decimals", text("Abtastrate: 1.000 Hz\nu [V];x [mm]\n" + table(U, X, separator=";", comma=True)), refused(*ASKED, "line 1", "thousands")),
    Situation("a rate in words", above("Sample rate: as usual"), refused(*ASKED, "line 1", "no rate that can be read")),
    Situation("a rate in a unit of time", above("Sample rate: 1 ms"), refused(*ASKED, "line 1", "no rate that can be read")),
    Situation("numbers that are no rates", above("Samples per channel: 600\nSample count: 600\nBaud rate: 9600\nHeart rate: 70\nSampling time: 10:00:00\nFS: 10 V\nDate: 2026-11-21"), refused(*ASKED, "states no rate that can be read")),
    Situation("LabVIEW .lvm without times", text(UNTIMED, "r.lvm"), Right(remark="Delta_X"), {"inputs": "u:V", "outputs": {"displacement": "x:mm"}}),
)  # fmt: skip
SITUATIONS = (*SPREADSHEETS, *NO_READING, *INSTRUMENTS, *RATES)
