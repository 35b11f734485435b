"""Runs of a functional mock-up unit from its start: parameters and inputs in, outputs at each communication point out.

The three functions that are called at each point are called by their addresses: through FMPy's objects, which build
arrays anew at each call, a record took five times as long.
"""

from __future__ import annotations

import ctypes
import logging
import shutil
import tempfile
import threading
import weakref
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plant_sim.fmu.unit import Unit, read_unit
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.work import count_work

_log = logging.getLogger(__name__)
WARNING = 1
"""Largest status of a call that went well."""
FATAL = 4
WORK = 64
"""Work that a communication point counts for, in steps of equations: it takes the time of about so many."""
_POINTER, _SIZE, _DOUBLE = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_double
_ARRAY_2 = ctypes.PYFUNCTYPE(ctypes.c_int, _POINTER, _POINTER, _SIZE, _POINTER)
_STEP_2 = ctypes.PYFUNCTYPE(ctypes.c_int, _POINTER, _DOUBLE, _DOUBLE, ctypes.c_int)
_SLOPES_2 = ctypes.PYFUNCTYPE(ctypes.c_int, _POINTER, _POINTER, _SIZE, _POINTER, _POINTER)
_ARRAY_3 = ctypes.PYFUNCTYPE(ctypes.c_int, _POINTER, _POINTER, _SIZE, _POINTER, _SIZE)
_STEP_3 = ctypes.PYFUNCTYPE(
    ctypes.c_int, _POINTER, _DOUBLE, _DOUBLE, ctypes.c_bool, _POINTER, _POINTER, _POINTER, _POINTER
)


class Course(NamedTuple):
    """What is done to a unit at the communication points of a run."""

    step_s: float
    """Communication step [s]."""
    inputs: FloatArray
    """Inputs (steps, inputs) during each step, in the unit's units."""
    slopes: FloatArray
    """Their rates (steps, inputs) during each step [per s]; used where the unit takes them."""
    last: FloatArray
    """Inputs (inputs,) after the last step."""
    moving: tuple[int, ...] = ()
    """References of parameters that are set at each step."""
    values: FloatArray = np.empty((0, 0))
    """Their values (steps, moving) without what depends on outputs."""
    by_outputs: FloatArray = np.empty((0, 0))
    """What is added to them for each output (moving, outputs), per unit of the output at the point before."""
    seen: tuple[int, ...] = ()
    """References of further variables that are read, after the outputs."""
    looks_after: bool = False
    """Whether outputs are also read just after the inputs jump."""


class Outputs(NamedTuple):
    """Outputs and further variables (points, outputs + seen) at the communication points; NaN once it failed."""

    before: FloatArray
    """With the inputs as they are just before a point."""
    after: FloatArray
    """With those just after it."""


