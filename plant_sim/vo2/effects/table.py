"""Effects of a VO2 device beyond one time constant: the `[effects]` table of its file, every number 0 if left out.

    P = k y^2 (1 + tcr r + growth phi) - loss r^2 + sensing R / R_cold       r = T - T_0, phi the metal's share
    tau th_1' = P - th_1,  tau_2 th_2' = P - th_2,  T = T_0 + warming t + (1 - s) th_1 + s th_2
    tau_d T_d' = T - T_d        what the domains see, while the semiconductor and the expansion follow T at once
    q'' + 2 zeta w q' + w^2 q = w^2 D                                        D is measured as D + m (q - D)
    tau_r Y' = R (1 + ageing t) (1 - gain_loss) + leak y - Y                 Y is the resistance that is read,
                                                     with white noise 1 + noise_growth times that of [sensing]

y, the current that acts, is the command `delay` earlier, behind a backlash of half width `backlash`, times
1 + gain_drift t. t counts from power-up, or from when a drift was switched on.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from plant_sim.bounds import FINITE, NOT_NEGATIVE, POSITIVE
from rtctl.border.units.quantities import Checked, Quantity

LONGEST_DELAY_S = 1.0
DRIFTS = ("warming", "gain_drift", "ageing")
"""Effects that grow with the time since they began."""
SUBSTEPS = 20.0
"""Steps in the shortest time constant at work; 2 in a radian of a swing."""


class Effects(Checked):
    """The `[effects]` table."""

    second_share: Annotated[float, Quantity(""), Field(ge=-0.5, le=1.0)] = 0.0
    """Share s of the heating."""
    second_time_constant: Annotated[float, Quantity("s"), POSITIVE] = 1.0
    """Second time constant tau_2 [s]."""
    tcr: Annotated[float, Quantity("1/K"), NOT_NEGATIVE] = 0.0
    """Temperature coefficient of the heater's resistance [1/K]."""
    phase_heating: Annotated[float, Quantity(""), Field(gt=-1.0, le=5.0)] = 0.0
    """Growth of the heating as the film turns metallic."""
    loss: Annotated[float, Quantity("1/K"), NOT_NEGATIVE] = 0.0
    """Growth of the thermal conductance [1/K]."""
    sensing: Annotated[float, Quantity("K"), NOT_NEGATIVE] = 0.0
    """Rise that the sensing current makes in the cold film [K]."""
    warming: Annotated[float, Quantity("K/s"), FINITE] = 0.0
    """Drift of the ambient temperature [K/s]."""
    delay: Annotated[float, Quantity("s"), Field(ge=0.0, le=LONGEST_DELAY_S)] = 0.0
    """Delay from the command to the heater [s]."""
    gain_drift: Annotated[float, Quantity("1/s"), FINITE] = 0.0
    """Drift of the gain from the command to the current [1/s]."""
    backlash: Annotated[float, Quantity("mA"), NOT_NEGATIVE] = 0.0
    """Half width of the backlash [mA]."""
    domain_lag: Annotated[float, Quantity("s"), NOT_NEGATIVE] = 0.0
    """Time constant tau_d of the transition behind the temperature [s]."""
    swing_share: Annotated[float, Quantity(""), Field(ge=0.0, le=2.0)] = 0.0
    """Participation m of the beam's mode in what is measured."""
    swing_frequency: Annotated[float, Quantity("Hz"), POSITIVE] = 1e3
    swing_damping: Annotated[float, Quantity(""), Field(gt=0.0, lt=1.0)] = 0.01
    """Damping ratio zeta."""
    sensor_lag: Annotated[float, Quantity("s"), NOT_NEGATIVE] = 0.0
    """Time constant tau_r of the sensor [s]."""
    ageing: Annotated[float, Quantity("1/s"), FINITE] = 0.0
    leak: Annotated[float, Quantity("ohm/mA"), FINITE] = 0.0
    """Crosstalk of the heater's current into the reading [ohm/mA]."""
    gain_loss: Annotated[float, Quantity(""), Field(gt=-1.0, lt=1.0)] = 0.0
    """Part of the film's resistance that the sensor no longer reads."""
    noise_growth: Annotated[float, Quantity(""), Field(ge=0.0, le=1000.0)] = 0.0
    """Growth of the bridge's white noise over that of `[sensing]`."""

    @model_validator(mode="after")
    def _stable(self) -> Effects:
        for name, what in (("second_share", "second_time_constant"), ("swing_share", "swing_frequency")):
            if getattr(self, name) != 0.0 and what not in self.model_fields_set:
                raise ValueError(f"{name} needs {what}")
        return self

    @property
    def any(self) -> bool:
        """Whether the device does anything of this."""
        shapes = {"second_time_constant", "swing_frequency", "swing_damping"}
        return any(value != 0.0 for name, value in self if name not in shapes)

    def longest_step_s(self, time_constant_s: float) -> float:
        """Return the longest step that resolves everything at work [s]."""
        times = [time_constant_s, self.domain_lag, self.sensor_lag]
        times += [self.second_time_constant] if self.second_share != 0.0 else []
        times += [10.0 / (2.0 * 3.15 * self.swing_frequency)] if self.swing_share != 0.0 else []
        return min(time for time in times if time > 0.0) / SUBSTEPS
