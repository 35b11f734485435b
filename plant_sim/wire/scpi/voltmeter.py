"""A voltmeter at the output of a position sensor: what an external instrument measures, as a voltage."""

from __future__ import annotations

import math

from plant_sim.device import SimulatedDevice
from plant_sim.wire.scpi.instrument import Entry, ScpiInstrument, fixed, number_of
from plant_sim.wire.scpi.source_meter import LINE_HZ, NO_NUMBER, OVERHEAD_S, in_range

VOLTS_PER_UNIT = 0.1
"""Of the sensor: 1 V at 10 um, or at 10 of whatever unit the device's reference has."""


def voltmeter(device: SimulatedDevice) -> ScpiInstrument:
    """Return a multimeter whose DC voltage is the device's reference times `VOLTS_PER_UNIT`."""
    nplc = [1.0]

    def set_nplc(parameters: tuple[str, ...]) -> None:
        nplc[0] = in_range(1e-3, number_of(parameters), 100.0)

    def read(_: tuple[str, ...]) -> str:
        reference = device.read().reference
        return f"{reference * VOLTS_PER_UNIT if math.isfinite(reference) else NO_NUMBER:+.8E}"

    def reset() -> None:
        nplc[0] = 1.0

    ranges = ("0.1", "1", "10", "100", "1000")
    entries = [
        fixed(":CONFigure[:VOLTage][:DC]", "VOLT", ("",)),
        fixed("[:SENSe]:VOLTage[:DC]:RANGe", "10", ranges),
        Entry("[:SENSe]:VOLTage[:DC]:NPLCycles", write=set_nplc, read=lambda _: f"{nplc[0]:+.3E}"),
        Entry(":READ", read=read, aperture_s=lambda: nplc[0] / LINE_HZ + OVERHEAD_S),
    ]
    return ScpiInstrument(f"RTCTL,SIMULATED VOLTMETER,{device.identity},1", entries, reset)
