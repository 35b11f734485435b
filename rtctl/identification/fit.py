"""Result of a fit: values with standard errors, residuals, and which parameters the data do not determine."""

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

AT_LIMIT = (
    "{name} ended at {value:.3g} {unit}, beyond which these samples show nothing: the device answers faster than that, "
    "and of its other values only their ratios to this one are known; sample faster, or write fixed = true beside a "
    "value that you know"
)


class FitError(RunError):
    """Raised where no start value leads to a bounded simulation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A fitted simulation. Its p free parameters stand in the order of `names`."""

    simulation: Simulation
    """The simulation with the fitted values as its own."""
    method: str
    """"output_error" | "multiple_shooting"."""
    free: NDArray[np.intp]
    """Indices into `simulation.parameters`."""
    names: tuple[str, ...]
    values: FloatArray
    """Fitted values (p,), each in its parameter's unit."""
    covariance: FloatArray
    """Covariance (p, p) with the residuals' colour (sandwich); infinite where a parameter is undetermined."""
    initial: FloatArray
    """Initial states (records, states), fitted or given."""
    noise: Mapping[str, NoiseModel]
    """Noise model of each output's residuals."""
    rms: Mapping[str, float]
    """RMS residual of each output over all records, in its unit."""
    record_rms: Mapping[str, Mapping[str, float]]
    """RMS residual of each output by record."""
    status: Status
    iterations: int
    determinability: Determinability
    samples: int
    """Number of scored samples over all outputs."""
    at_limit: tuple[str, ...] = ()
    """Names of the parameters beyond whose values the samples show nothing."""
    residuals: Mapping[str, Mapping[str, FloatArray]]
    """Simulated minus measured, by record and output, from the first scored sample on."""

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors (p,), each in its parameter's unit."""
        errors: FloatArray = np.sqrt(np.diag(self.covariance))
        return errors

    @property
    def correlation(self) -> FloatArray:
        """Correlation matrix (p, p); NaN where a parameter is not determined."""
        with np.errstate(invalid="ignore"):
            found: FloatArray = self.covariance / np.outer(self.standard_errors, self.standard_errors)
        return found

    def describe_doubts(self, *, with_errors: bool = True) -> list[str]:
        """Describe what the data do not determine, how the fit ended, and which parameters are on a bound."""
        said = list(self.determinability.describe(with_intervals=with_errors))
        if self.status != "converged":
            said.append(f"the fit {self.status}" if self.status.startswith("stopped") else str(self.status))
        for k, name in zip(self.free, self.names, strict=True):
            one = self.simulation.parameters[k]
            if one.value in (one.low, one.high):
                said.append(
                    f"{name} ended on its bound, {one.value:g} {one.unit}: the model is short of something, or the "
                    "bound of the model file is too near"
                )
            if name in self.at_limit:
                said.append(AT_LIMIT.format(name=name, value=one.value, unit=one.unit))
        return said
