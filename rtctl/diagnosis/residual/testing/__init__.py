"""Statistical tests of the residual of a fitted hypothesis, each a function of its own."""

from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis, analyse_residual
from rtctl.diagnosis.residual.testing.direction_tests import (
    run_catalogue_test,
    run_generic_force_test,
    run_single_mechanism_test,
)
from rtctl.diagnosis.residual.testing.growth import run_growth_test
from rtctl.diagnosis.residual.testing.memory import run_memory_test
from rtctl.diagnosis.residual.testing.repeats import run_repeats_test
from rtctl.diagnosis.residual.testing.result import ResidualTest

__all__ = [
    "ResidualAnalysis",
    "ResidualTest",
    "analyse_residual",
    "run_catalogue_test",
    "run_generic_force_test",
    "run_growth_test",
    "run_memory_test",
    "run_repeats_test",
    "run_single_mechanism_test",
]
