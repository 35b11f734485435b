"""A run that is under way, or has ended: its newest values from the recording, changes through its control socket.

The loop does nothing for a reader: the rows come from the file that it records into.
"""

from __future__ import annotations

from pathlib import Path

from rtctl.border.errors import InputError, nearest
from rtctl.loop.live_parameters import SETPOINT
from rtctl.recording.tail import Tail
from rtctl.session.live import control_socket
from rtctl.session.run_folder import SIGNALS

GAIN = "controller."


class RunningLoop:
    """The run that records into a folder."""

    def __init__(self, folder: Path) -> None:
        """Find the recording. Raises InputError where there is none."""
        self.folder = folder
        self._tail = self._opened()
        self._is_open = True

    @property
    def signals(self) -> dict[str, str]:
        """Unit of each recorded signal, by name."""
        return dict(self._tail.header.columns)

    def gains(self) -> dict[str, str]:
        """Return the unit of each gain that the run lets change, by name. Raises InputError, RunError."""
        units = control_socket.parameter_units(self.folder)
        return {
            name: units.get(name, "")
            for name in control_socket.parameters(self.folder)
            if name.startswith(GAIN)
        }

    def read(self, name: str) -> float:
        """Return the newest value of a signal, or a gain as it is set. Raises InputError, RunError."""
        if name.startswith(GAIN):
            values = control_socket.parameters(self.folder)
        else:
            values = self._newest()
        if name not in values:
            raise InputError(f'{self.folder}: the run has no "{name}"{nearest(name, values)}')
        return values[name]

    def change(self, name: str, value: float) -> str:
        """Set the set-point or a gain, in the unit of the run; return what to know of it. Raises InputError, RunError.

        Args:
            name: "setpoint", or a gain such as "controller.kp".
            value: the new value; NaN for the set-point: the plan's again.
        """
        if name != SETPOINT and not name.startswith(GAIN):
            raise InputError(f"{name}: is only read; the set-point and the gains can be set")
        return control_socket.send(self.folder, name, float(value)).remark

    def stop(self) -> None:
        """End the run at its safe levels. Raises InputError, RunError."""
        control_socket.stop(self.folder)

    def close(self) -> None:
        """Close the recording; the run goes on. May be called again."""
        if self._is_open:
            self._tail.close()
        self._is_open = False

    def _newest(self) -> dict[str, float]:
        if self._tail.replaced():
            self._tail.close()
            self._tail = self._opened()
        count = self._tail.look()
        if count == 0:
            raise InputError(f"{self.folder}: the run has taken no sample yet; ask again")
        return {name: float(values[0]) for name, values in self._tail.read(count - 1, count).items()}

    def _opened(self) -> Tail:
        try:
            return Tail(self.folder / SIGNALS)
        except OSError:
            raise InputError(f"{self.folder}: no run is under way here ({SIGNALS} is missing)") from None
