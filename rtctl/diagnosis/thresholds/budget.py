"""Amounts of work of a diagnosis, in simulated steps: lanes x samples x integration steps a sample."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetThresholds:
    """How much a diagnosis may simulate [steps].

    Work also counts what whitening and linear algebra cost, in steps. One step takes 17 to 37 ns of one core (measured
    on single effects of the blind generator), so 36 million steps are about a second.
    """

    search: float = 2400e6
    """Work [steps] of the whole search, after which no further fit begins: about 66 s, so that what is
    under way then and the answer are done by 90 s."""
    overrun: float = 540e6
    """Work [steps] by which the last comparisons may exceed the search's budget: about 15 s."""
    least_comparison: float = 110e6
    """Work [steps] that a comparison gets even when the budget is used up: about 3 s."""
    first_look: float = 720e6
    """Work [steps] of the search for a cause that acts beside static loops that are too coarse: about 20 s."""
    rivals: float = 290e6
    """Work [steps] of the refit of rival sets beside an accepted one: about 8 s."""
    nonparametric: float = 720e6
    """Work [steps] of the comparison with nonparametric alternatives: about 20 s, most of it for a delayed force."""
    refit_twice: float = 900e6
    """Work [steps] that must be left for the loops to be refitted behind a smaller set first: about 25 s."""
    one_run: float = 145e6
    """Work [steps] of one free run over all records to fit, above which the model is refused: a
    fit takes some hundred."""
