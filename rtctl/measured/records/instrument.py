"""What all records of a dataset show of the instrument that read them, and the records as this makes them.

Each record alone may be too short, or its drive too slow, to show it; and a record that was taken otherwise than the
others would be simulated otherwise. So all are looked at before any is used.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

from rtctl.measured.dataset import Record
from rtctl.measured.records.difference_quotient import SOURCES, QuotientEvidence
from rtctl.measured.records.jump_reading import NEVER_AT_ONCE, JumpEvidence
from rtctl.measured.stored import StoredDataset

AFTER_JUMP = (
    "{output}: its rows are read just after the jumps of {inputs}, which is held, as the readings show"
)
LEFT_OUT = "{output} is the difference quotient of {source}, row by row: it holds nothing of its own, and is left out"


class Instrument(NamedTuple):
    """How the records of a dataset were read."""

    held: tuple[str, ...]
    """Inputs that are held between their samples."""
    after_jumps: frozenset[str]
    """Outputs that are read just after an input jumps."""
    left_out: Mapping[str, str]
    """Outputs that are difference quotients, and of what."""

    def applied(self, record: Record) -> Record:
        """Return a record as it was read, without the outputs that hold nothing of their own."""
        signals = {name: values for name, values in record.signals.items() if name not in self.left_out}
        return replace(record, signals=signals, after_jumps=self.after_jumps)

    def units(self, units: Mapping[str, str]) -> dict[str, str]:
        """Return the units of the outputs that are not left out."""
        return {name: unit for name, unit in units.items() if name not in self.left_out}

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user must know of it."""
        inputs = " and ".join(self.held)
        after = sorted(self.after_jumps) if self.held else []
        return (
            *(AFTER_JUMP.format(output=name, inputs=inputs) for name in after),
            *(LEFT_OUT.format(output=name, source=source) for name, source in self.left_out.items()),
        )


def instrument_of(records: Iterable[Record], plant: str, holds: Mapping[str, str]) -> Instrument:
    """Return how records of a kind of plant were read; each is dropped before the next is asked for."""
    jumps, quotients = JumpEvidence(holds), QuotientEvidence()
    for record in records:
        jumps.see(record)
        if plant == "oscillator":
            quotients.see(record)
    held = tuple(name for name, hold in holds.items() if hold == "zero")
    left_out = quotients.left_out
    return Instrument(held, jumps.after_jumps - left_out.keys(), left_out)


def read_alike(stored: StoredDataset) -> StoredDataset:
    """Return a stored dataset whose records are taken as all of them together show; they are read once more for it.

    Raises:
        InputError: the numbers of a record are wrong.
    """
    outputs = stored.units.keys() - stored.holds.keys()
    may_jump = "zero" in stored.holds.values() and bool(outputs - NEVER_AT_ONCE)
    may_be_quotients = stored.plant == "oscillator" and len(outputs & (SOURCES.keys() | {"displacement"})) > 1
    if not (may_jump or may_be_quotients):
        return stored
    instrument = instrument_of(stored, stored.plant, stored.holds)
    return replace(
        stored,
        units=instrument.units(stored.units),
        read=lambda k: instrument.applied(stored.read(k)),
        remarked=lambda: (*stored.remarks, *instrument.remarks),
    )
