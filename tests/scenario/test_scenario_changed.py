"""`rtctl set` holds a change to the range and margins, says what it was from and to, and the picture marks it."""

from __future__ import annotations

import json
import threading
import time
from pathlib import Path

import pytest

import rtctl
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.recording.layout import Rows

SETTINGS = {"clock.mode": "live", "scenario.period": "10 ms", "scenario.duration": "1.5 s"}


class Changed:
    """A live run in a thread, while which changes are asked for."""

    def __init__(self, folder: Path, model: Path) -> None:
        self.folder = folder
        self.outcome: list[rtctl.Run] = []
        self._thread = threading.Thread(
            target=lambda: self.outcome.append(rtctl.run("steps", model=model, settings=SETTINGS, out=folder))
        )
        self._thread.start()
        while self._rows() < 20 and self._thread.is_alive():
            time.sleep(0.01)

    def _rows(self) -> int:
        try:
            return len(Rows(self.folder / "signals.rec"))
        except (OSError, InputError):
            return 0

    def end(self) -> rtctl.Run:
        self._thread.join()
        return self.outcome[0]


def test_a_change_is_judged_told_and_marked(
    tmp_path: Path, model_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed = Changed(tmp_path / "run", model_file)
    told = []
    for change, code in (
        ("setpoint=400 um", 2), ("setpoint=20 um", 0), ("controller.kp=0.5", 2), ("controller.ki=0.2", 0),
        ("setpoint=plan", 0), ("controller.ki=-8", 2),
    ):  # fmt: skip
        assert main(["set", str(changed.folder), change]) == code
        told.append(capsys.readouterr().err)
        time.sleep(0.05)
    assert main(["set", str(changed.folder), "controller.ki=0.1", "--json"]) == 0
    taken = json.loads(capsys.readouterr().out)
    run = changed.end()
    assert "setpoint = 400 um: the model reaches" in told[0]
    assert "um -> 20 um from the next step on" in told[1]
    assert "the loop would be unstable" in told[2]
    assert "-> 0.2 mA/(um*s) from the next step on; gain margin" in told[3]
    assert told[4].startswith("setpoint: 20 um -> the plan")
    assert "controller.ki = -8: is of the other sign than the 0.2" in told[5]
    assert (taken["before"], taken["value"], taken["unit"]) == (0.2, 0.1, "mA/(um*s)")
    texts = [text.get_text() for text in run.plot().subfigs[0].axes[0].texts]
    assert texts == [
        "setpoint 20 µm",
        "controller.ki 0.2 mA/(µm·s)",
        "setpoint: plan",
        "controller.ki 0.1 mA/(µm·s)",
    ]
