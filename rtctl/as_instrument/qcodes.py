"""A running loop as an instrument of QCoDeS: set-point and gains are set, all recorded signals are read."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from qcodes.instrument import Instrument

from rtctl.as_instrument.running_loop import GAIN, RunningLoop
from rtctl.loop.live_parameters import SETPOINT
from rtctl.version import __version__


class LoopInstrument(Instrument):  # type: ignore[misc, unused-ignore]
    """The run that records into a folder; its signals and gains (`kp`, `ki`, ...) are parameters."""

    def __init__(self, name: str, run: str | Path) -> None:
        """Attach to a run that is under way.

        Args:
            name: of the instrument in QCoDeS.
            run: folder into which the run records, its `--out`.

        Raises:
            InputError: no run is under way there.
        """
        loop = RunningLoop(Path(run))
        gains = loop.gains()
        super().__init__(name)
        self.loop = loop
        for signal, unit in loop.signals.items():
            setter = partial(loop.change, SETPOINT) if signal == SETPOINT else False
            self.add_parameter(signal, unit=unit, get_cmd=partial(loop.read, signal), set_cmd=setter)
        for gain, unit in gains.items():
            self.add_parameter(
                gain.removeprefix(GAIN),
                unit=unit,
                get_cmd=partial(loop.read, gain),
                set_cmd=partial(loop.change, gain),
            )

    def get_idn(self) -> dict[str, str | None]:
        """Return what identifies the instrument."""
        return {"vendor": "rtctl", "model": "loop", "serial": str(self.loop.folder), "firmware": __version__}

    def close(self) -> None:
        """Detach; the run goes on."""
        self.loop.close()
        super().close()
