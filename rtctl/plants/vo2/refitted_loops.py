"""Static loops of a VO2 model that are fitted to the records at hand too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.subject import FittedModel, FittedRecords, RefittedParts
from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.identification.vo2.coarse_loops import LoopResolution, Samples, refit_loop
from rtctl.identification.vo2.identify import compute_quality
from rtctl.models.vo2 import Vo2Model
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE, LogReading, without_logarithm
from rtctl.simulations.vo2.simulation import Vo2Simulation


class _RefittedLoops(NamedTuple):
    """Read-outs learned anew, and what showed that it was needed."""

    coarse: Mapping[str, LoopResolution]
    loops: Mapping[str, PreisachModel]

    def __call__(self, simulation: Simulation, /) -> Simulation:
        """Return `simulation` with these read-outs."""
        if isinstance(simulation, LogReading):
            return replace(simulation, plain=self(simulation.plain))
        assert isinstance(simulation, Vo2Simulation)
        return replace(simulation, model=_with_loops(simulation.model, self.coarse, self.loops))


def refit_parts(
    coarse: Mapping[str, LoopResolution],
    hypothesis: FittedModel,
    problem: FittedRecords,
    report: Callable[[str], None],
) -> RefittedParts:
    """Refit the loops to the fitted records too: the loops along their temperatures, less the fit's residual."""
    plain = without_logarithm(hypothesis.simulation)
    assert isinstance(plain, Vo2Simulation)
    samples: dict[str, list[Samples]] = {output: [] for output in coarse}
    names = {"resistance": LOG_RESISTANCE}
    for index, record in enumerate(problem.records):
        values = hypothesis.values_of(index)
        run = hypothesis.simulation.predict(record.stimulus, values, None, problem.steps_per_period)
        for output, found in samples.items():
            name = names.get(output, output)
            if name not in record.measured:
                continue
            path = plain.loop_path(record.stimulus, values, problem.steps_per_period, output)
            off = run.outputs[name][0] - record.measured[name]
            y = np.zeros(len(path.v))
            y[path.sampled] = path.reading + off if output == "resistance" else path.deflection - off
            scored = np.zeros(len(path.v), dtype=bool)
            scored[path.sampled[record.first :]] = True
            found.append(Samples(path.v, y, scored))
    loops = {}
    for output, found in samples.items():
        report(f"the static loops, learned anew: {output}")
        problem.cancellation.raise_if_cancelled()
        loops[output] = refit_loop(coarse[output], found)
    return _RefittedLoops(coarse, loops)


def _with_loops(
    model: Vo2Model, coarse: Mapping[str, LoopResolution], loops: Mapping[str, PreisachModel]
) -> Vo2Model:
    """`model` with other read-outs by output, and what they leave of the staircases."""
    for output, read in loops.items():
        v, y, scored = coarse[output].staircases
        left, name = (y - read.simulate(v))[scored], f"{output}_preisach"
        error = "reading_error" if output == "resistance" else "deflection_error"
        old = model.quality.get(name)
        quality = {} if old is None else {name: compute_quality(left, old.unit, old.range)}
        changed: dict[str, Any] = {
            name: read,
            error: float(left.std()),
            "quality": {**model.quality, **quality},
        }
        model = replace(model, **changed)
    return model
