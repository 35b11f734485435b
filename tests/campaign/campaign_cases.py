"""A small campaign, as a file."""

from __future__ import annotations

from pathlib import Path

SMALL = """
[campaign]
title = "small"
model = "beam_hm"
outputs = ["kind", "attractor", "period", "settled_s", "exponent", "turning_points", "stroboscopic", "end_velocity"]
part = 16

[drive]
amplitude = "3.81 m/s^2"

[follow]
look = "20 s"
most = "40 s"

[design]
kind = "grid"

[factors.damping]
values = ["1.5 1/s"]

[factors.frequency]
low = "8 Hz"
high = "14 Hz"
count = 7

[factors.displacement]
values = ["-12 mm", "-7 mm", "3 mm", "0.7 cm"]

[factors.velocity]
values = ["-400 mm/s", "0 mm/s", "0.4 m/s"]
"""


def campaign(folder: Path, text: str = SMALL) -> Path:
    """The file."""
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path
