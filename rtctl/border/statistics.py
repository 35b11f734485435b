"""Constants of statistics that several rooms use."""

from __future__ import annotations

NORMAL_95 = 1.96
"""Half width of a 95 % interval in standard deviations of a normal distribution."""
