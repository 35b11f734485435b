"""[driver] kind = "scpi": a source meter and its settings, and an external instrument that measures the output."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rtctl.border.units.quantities import Checked, Quantity
from rtctl.scenario.clock import Seconds
from rtctl.scenario.wires import Address, Wire

PLACES = ("address", "port", "visa")
FASTEST_LINE_HZ = 60.0
"""Power line cycles are not shorter than of this frequency, whatever the instrument is set to."""

Volts = Annotated[float, Quantity("V"), Field(gt=0.0, allow_inf_nan=False)]
Amperes = Annotated[float, Quantity("A"), Field(gt=0.0, allow_inf_nan=False)]


class InstrumentKeys(Checked):
    """Keys of every instrument: its table, where it is, and how it reads."""

    table: str
    """Bundled table, such as "keithley-2400", or a file beside the scenario."""
    address: Address | None = None
    """HOST:PORT of a raw socket."""
    port: str | None = None
    """Path of a serial port."""
    baud: Annotated[int, Field(gt=0)] = 9600
    visa: str | None = None
    """VISA resource, such as "GPIB0::24::INSTR"."""
    visa_library: str = ""
    """Which VISA library; "": pyvisa's own choice, "@py": the one in Python."""
    voltage_range_V: Annotated[Volts | None, Field(alias="voltage_range")] = None
    nplc: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    """Integration time in power line cycles."""
    setup: tuple[str, ...] = ()
    """Commands after those of the table."""
    setup_timeout_s: Annotated[Seconds, Field(alias="setup_timeout", gt=0.0)] = 5.0
    """Time of an answer while the instrument is set up and switched off."""

    @model_validator(mode="after")
    def _one_place(self) -> InstrumentKeys:
        given = [key for key in PLACES if getattr(self, key) is not None]
        if len(given) != 1:
            said = f"got {' and '.join(given)}" if given else "got none of them"
            raise ValueError(f"an instrument is at one of {', '.join(PLACES)}; {said}")
        return self


class ReferenceKeys(InstrumentKeys):
    """[driver.reference]: an external instrument whose voltage tells the controlled output; for scoring only."""

    table: str = "voltmeter"
    scale: str
    """Output per volt, such as "20 um/V"."""
    offset: str | None = None
    """Output at 0 V, such as "0 um"."""


class Scpi(InstrumentKeys, Wire):
    """[driver] kind = "scpi"."""

    kind: Literal["scpi"] = "scpi"
    compliance_voltage_V: Annotated[Volts, Field(alias="compliance_voltage")]
    """Largest voltage at the device."""
    current_range_A: Annotated[Amperes | None, Field(alias="current_range")] = None
    """Range of the source; default: the larger of `[limits]`."""
    reference: ReferenceKeys | None = None

    @model_validator(mode="after")
    def _faults_have_a_line(self) -> Scpi:
        if self.faults and self.visa is not None:
            raise ValueError("faults are injected into an address or a port, not into a visa resource")
        return self

    def check_clock(self, mode: str, period_s: float) -> None:
        """Raise ValueError where the clock does not fit: lockstep, or a period that is shorter than a reading."""
        if mode != "live":
            raise ValueError(
                'driver.kind = "scpi" needs clock.mode = "live": an instrument does not wait for its host (--set '
                "clock.mode=live)"
            )
        for key, keys in (("driver.nplc", self), ("driver.reference.nplc", self.reference)):
            nplc = None if keys is None else keys.nplc
            if nplc is not None and nplc / FASTEST_LINE_HZ > period_s:
                raise ValueError(
                    f"{key} = {nplc:g} power line cycles last {1e3 * nplc / FASTEST_LINE_HZ:.3g} ms or more, the "
                    f"period is {1e3 * period_s:g} ms; integrate for less, or set a longer scenario.period"
                )
