"""A fitted hypothesis: the nominal model with a set of mechanisms, at its optimum on the records of a problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.simulation_error.sensitivity import Linearisation, Sensitivity


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """A fitted one: `cost` is half the sum of squares over `sigma`."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    """At the fitted values."""
    starts: FloatArray
    """(records, states and own parameters): fitted, in units."""
    cost: float
    sensitivity: Sensitivity
    shared: FloatArray
    """Fitted parameters, scaled."""
    still: frozenset[str] = frozenset()
    """Names of parameters that were not fitted: at their defaults, or without effect on these records."""
    promised: float = np.inf
    """The cost after one more step, were the model linear: far below `cost` where the fit was not done."""

    @property
    def values(self) -> FloatArray:
        """All parameters (parameters,) in units; of those that each record has for itself, the first one's."""
        return self.values_of(0)

    def values_of(self, record: int) -> FloatArray:
        """All parameters (parameters,) of one record."""
        values = self.sensitivity.values(self.shared)
        values[self.sensitivity.record_parameters] = self.starts[record, self.states :]
        return values

    @property
    def states(self) -> int:
        """Length of an initial state, which a record's own parameters follow in `starts`."""
        return len(self.simulation.state)

    def start(self, record: int) -> FloatArray:
        """Fitted initial state (states,) of one record."""
        return self.starts[record, : self.states]

    def linearise(self, problem: Problem) -> list[Linearisation]:
        """Residual and slopes of each record; raises ArithmeticError where the optimum is on the edge of divergence."""

        def one(index: int) -> Linearisation | None:
            return self.sensitivity.linearise(
                problem.records[index], self.shared, self.starts[index], problem.steps_per_period
            )

        indices = range(len(problem.records))
        made = list(problem.executor.map(one, indices)) if problem.executor else [one(k) for k in indices]
        whole = [found for found in made if found is not None]
        if len(whole) < len(made):
            raise ArithmeticError("the fitted model diverges in the neighbourhood of its optimum")
        return whole
