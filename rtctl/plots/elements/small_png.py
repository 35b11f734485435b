"""Figures for a page that is kept in the repository: a palette of 64 colours, a third of the bytes.

Pillow comes with matplotlib, which cannot save a PNG without it.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from rtctl.output.atomic_write import replacing
from rtctl.plots.elements.style import house_style

DOTS_PER_INCH = 100
COLOURS = 64


def save_small_png(figure: Figure, path: Path) -> None:
    """Draw into the PNG file `path`, whole or not at all."""
    drawn = BytesIO()
    with house_style():
        figure.savefig(drawn, format="png", dpi=DOTS_PER_INCH)
    drawn.seek(0)
    with Image.open(drawn) as image:
        flat = image.convert("RGB").quantize(COLOURS)
    with replacing(path) as partial:
        flat.save(partial, format="PNG", optimize=True)
