"""How a search of fits goes, whose number is not known before: stage, elapsed time, share of its work, fits so far.

Where the output is a pipe a line is printed at the first fit of each stage, else now and then, also while one fit or
one test goes on.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rtctl.output.live_line import SOON_S, clock_text

Share = Callable[[], float | None]
"""Returns the share of the work that may be done at most, 0 to 1; None: not known."""
Stage = Callable[[str], str]
"""Returns the stage that a text belongs to; the text itself where it names one."""
EVERY_S = 15.0
"""Time between two lines of one stage in a pipe [s]."""
LEAST_TOLD = 0.01
"""Share of the work below which nothing is told: it reads as 0 %."""
LEAST_SHARE = 0.02
"""Share of the work from which the remaining time is told: before, it is hardly known."""


class Lasting(str):
    """Text that stays on the screen beside what is under way."""

    __slots__ = ()


@dataclass(slots=True)
class FitLines:
    """Lines on a search, for a pipe."""

    title: str
    share: Share
    stage_of: Stage
    print_line: Callable[[str], None]
    clock: Callable[[], float] = time.monotonic
    _begun_s: float = field(init=False)
    _last_s: float = field(init=False)
    _fits: int = 0
    _stage: str = ""
    _seen: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._begun_s = self._last_s = self.clock()

    def show(self, text: str) -> None:
        """Hear of what is under way, and print a line if one is due."""
        stage, now_s = self.stage_of(text), self.clock()
        self._fits += stage != text
        self._stage = self._stage if isinstance(text, Lasting) else stage
        if stage in self._seen and now_s - self._last_s < EVERY_S:
            return
        self._seen.add(stage)
        self._last_s = now_s
        elapsed_s = now_s - self._begun_s
        said = [f"{self.title}: {clock_text(elapsed_s)}", stage]
        said += [f"{self._fits} fits so far"] if self._fits > 1 else []
        said += work_texts(elapsed_s, self.share()) if stage != text else []
        self.print_line(", ".join(said))

    def remind(self) -> None:
        """Print a line if none was for long: what is under way still is. Called from another thread."""
        now_s = self.clock()
        if self._stage and now_s - self._last_s >= EVERY_S:
            self._last_s = now_s
            self.print_line(f"{self.title}: {clock_text(now_s - self._begun_s)}, still at {self._stage}")


@contextmanager
def reminded(lines: FitLines) -> Iterator[None]:
    """Print a line now and then while nothing is heard."""
    done = threading.Event()

    def watch() -> None:
        while not done.wait(EVERY_S / 3.0):
            lines.remind()

    thread = threading.Thread(target=watch, daemon=True, name="progress")
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def work_texts(elapsed_s: float, share: float | None) -> list[str]:
    """Return the share of the work budget, and the time that the rest of it takes; nothing where it is not known."""
    if share is None or not share >= LEAST_TOLD:
        return []
    if share >= 1.0:
        return ["the work budget is used up: the last comparisons"]
    said = [f"{share:.0%} of the work budget"]
    if elapsed_s >= SOON_S and share >= LEAST_SHARE:
        said.append(f"about {clock_text(elapsed_s * (1.0 - share) / share)} for the rest")
    return said
