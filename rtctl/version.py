"""The version of the program, which every file that it writes carries."""

__version__ = "0.2.0"
