"""Amounts of work of a diagnosis, in simulated steps: lanes x samples x integration steps a sample."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetThresholds:
    """How much a diagnosis may simulate [steps].

    Work also counts what whitening and linear algebra cost, in steps. One step takes 8 to 37 ns of one core (single
    effects of the blind generator, on two machines), so the default budget of a whole search takes about 40 to 180 s;
    the seconds of the other rows are those of 14 ns a step.
    """

    search: float = 4800e6
    """Work [steps] of the whole search, after which no further fit begins: about 40 to 180 s. Half of it left five of
    111 blind cases without an answer, or with part of one."""
    overrun: float = 1080e6
    """Work [steps] by which the last comparisons may exceed the search's budget: about 15 s."""
    least_comparison: float = 220e6
    """Work [steps] that a comparison gets even when the budget is used up: about 3 s."""
    first_look: float = 1440e6
    """Work [steps] of the search for a cause that acts beside static loops that are too coarse: about 20 s."""
    rivals: float = 580e6
    """Work [steps] of the refit of rival sets beside an accepted one, and of slow mechanisms' fits to all samples:
    about 8 s."""
    longer_parts: float = 2400e6
    """Work [steps] of a search in longer parts of the records, beside causes that explain shorter ones: about 33 s."""
    followed: float = 1080e6
    """Work [steps] of the fits of causes that the tests of the best set point to, where none passes: about 15 s."""
    nonparametric: float = 1440e6
    """Work [steps] of the comparison with nonparametric alternatives: about 20 s, most of it for a delayed force."""
    refit_twice: float = 1800e6
    """Work [steps] that must be left for the loops to be refitted behind a smaller set first: about 25 s."""
    one_run: float = 145e6
    """Work [steps] of one free run over all records to fit, above which the model is refused: a
    fit takes some hundred."""
    simulated_share: float = 0.5
    """Share of a whole search's work that takes as long a step as an evaluation of the nominal model [–]."""
    other_step_s: float = 29e-9
    """Time of a step [s] of the rest, which is whitening and linear algebra: 492 million took 14.3 s (the Silverbox,
    whose simulated steps take 6e-9 s; it was told 33 s, and took 112)."""
    timed_evaluations: int = 3
    """Number of evaluations of the fitted nominal model that are timed, to tell how long a search takes; the shortest
    counts [–]."""
    evaluations_of_one: float = 2200.0
    """Number of such evaluations that a search takes, page and pictures included, where one cause explains the data:
    the middle of 1574 and 3116 (blind oscillators 5201 and 5203) [–]."""
    evaluations_of_two: float = 12000.0
    """The same where it takes two: 12863 and 11049 (5202 and 5204) [–]. An evaluation of two causes costs twice the
    nominal one, and sets of two follow all sets of one."""
