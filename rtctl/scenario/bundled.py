"""The scenarios that come with the program, by name."""

from __future__ import annotations

from pathlib import Path

from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import read_toml


def find_scenario(name: str) -> Path:
    """Return a scenario file by path, or a bundled one by name. Raises InputError."""
    path = Path(name)
    if path.is_file():
        return path
    bundled = {file.stem: file for folder in _bundles() for file in folder.glob("*.toml")}
    if not path.suffix and name in bundled:
        return bundled[name]
    raise InputError(f"{name}: no such scenario file{nearest(path.stem, bundled)}")


def bundled_titles() -> dict[str, str]:
    """Return the titles of the bundled scenarios by name."""
    files = sorted(bundled_scenarios().glob("*.toml"))
    return {file.stem: str(read_toml(file).get("scenario", {}).get("title", "")) for file in files}


def bundled_scenarios() -> Path:
    """Return the folder of the scenarios that come with the program."""
    for folder in _bundles():
        if folder.is_dir():
            return folder
    raise InputError("the bundled scenarios are missing from this installation; install rtctl again")


def _bundles() -> list[Path]:
    package = Path(__file__).resolve().parent.parent
    return [package / "bundled_scenarios", package.parent / "scenarios"]