class UnitRuns:
    """An instance of a unit that begins anew for each run; calls from several threads wait for each other."""

    def __init__(self, unit: Unit) -> None:
        """Unpack the unit. Raises InputError where it does not start."""
        import fmpy

        self.unit = unit
        self.is_3 = unit.description.fmiVersion == "3.0"
        self._lock = threading.Lock()
        self._heard: set[str] = set()
        folder = tempfile.mkdtemp(prefix="rtctl-fmu-")
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._folder = fmpy.extract(str(unit.path), folder)
        self._slave: Any = None
        names = {one.name: one.valueReference for one in unit.description.modelVariables}
        slopes = [names.get(f"{one.name}_slope") for one in unit.inputs]
        own = str(unit.description.generationTool or "").startswith("rtctl")
        self._slope_references = slopes if own and None not in slopes else []
        interpolates = getattr(unit.description.coSimulation, "canInterpolateInputs", False)
        self._derives = bool(interpolates and not self.is_3 and not self._slope_references)
        self._in, self._out = ([one.reference for one in some] for some in (unit.inputs, unit.outputs))
        with self._lock:
            self._instantiate()

    @property
    def takes_slopes(self) -> bool:
        """Whether an input may go on in a straight line within a communication step."""
        return bool(self._slope_references) or self._derives

    def run(self, start: Mapping[int, float], course: Course) -> Outputs:
        """Return the outputs of a run from the start of the unit, with some parameters (by reference) set before it."""
        count_work(WORK * len(course.inputs))
        with self._lock:
            points = (len(course.inputs) + 1, len(self._out) + len(course.seen))
            made = Outputs(np.full(points, np.nan), np.full(points, np.nan))
            try:
                self._begin(start, course)
            except Exception as error:  # the unit's own code: anything
                _log.debug("%s: the unit does not start: %s", self.unit.path, error)
                if getattr(error, "status", FATAL) >= FATAL:  # else a reset brings it back
                    self._instantiate()
                return made
            if self._march(course, made) >= FATAL:
                self._instantiate()
            return made

    def _instantiate(self) -> None:
        import fmpy

        try:
            self._slave = fmpy.instantiate_fmu(
                self._folder, self.unit.description, "CoSimulation", logger=self._hear
            )
        except Exception as error:  # the unit's own code: anything
            raise InputError(f"{self.unit.path}: the unit does not start: {error}") from None
        self._fresh = True
        kinds = (_ARRAY_3, _STEP_3) if self.is_3 else (_ARRAY_2, _STEP_2)
        names = ("fmi3SetFloat64", "fmi3GetFloat64", "fmi3DoStep") if self.is_3 else (
            "fmi2SetReal", "fmi2GetReal", "fmi2DoStep",
        )  # fmt: skip
        self._set, self._get = (self._function(name, kinds[0]) for name in names[:2])
        self._step = self._function(names[2], kinds[1])
        self._derive: Any = (
            self._function("fmi2SetRealInputDerivatives", _SLOPES_2) if self._derives else None
        )

    def _hear(self, *words: Any) -> None:
        """Note what the unit says; each sentence is told once, as a fit may hear it a thousand times."""
        said = words[-1].decode(errors="replace") if isinstance(words[-1], bytes) else str(words[-1])
        if said not in self._heard:
            self._heard.add(said)
            _log.warning("%s: the unit says: %s", self.unit.path, said)

    def _function(self, name: str, kind: Any) -> Any:
        address = ctypes.cast(getattr(self._slave.dll, name), ctypes.c_void_p).value
        return kind(address)

    def _begin(self, start: Mapping[int, float], course: Course) -> None:
        if not self._fresh:
            try:
                self._slave.reset()
            except Exception:  # it cannot be used any more
                self._instantiate()
        self._fresh, slave = False, self._slave
        put = slave.setFloat64 if self.is_3 else slave.setReal
        if not self.is_3:
            slave.setupExperiment(startTime=0.0)
        if start:
            put(list(start), list(start.values()))
        if self.is_3:
            slave.enterInitializationMode(startTime=0.0)
        else:
            slave.enterInitializationMode()
        put(self._in, (course.inputs[0] if len(course.inputs) else course.last).tolist())
        slave.exitInitializationMode()

    def _march(self, course: Course, made: Outputs) -> int:
        """Fill `made`; return the worst status of a call."""
        component, more_in, more_out = self._slave.component, (), ()
        if isinstance(component, ctypes.c_void_p):
            component = component.value
        slopes = self._slope_references if self._slope_references and course.slopes.any() else []
        set_references = np.array([*self._in, *slopes, *course.moving], dtype=np.uint32)
        get_references = np.array([*self._out, *course.seen], dtype=np.uint32)
        rates = [course.slopes] if slopes else []
        moving = [course.values] if course.moving else []
        rows = np.ascontiguousarray(np.hstack([course.inputs, *rates, *moving]))
        given, read = len(set_references), len(get_references)
        if self.is_3:
            more_in, more_out = (given,), (read,)  # type: ignore[assignment]
        into, out_of = set_references.ctypes.data, get_references.ctypes.data
        at, before, after = rows.ctypes.data, made.before.ctypes.data, made.after.ctypes.data
        set_real, get_real, do_step, step_s = self._set, self._get, self._step, course.step_s
        flags = np.zeros(4)
        rest = (True, *(flags.ctypes.data + 8 * k for k in range(4))) if self.is_3 else (1,)
        worst = get_real(component, out_of, read, before, *more_out)
        for k in range(len(rows)):
            if course.by_outputs.size:
                rows[k, given - len(course.moving) :] += course.by_outputs @ made.before[k, : len(self._out)]
            status = set_real(component, into, given, at + 8 * given * k, *more_in)
            if self._derive is not None:
                status |= self._derive_inputs(component, course.slopes[k])
            if course.looks_after:
                status |= get_real(component, out_of, read, after + 8 * read * k, *more_out)
            if status <= WARNING:
                status |= do_step(component, k * step_s, step_s, *rest)
            if status <= WARNING:
                status |= get_real(component, out_of, read, before + 8 * read * (k + 1), *more_out)
            if status > WARNING:
                made.before[k + 1 :], made.after[k:] = np.nan, np.nan
                return int(max(worst, status))
        if course.looks_after:
            last = np.ascontiguousarray(course.last)
            more = (len(last),) if self.is_3 else ()
            worst |= set_real(component, into, len(last), last.ctypes.data, *more)
            worst |= get_real(component, out_of, read, after + 8 * read * len(rows), *more_out)
        return int(worst)

    def _derive_inputs(self, component: Any, slopes: FloatArray) -> int:
        """Tell a unit of FMI 2.0 the rates (inputs,) of its inputs during the next step; return the status."""
        references, order = np.array(self._in, dtype=np.uint32), np.ones(len(self._in), dtype=np.int32)
        rates = np.ascontiguousarray(slopes)
        return int(
            self._derive(component, references.ctypes.data, len(rates), order.ctypes.data, rates.ctypes.data)
        )


@lru_cache(maxsize=8)
def _runs(path: Path, changed: int) -> UnitRuns:
    return UnitRuns(read_unit(path))


def runs_of(path: Path) -> UnitRuns:
    """Return the instance of a unit in this process. Raises InputError."""
    try:
        changed = path.stat().st_mtime_ns
    except OSError:
        raise InputError(f"{path}: there is no such file") from None
    return _runs(path, changed)
