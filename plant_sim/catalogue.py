"""The simulated devices that come with the program, by name; which kinds there are, the registry of rtctl knows."""

from __future__ import annotations

from pathlib import Path

from rtctl.border.errors import InputError, nearest


def bundled_devices() -> dict[str, Path]:
    """Return the files of all bundled devices by name."""
    return {path.stem: path for path in sorted(Path(__file__).parent.glob("*/devices/*.toml"))}


def bundled_plant(name: str) -> Path:
    """Return the file of a device that comes with the program, such as "vo2_a". Raises InputError."""
    devices = bundled_devices()
    if name not in devices:
        raise InputError(f'no bundled plant "{name}"{nearest(name, devices)}')
    return devices[name]
