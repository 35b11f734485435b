"""What a worker may meet, for the tests of workers: a module, as each worker imports it anew."""

from __future__ import annotations

import os
import signal
from typing import Any

Line = dict[str, Any]


def run(task: Line, report: Any) -> Line:
    """Ends as the task says."""
    report("diagnose", {"kind": "single", "truth": ["drive.lag"]})
    match task["ends"]:
        case "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        case "for ever":
            while True:
                pass
        case "too much memory":
            try:
                bytearray(3 * 2**30)
            except MemoryError:
                return task | {"answer": "no memory"}
    return task | {"answer": "done"}
