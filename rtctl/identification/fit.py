"""What a fit found: values with honest errors, what is left, and what the data could not tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import RunError
from rtctl.border.simulation import Simulation
from rtctl.identification.least_squares.determinability import Determinability
from rtctl.identification.least_squares.levenberg_marquardt import Status
from rtctl.identification.noise.residual_noise import NoiseModel


class FitError(RunError):
    """No start led anywhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A fitted simulation. Free parameters in the order of `names`; p of them."""

    simulation: Simulation
    """With the fitted values as its own."""
    method: str
    """"output_error" | "multiple_shooting"."""
    free: NDArray[np.intp]
    """Indices into `simulation.parameters`."""
    names: tuple[str, ...]
    values: FloatArray
    """(p,)"""
    covariance: FloatArray
    """(p, p): with the residuals' colour (sandwich); infinite where the data do not determine a parameter."""
    initial: FloatArray
    """(records, states): initial states that were fitted, or given."""
    noise: Mapping[str, NoiseModel]
    """Of each output's residuals."""
    rms: Mapping[str, float]
    """Of each output's residuals, all records."""
    record_rms: Mapping[str, Mapping[str, float]]
    """The same a record."""
    status: Status
    iterations: int
    determinability: Determinability
    samples: int
    """Scored, all outputs."""
    residuals: Mapping[str, Mapping[str, FloatArray]]
    """Of each record and output, simulated - measured from the first scored sample on."""

    @property
    def standard_errors(self) -> FloatArray:
        """(p,)"""
        errors: FloatArray = np.sqrt(np.diag(self.covariance))
        return errors

    @property
    def correlation(self) -> FloatArray:
        """(p, p); NaN where a parameter is not determined."""
        with np.errstate(invalid="ignore"):
            found: FloatArray = self.covariance / np.outer(self.standard_errors, self.standard_errors)
        return found
