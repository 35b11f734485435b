"""Firmware of a device on the plain serial protocol: C sources for microcontrollers and for this computer."""

from __future__ import annotations

import shutil
from pathlib import Path

SOURCES = Path(__file__).parent
FILM_TABLES = Path("simulated_film", "film_tables.c")
"""Where the tables of the simulated film go."""
_OURS = ("*.py", "__pycache__", "build", FILM_TABLES.name)


def write_firmware(folder: Path, film_tables: str) -> None:
    """Write all sources, and the tables of the simulated film, into a folder; what is there of them is replaced.

    Args:
        folder: The folder; made if it is not there.
        film_tables: C source of the film's tables.
    """
    shutil.copytree(SOURCES, folder, ignore=shutil.ignore_patterns(*_OURS), dirs_exist_ok=True)
    (folder / FILM_TABLES).write_text(film_tables, encoding="utf-8")
