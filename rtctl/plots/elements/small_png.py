"""Figures for a page that is kept in the repository: a palette of 64 colours, a third of the bytes.

Pillow comes with matplotlib, which cannot save a PNG without it.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of
from rtctl.plots.elements.style import house_style

DOTS_PER_INCH = 100
COLOURS = 64
STUDY = "reproduce"


def save_small_png(
    figure: Figure, path: Path, *, colours: int = COLOURS, dots_per_inch: int = DOTS_PER_INCH
) -> None:
    """Draw into the PNG file `path` of a study, whole or not at all.

    Raises InputError where a file is there that `rtctl reproduce` did not write.
    """
    drawn = BytesIO()
    with house_style():
        figure.savefig(drawn, format="png", dpi=dots_per_inch)
    written_by = PngInfo()
    written_by.add_text("Software", mark_of(STUDY))
    drawn.seek(0)
    with Image.open(drawn) as image:
        flat = image.convert("RGB").quantize(colours)
    with replacing(path, STUDY) as partial:
        flat.save(partial, format="PNG", optimize=True, pnginfo=written_by)
