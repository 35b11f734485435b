"""[controller] kind = "agc_pll" of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rtctl.border.units.quantities import Checked, Quantity


class AgcPllTable(Checked):
    """[controller] kind = "agc_pll": amplitude by the coil's current, phase by the frequency; gains from the model."""

    kind: Literal["agc_pll"] = "agc_pll"
    phase_deg: Annotated[float, Quantity("deg"), Field(alias="phase", ge=-180.0, le=180.0)] = -90.0
    """Setpoint of the displacement's phase against the coil current."""
    gate: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 20.0
    """Least response in standard errors of the estimate: below, the PLL holds and the AGC gives no more than a kick."""
    kick: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    """Share of the current that holds the setpoint."""
    separation: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 5.0
    """How many times slower the amplitude loop is."""
    pll_bandwidth_hz: Annotated[float | None, Quantity("Hz"), Field(alias="pll_bandwidth", gt=0.0)] = None
    agc_bandwidth_hz: Annotated[float | None, Quantity("Hz"), Field(alias="agc_bandwidth", gt=0.0)] = None
