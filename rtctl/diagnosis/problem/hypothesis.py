"""A fitted hypothesis: the nominal model with a set of mechanisms, at its optimum on the records of a problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.simulation_error.sensitivity import Linearisation, Sensitivity
from rtctl.identification.threads import each


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """The nominal model with a set of mechanisms, fitted to the records of a problem."""

    mechanisms: tuple[str, ...]
    """Ids of the mechanisms of the set."""
    simulation: Simulation
    """Simulation at the fitted values."""
    starts: FloatArray
    """Fitted initial states and record parameters (records, states + record parameters), in units."""
    cost: float
    """Half the sum of squared residuals, each over the RMS of its output."""
    sensitivity: Sensitivity
    """Derivatives of the outputs by the fitted parameters."""
    shared: FloatArray
    """Fitted values (p,) of the parameters that all records share, over their scales."""
    fixed_parameters: frozenset[str] = frozenset()
    """Names of parameters that were not fitted: they stay at their defaults, or have no effect on these records."""
    predicted_cost: float = np.inf
    """Cost that one more step would reach if the model were linear: far below `cost` where the fit has not ended."""

    @property
    def values(self) -> FloatArray:
        """All parameters (parameters,) in units; record parameters have the value of the first record."""
        return self.values_of(0)

    def values_of(self, record: int) -> FloatArray:
        """Return all parameters (parameters,) of one record, in units."""
        values = self.sensitivity.values(self.shared)
        values[self.sensitivity.record_parameters] = self.starts[record, self.states :]
        return values

    @property
    def states(self) -> int:
        """Length of an initial state; in `starts` the record parameters come after it."""
        return len(self.simulation.state)

    def start(self, record: int) -> FloatArray:
        """Return the fitted initial state (states,) of one record."""
        return self.starts[record, : self.states]

    def linearise(self, problem: Problem) -> list[Linearisation]:
        """Return the residual and the sensitivities of each record at the optimum.

        Raises:
            ArithmeticError: if the optimum is at the edge of divergence.
        """

        def linearise_record(index: int) -> Linearisation | None:
            return self.sensitivity.linearise(
                problem.records[index], self.shared, self.starts[index], problem.steps_per_period
            )

        linearised = each(problem.executor, linearise_record, range(len(problem.records)))
        complete = [record for record in linearised if record is not None]
        if len(complete) < len(linearised):
            raise ArithmeticError("the fitted model diverges in the neighbourhood of its optimum")
        return complete
