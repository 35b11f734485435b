"""What a page must know of a recording before it can draw its rows."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.live_page.recorded.places import Place
from rtctl.live_page.recorded.rows import INDEX, RecordedRows
from rtctl.live_page.shown.panels import panels_of, planes_of
from rtctl.live_page.shown.signals import ShownSignals, signals_of
from rtctl.loop.live_parameters import units_of_parameters
from rtctl.scenario.schema import Scenario, checked_scenario
from rtctl.session.live.control_socket import CHANGES, PARAMETERS
from rtctl.session.run_folder import scenario_tables


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """One recording as the page shows it."""

    rows: RecordedRows
    place: Place
    scenario: Scenario | None
    """None: a record of a dataset, or a scenario with parts that are not registered here."""
    remark: str
    """Why the scenario is not known; ""."""
    period_s: float
    """Sample period [s]; 1 where it is not known, so that time counts samples."""
    shown: ShownSignals

    def matrix(self, first: int, last: int) -> FloatArray:
        """Return the signals (signals, rows) of the rows `first` to before `last`."""
        return self.shown.matrix(self.rows.read(first, last))

    def time_s(self, row: int) -> float:
        """Return the time of a row [s]."""
        return self.period_s * self.sample(row)

    def sample(self, row: int) -> float:
        """Return the number of a row's sample in the plan."""
        table = self.rows.read(row, row + 1)
        return float(table[INDEX][0]) if INDEX in table else float(row)

    def row_at(self, time_s: float, count: int) -> int:
        """Return the first of `count` rows at or after `time_s`."""
        low, high = 0, count
        while low < high:
            middle = (low + high) // 2
            if self.time_s(middle) < time_s:
                low = middle + 1
            else:
                high = middle
        return low

    def parameter_units(self) -> dict[str, str]:
        """Return the unit of each parameter that the run can change, by name; empty where that is not known."""
        metadata, scenario = self.rows.metadata, self.scenario
        if PARAMETERS in metadata:
            units: dict[str, str] = json.loads(metadata[PARAMETERS])
            return units
        if scenario is None or CHANGES in metadata:
            return {}
        return units_of_parameters(scenario.profile, is_played=scenario.reference is None)

    def for_page(self) -> dict[str, Any]:
        """Return title, signals, panels and planes as the page takes them."""
        clock = "lockstep" if self.scenario is None else self.scenario.clock.mode
        return {
            "key": self.rows.key,
            "name": self.place.name,
            "title": self._title(),
            "remark": self.remark,
            "period_s": self.period_s,
            "live": self.rows.metadata.get("clock", clock) == "live",
            "closed_loop": self.scenario is not None and self.scenario.reference is not None,
            "signals": [signal._asdict() for signal in self.shown.signals],
            "panels": panels_of(self.shown),
            "planes": planes_of(self.shown, self.rows.metadata),
        }

    def _title(self) -> str:
        if "title" in self.rows.metadata:
            return self.rows.metadata["title"]
        return self.place.name if self.scenario is None else self.scenario.scenario.title


def description_of(rows: RecordedRows, place: Place) -> Description:
    """Return the description of a recording; one whose scenario cannot be read is shown all the same."""
    scenario, remark = None, ""
    if place.record is None and PARAMETERS not in rows.metadata:  # else it is no run of a scenario
        try:
            scenario = checked_scenario(scenario_tables(rows.metadata, place.folder), str(place.folder))
        except (InputError, ValueError) as error:
            remark = f"its scenario is not understood here ({error}); --plugin imports parts of your own"
    known_s = None if scenario is None else scenario.scenario.period_s
    return Description(
        rows=rows,
        place=place,
        scenario=scenario,
        remark=remark,
        period_s=float(rows.metadata.get("period_s", known_s or 1.0)),
        shown=signals_of(rows.columns, scenario),
    )
