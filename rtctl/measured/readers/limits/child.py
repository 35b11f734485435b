"""The process that reads for `limited`: requests on standard input, answers on standard output, both pickled."""

from __future__ import annotations

import importlib
import math
import os
import pickle
import resource
import traceback
from pathlib import Path
from typing import IO, Any

import numpy as np

from rtctl.measured.readers.limits.limited import DONE, FAILED, NO_MEMORY, REFUSED, Opening, Request
from rtctl.measured.readers.table import Table

_LONGEST_S = 1e7


def main() -> None:
    """Answer requests until the input ends."""
    requests, answers = _streams()
    _limit_memory()
    tables: dict[tuple[str, Path], Table] = {}
    while True:
        try:
            request = pickle.load(requests)
        except EOFError:
            return
        answer = _answer(request, tables)
        try:
            content = pickle.dumps(answer, protocol=pickle.HIGHEST_PROTOCOL)
        except Exception:  # objects of a library that are no data
            content = pickle.dumps((FAILED, traceback.format_exc()))
        answers.write(content)
        answers.flush()


def _answer(request: Request, tables: dict[tuple[str, Path], Table]) -> tuple[int, Any]:
    importlib.import_module(request.module)  # which may take long on a slow disk
    _limit_time(request.cpu_s)
    try:
        return DONE, _answered(request, tables)
    except MemoryError:
        return REFUSED, NO_MEMORY
    except OSError as error:  # the file is gone
        return REFUSED, f"cannot be read: {error.strerror or error}"
    except ValueError as error:
        return REFUSED, str(error)
    except Exception:
        return FAILED, traceback.format_exc()


def _answered(request: Request, tables: dict[tuple[str, Path], Table]) -> Any:
    key = request.module, request.path
    if not request.column or key not in tables:  # the child that opened it may be gone
        tables[key] = importlib.import_module(request.module).read(request.path)
    table = tables[key]
    if not request.column:
        return Opening(
            dict(table.columns), table.piecewise, table.remarks, dict(table.places), dict(table.texts),
            dict(table.beside),
        )  # fmt: skip
    return np.ascontiguousarray(table.load(request.column, request.first, request.end))


def _streams() -> tuple[IO[bytes], IO[bytes]]:
    """Return standard input and output for requests; what libraries print goes nowhere."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):
        os.dup2(nowhere, stream)
    return requests, answers


def _limit_memory() -> None:
    """Allow as much memory more as is free."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    free = next(
        int(line.split()[1]) << 10
        for line in Path("/proc/meminfo").read_text().splitlines()
        if line.startswith("MemAvailable")
    )
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = pages * resource.getpagesize() + free
    resource.setrlimit(
        resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard)
    )
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _limit_time(cpu_s: float) -> None:
    """Allow processor time for the next request; beyond it the kernel ends this process (SIGXCPU)."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    limit = math.ceil(min(used.ru_utime + used.ru_stime + cpu_s, _LONGEST_S))
    resource.setrlimit(
        resource.RLIMIT_CPU, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard)
    )


if __name__ == "__main__":
    main()
