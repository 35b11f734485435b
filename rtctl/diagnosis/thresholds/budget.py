"""Amounts of work of a diagnosis, in simulated steps: lanes x samples x integration steps a sample."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetThresholds:
    """How much a diagnosis may simulate [steps]; a step took about 10 ns on the machine of the measurements."""

    search: float = 66e8
    """Work of the whole search, after which no further fit begins."""
    overrun: float = 15e8
    """Work by which the last comparisons may exceed the search's budget."""
    least_comparison: float = 3e8
    """Work that a comparison gets even when the budget is used up."""
    first_look: float = 20e8
    """Work of the search for a cause that acts beside static loops that are too coarse."""
    rivals: float = 8e8
    """Work of the refit of rival sets beside an accepted one."""
    nonparametric: float = 20e8
    """Work of the comparison with nonparametric alternatives."""
    refit_twice: float = 25e8
    """Work that must be left for the loops to be refitted behind a smaller set first."""
    one_run: float = 4e8
    """Work of one free run over all records to fit, above which the model is refused: a fit takes some hundred."""
