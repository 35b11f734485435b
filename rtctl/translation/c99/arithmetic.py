"""What translated functions need: reals in one precision, views of arrays, integers that divide as in Python."""

from pathlib import Path

ARITHMETIC = Path(__file__).with_name("rtctl_arithmetic.h")
