"""The simulated instruments by name: their identity, headers and answers, after the makers' manuals."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from plant_sim.device import SimulatedDevice
from plant_sim.wire.scpi.grammar import plain
from plant_sim.wire.scpi.instrument import Entry, ScpiInstrument, fixed, source_entries
from plant_sim.wire.scpi.source_meter import NO_NUMBER, Measured, RefusedError, SourceMeter
from plant_sim.wire.scpi.tsp import TspInstrument

Instrument = ScpiInstrument | TspInstrument


def keithley_2400(device: SimulatedDevice) -> ScpiInstrument:
    """Return a Keithley 2400 (manual 2400S-900-01, section 18)."""
    meter = SourceMeter(device)
    elements = ["VOLT", "CURR", "RES", "TIME", "STAT"]

    def choose(parameters: tuple[str, ...]) -> None:
        chosen = {plain(parameter)[:4] for parameter in parameters}
        known = {"VOLT": "VOLT", "CURR": "CURR", "RES": "RES", "RESI": "RES", "TIME": "TIME", "STAT": "STAT"}
        if not chosen <= known.keys():
            raise RefusedError(-224, "Illegal parameter value")
        elements[:] = [
            name for name in ("VOLT", "CURR", "RES", "TIME", "STAT") if name in {known[c] for c in chosen}
        ]

    def read(_: tuple[str, ...]) -> str:
        m = meter.measure()
        status = (
            2048 + 32768 + 8 * m.limited + m.overflow
        )  # volts measured, current sourced; table in section 18
        values = {"VOLT": m.voltage_V, "CURR": m.current_A, "RES": NO_NUMBER, "TIME": 0.0, "STAT": status}
        return _joined([values[name] for name in elements])

    def reset() -> None:
        meter.reset()
        elements[:] = ["VOLT", "CURR", "RES", "TIME", "STAT"]

    headers = {
        "level": ":SOURce[1]:CURRent[:LEVel][:IMMediate][:AMPLitude]",
        "current_range": ":SOURce[1]:CURRent:RANGe",
        "compliance": ":SENSe[1]:VOLTage[:DC]:PROTection[:LEVel]",
        "voltage_range": ":SENSe[1]:VOLTage[:DC]:RANGe[:UPPer]",
        "nplc": ":SENSe[1]:VOLTage[:DC]:NPLCycles",
        "output": ":OUTPut[1][:STATe]",
    }
    entries = [
        *source_entries(meter, headers),
        fixed(":SOURce[1]:FUNCtion[:MODE]", "CURR", ("CURR", "CURRENT")),
        fixed(":SOURce[1]:CURRent:MODE", "FIX", ("FIX", "FIXED")),
        fixed(":SOURce[1]:CLEar:AUTO", "0"),
        fixed(":SOURce[1]:DELay", "0", ("0",)),
        fixed(":SENSe[1]:FUNCtion[:ON]", '"VOLT:DC"', ("VOLT", "VOLT:DC", "VOLTAGE", "VOLTAGE:DC")),
        fixed(":ARM[:SEQuence[1]][:LAYer[1]]:COUNt", "1", ("1",)),
        fixed(":TRIGger[:SEQuence[1]]:COUNt", "1", ("1",)),
        Entry(":FORMat:ELEMents[:SENSe[1]]", write=choose, read=lambda _: ",".join(elements)),
        Entry(":READ", read=read, aperture_s=lambda: meter.aperture_s),
    ]
    return ScpiInstrument(f"KEITHLEY INSTRUMENTS INC.,MODEL 2400,{device.identity},C34", entries, reset)


def keithley_2450(device: SimulatedDevice) -> ScpiInstrument:
    """Return a Keithley 2450 with the command set SCPI (manual 2450-901-01, section 6)."""
    meter = SourceMeter(device)

    def read(parameters: tuple[str, ...]) -> str:
        m = meter.measure()
        status = 128 + 32 * m.limited  # output on, source limited: buffer status bits for source function
        values = {"READ": m.voltage_V, "SOUR": m.current_A, "SOURSTAT": status}
        wanted = [plain(parameter) for parameter in parameters[1:]] or ["READ"]
        if not set(wanted) <= values.keys() or (parameters and plain(parameters[0]) != "DEFBUFFER1"):
            raise RefusedError(-224, "Illegal parameter value")
        return _joined([values[name] for name in wanted])

    headers = {
        "level": ":SOURce[1]:CURRent[:LEVel][:IMMediate][:AMPLitude]",
        "current_range": ":SOURce[1]:CURRent:RANGe",
        "compliance": ":SOURce[1]:CURRent:VLIMit[:LEVel]",
        "voltage_range": ":SENSe[1]:VOLTage[:DC]:RANGe[:UPPer]",
        "nplc": ":SENSe[1]:VOLTage[:DC]:NPLCycles",
        "output": ":OUTPut[1][:STATe]",
    }
    entries = [
        *source_entries(meter, headers),
        fixed(":SOURce[1]:FUNCtion[:MODE]", "CURR", ("CURR", "CURRENT")),
        fixed(":SENSe[1]:FUNCtion[:ON]", '"VOLT:DC"', ("VOLT", "VOLT:DC", "VOLTAGE", "VOLTAGE:DC")),
        fixed(":SOURce[1]:CURRent:READ:BACK", "1"),
        fixed(":SOURce[1]:CURRent:DELay", "0", ("0",)),
        fixed(":SENSe[1]:COUNt", "1", ("1",)),
        Entry("*LANG", read=lambda _: "SCPI"),
        Entry(":READ", read=read, aperture_s=lambda: meter.aperture_s),
        Entry(":MEASure[:VOLTage][:DC]", read=read, aperture_s=lambda: meter.aperture_s),
        Entry(":SOURce[1]:CURRent:VLIMit[:LEVel]:TRIPped", read=lambda _: str(int(meter.measure().limited))),
    ]
    return ScpiInstrument(f"KEITHLEY INSTRUMENTS,MODEL 2450,{device.identity},1.7.12b", entries, meter.reset)


def keysight_b2900(device: SimulatedDevice) -> ScpiInstrument:
    """Return a Keysight B2901 (manual B2910-90030; bits of the status: table 1-2)."""
    meter = SourceMeter(device)
    elements = ["VOLT", "CURR", "RES", "TIME", "STAT", "SOUR"]

    def choose(parameters: tuple[str, ...]) -> None:
        chosen = {plain(parameter)[:4].removesuffix("I") for parameter in parameters}
        known = ("VOLT", "CURR", "RES", "TIME", "STAT", "SOUR")
        if not chosen <= set(known):
            raise RefusedError(-224, "Illegal parameter value")
        elements[:] = [name for name in known if name in chosen]

    def values_of(m: Measured) -> Mapping[str, float]:
        status = 1 + 2 * m.limited + 8192 * m.overflow
        resistance = m.voltage_V / m.current_A if m.current_A else NO_NUMBER
        return {"VOLT": m.voltage_V, "CURR": m.current_A, "RES": resistance, "TIME": 0.0, "STAT": status,
                "SOUR": meter.settings.level_A}  # fmt: skip

    def reading(name: str | None = None) -> Callable[[tuple[str, ...]], str]:
        def read(parameters: tuple[str, ...]) -> str:
            if parameters not in ((), ("(@1)",)):
                raise RefusedError(-222, "Parameter data out of range; this instrument has one channel")
            values = values_of(meter.measure())
            return _joined([values[one] for one in ([name] if name else elements)])

        return read

    headers = {
        "level": ":SOURce[1]:CURRent[:LEVel][:IMMediate][:AMPLitude]",
        "current_range": ":SOURce[1]:CURRent:RANGe",
        "compliance": ":SENSe[1]:VOLTage[:DC]:PROTection[:LEVel][:BOTH]",
        "voltage_range": ":SENSe[1]:VOLTage[:DC]:RANGe[:UPPer]",
        "nplc": ":SENSe[1]:VOLTage[:DC]:NPLCycles",
        "output": ":OUTPut[1][:STATe]",
    }
    sensed = ("VOLT", "CURR", "VOLT,CURR", "CURR,VOLT")
    entries = [
        *source_entries(meter, headers),
        fixed(":SOURce[1]:FUNCtion:MODE", "CURR", ("CURR", "CURRENT")),
        fixed(":SENSe[1]:FUNCtion[:ON]", '"VOLT","CURR"', sensed),
        fixed(":OUTPut[1]:ON:AUTO", "1"),
        Entry(":FORMat:ELEMents:SENSe[1]", write=choose, read=lambda _: ",".join(elements)),
        *(
            Entry(header, read=reading(name), aperture_s=lambda: meter.aperture_s)
            for header, name in (
                (":MEASure", None), (":READ[:SCALar]", None), (":MEASure:VOLTage[:DC]", "VOLT"),
                (":MEASure:CURRent[:DC]", "CURR"), (":MEASure:RESistance", "RES"),
            )
        ),
    ]  # fmt: skip

    def reset() -> None:
        meter.reset()
        elements[:] = ["VOLT", "CURR", "RES", "TIME", "STAT", "SOUR"]

    return ScpiInstrument(f"Keysight Technologies,B2901B,{device.identity},5.2.2049.1805", entries, reset)


def keithley_2600(device: SimulatedDevice) -> TspInstrument:
    """Return channel A of a Keithley 2602B."""
    return TspInstrument(
        SourceMeter(device), f"Keithley Instruments Inc., Model 2602B, {device.identity}, 3.4.0"
    )


INSTRUMENTS: dict[str, Callable[[SimulatedDevice], Instrument]] = {
    "keithley-2400": keithley_2400,
    "keithley-2450": keithley_2450,
    "keithley-2600": keithley_2600,
    "keysight-b2900": keysight_b2900,
}
"""Source meters that can be served."""


def _joined(values: list[float]) -> str:
    return ",".join(f"{value:+.6E}" for value in values)
