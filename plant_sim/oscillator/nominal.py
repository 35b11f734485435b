"""The nominal oscillator's parameters: z'' + damping z' + stiffness z + stiffness_cubic z^3 = drive_gain u."""

from rtctl.border.mechanisms import Parameter

FASTEST_POLE = 20.0
"""Fastest pole that is fitted, over the sample rate [1/s]: its lag is a twentieth of a sample period."""
NOMINAL_PARAMETERS = (
    Parameter(
        name="damping", unit="1/s", meaning="viscous, of z'", scale=lambda s: s.acceleration / s.velocity, low=0.0,
        fastest=lambda s: FASTEST_POLE / s.period,
    ),
    Parameter(
        name="stiffness", unit="1/s^2", meaning="of z; below 0 with a cubic above 0: bistable",
        scale=lambda s: s.acceleration / s.displacement, fastest=lambda s: (FASTEST_POLE / s.period) ** 2,
    ),
    Parameter(
        name="stiffness_cubic", unit="1/({z}^2*s^2)", meaning="of z^3",
        scale=lambda s: s.acceleration / s.displacement**3,
    ),
    Parameter(
        name="drive_gain", unit="{z}/(s^2*({u}))", meaning="of the drive", scale=lambda s: s.acceleration / s.drive
    ),
)  # fmt: skip
ROWS = {"damping": "damping", "stiffness": "stiffness", "stiffness_cubic": "cubic", "drive_gain": "gain"}
"""Row of the table of terms of each parameter."""
