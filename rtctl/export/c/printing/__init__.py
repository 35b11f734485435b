"""An exported loop as text: a library in C99, and Python in single precision."""
