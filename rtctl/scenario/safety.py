"""[safety] of a scenario: when a sensor counts as stuck, and whether a faulted device may be armed again."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rtctl.border.records import DeviceProfile
from rtctl.border.units.quantities import Checked
from rtctl.safety.guards import LEAST_TIME_TOLERANCE_US, ReadingRules
from rtctl.scenario.clock import ClockTable, Seconds
from rtctl.scenario.limits import LimitsTable

LEAST_TRAVEL, PLATEAU_TRAVEL = 0.05, 0.5
"""Of the command's range: a reading that does not follow so much of it is stuck on a slope, and on any plateau."""
OPEN_LOOP_TRAVEL, OPEN_LOOP_PLATEAU = 0.5, 0.75
"""The same in open loop, where the command crosses plateaus and reverses as it likes: a metallic film that cools stays
on its plateau until the loops' width is crossed, and between the ends of the range its resistance does change."""
OLDEST_TIME_PERIODS = 2.0


class SafetyTable(Checked):
    """Table [safety]."""

    frozen_after: Annotated[int, Field(ge=0)] = 0
    """Equal readings, to the bit, while the command moves by 5 % of its range (in open loop by half): the sensor is
    stuck. 0: never. The default is that of the kind of plant."""
    check_counter_and_time: bool = True
    """Sample counter and device time are held to each other and to this machine's clock."""
    rearm: Annotated[int, Field(ge=0)] = 0
    """Faults of wire or device after which a run arms the device again and goes on; 0: the first one ends it."""
    rearm_after_s: Annotated[Seconds, Field(alias="rearm_after", ge=0.0)] = 0.5
    """How long the device is left off before."""

    def reading_rules(
        self,
        limits: LimitsTable,
        clock: ClockTable,
        profile: DeviceProfile,
        period_s: float,
        *,
        delay: int,
        open_loop: bool,
    ) -> ReadingRules:
        """As the loop holds them; a reading is `delay` periods old."""
        first = limits.commands(profile)[0]
        slope, plateau = (
            (OPEN_LOOP_TRAVEL, OPEN_LOOP_PLATEAU) if open_loop else (LEAST_TRAVEL, PLATEAU_TRAVEL)
        )
        return ReadingRules(
            names=tuple(f"{channel.name} [{channel.unit}]" for channel in profile.sensed),
            rates=tuple(found.rate_per_s for found in limits.readings(profile)),
            frozen_after=self.frozen_after,
            frozen_travel=slope * (first.high - first.low),
            plateau_travel=plateau * (first.high - first.low),
            lockstep_us=round(1e6 * period_s) if clock.mode == "lockstep" else None,
            time_tolerance_us=max(LEAST_TIME_TOLERANCE_US, (OLDEST_TIME_PERIODS + delay) * 1e6 * period_s),
            timed=self.check_counter_and_time,
        )
