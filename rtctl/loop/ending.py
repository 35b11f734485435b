"""How a device is left at the end of a run, in a sentence: its last acknowledged command, and whether it is off."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.border.records import DeviceProfile, SwitchedOff


def how_left(
    profile: DeviceProfile, acknowledged: Sequence[float] | None, off: SwitchedOff | None, watchdog_s: float
) -> str:
    """Return how the device was left.

    Args:
        profile: names and units of its commands.
        acknowledged: the last command that it acknowledged before it was to be switched off [its units]; None: none.
        off: what it acknowledged of that; None: the driver does not say.
        watchdog_s: the device's own watchdog [s]; 0: none.
    """
    if off is SwitchedOff.SAFE:
        return (
            "the last command that the device acknowledged is the safe one; that it is switched off, it did not "
            "acknowledge"
        )
    level = "none" if acknowledged is None else _text(profile, acknowledged)
    last = f"the last command that the device acknowledged is {level}"
    if off is SwitchedOff.OFF:
        return f"{last}; then it acknowledged that it is switched off"
    if off is None:
        return f"{last}; whether it is switched off, its driver does not say"
    if acknowledged is None:
        return f"{last}; that it is switched off, it did not acknowledge"
    until = (
        f"until its watchdog trips, {watchdog_s:g} s after its last command" if watchdog_s else "without end"
    )
    not_off = "that it is switched off, it did NOT acknowledge"
    return f"{last}; {not_off}, so it may stay there {until}: switch it off by hand"


def _text(profile: DeviceProfile, levels: Sequence[float]) -> str:
    return ", ".join(
        f"{channel.name} {level:.5g} {channel.unit}".rstrip()
        for channel, level in zip(profile.commands, levels, strict=True)
    )
