"""Blind cases on a VO2 microactuator: an independent plant with its own hysteresis, heating and hidden effects."""

from __future__ import annotations

from .case import generate_vo2
from .options import Vo2Options
from .truth import Vo2Record, Vo2Truth

__all__ = ["Vo2Options", "Vo2Record", "Vo2Truth", "generate_vo2"]
