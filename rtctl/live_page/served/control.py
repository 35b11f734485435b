"""Changes of the run that a viewer sees: set-point, gains, stop, through the control socket of its folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.mechanisms import plain_unit
from rtctl.live_page.recorded.places import Place, newest_of, places_in
from rtctl.loop.live_parameters import STOP
from rtctl.output.readable_units import printed_unit
from rtctl.session.live.control_socket import parameter_units, parameters, read_change, send, stop

LARGEST_REQUEST = 4096
"""Bytes of a change at most."""


def change(folder: Path, request: Any) -> str:
    """Make a change of a run in the watched folder; return what was changed in words.

    Args:
        folder: the watched folder.
        request: {"run": name, "name": parameter or "stop", "value": text with or without a unit}.

    Raises:
        InputError: it is no such request, no run is under way, or the run refuses it.
        RunError: the run does not answer.
    """
    if not isinstance(request, Mapping) or not isinstance(request.get("name"), str):
        raise InputError('a change is {"run": ..., "name": ..., "value": ...}')
    name, place = request["name"], _place(folder, str(request.get("run", "")))
    if name == STOP:
        stop(place.folder)
        return "stop: the run ends at its safe levels"
    value = str(request.get("value", "")).strip()
    if not value:
        raise InputError(f"{name}: the field is empty; give a number, with or without its unit")
    asked = read_change(place.folder, f"{name}={value}")
    return send(place.folder, asked.name, asked.value).in_words()


def changeable(folder: Path, name: str) -> list[dict[str, Any]]:
    """Return name, unit and value of each parameter that a run can change; None: a value that is not known.

    Raises:
        InputError: no run is under way.
        RunError: the run does not answer.
    """
    place = _place(folder, name)
    values, units = parameters(place.folder), parameter_units(place.folder)
    known = [one for one in units if one in values or one == "setpoint"]
    return [
        {"name": one, "unit": printed_unit(plain_unit(units[one])), "value": values.get(one)} for one in known
    ]


def _place(folder: Path, name: str) -> Place:
    places = [place for place in places_in(folder) if place.record is None]
    found = [place for place in places if place.name == name] if name else places
    place = newest_of(found)
    if place is None:
        raise InputError(f"{folder}: no run is under way here")
    return place
