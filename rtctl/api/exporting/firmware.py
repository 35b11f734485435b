"""Sources of a device on a microcontroller: `export_firmware`."""

from __future__ import annotations

from pathlib import Path

from rtctl.api.inputs import PathText, path_of
from rtctl.border.errors import InputError


def export_firmware(out: PathText, *, film: PathText = "vo2_a", force: bool = False) -> Path:
    """Write the sources of a device on a microcontroller, with the film of a simulated VO2 device (docs/firmware.md).

    Args:
        out: Folder of the sources.
        film: VO2 plant file, or the name of a bundled one, that boards without a film simulate.
        force: Whether sources that are in `out` are overwritten; else it must be new or empty.

    Returns:
        The folder.

    Raises:
        InputError: The folder is not empty, there is no such device, or the firmware cannot simulate it.
    """
    folder = path_of("out", out)
    write_sources(folder, str(path_of("film", film)), force=force)
    return folder


def write_sources(folder: Path, film: str, *, force: bool) -> str:
    """Write the sources into a folder and return the name of the film. Raises as `export_firmware`."""
    from rtctl.wiring_served import write_firmware

    if folder.exists() and any(folder.iterdir()) and not force:
        raise InputError(
            f"--out {folder}: is not empty; choose a new folder, or --force to overwrite sources"
        )
    return write_firmware(film, folder)
