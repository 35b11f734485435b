"""Lines of text files besides the rows of numbers: below them, among them, and above them where they name columns."""

from __future__ import annotations

from corpus_case import RIGHT, ROWS, Right, Situation, T, U, X, refused, table, text

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
    Situation("comments at the end, with the mark of the preamble", text("! run 5\n" + PLAIN + "! end\n! of data\n"), Right(remark="2 comments below")),
    Situation("a comment at the end with as many cells as a row", text(PLAIN + "# mean,0.1,0.2\n"), ONE_COMMENT),
    Situation("a comment at the end without line end", text(PLAIN + "# end"), ONE_COMMENT),
    Situation("a comment at the end between blanks", text("# t_s u_V x_mm\n" + ALIGNED + "# data end\n", "r.dat"), ONE_COMMENT),
    Situation("a comment and empty rows at the end", text(PLAIN + "\n# end\n,,\n\n"), Right(remark="1 empty row at the end left out; 1 comment below")),
    Situation("a comment of an unknown mark at the end", text(PLAIN + "// end\n"), refused("r.csv", "line 602", "// end", "write # in front")),
    Situation("a word at the end", text(PLAIN + "End,,\n"), refused("r.csv", "line 602", "End,,", "remove it")),
    Situation("a word alone at the end", text(PLAIN + "\nEND\n"), refused("r.csv", "line 603", "END", "remove it")),
    Situation("statistics in two rows at the end", text(PLAIN + "Mean,0.1,0.2\nStd,0.1,0.2\n"), refused("r.csv", "line 602", "Mean,0.1,0.2", "remove it and what follows")),
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
    Situation("exponents of two digits without a letter", text(fortran(letter="")), refused("r.csv", "t [s]", "0.00000000+00", "Correct the cells")),
)  # fmt: skip

SITUATIONS = (*BELOW, *AMONG, *NUMBERS)
