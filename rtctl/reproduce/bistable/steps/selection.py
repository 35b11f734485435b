"""Selection of terms: cross-validation and information criteria, as the paper's outlook suggests."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.regression.streaming_gram import COLUMNS
from rtctl.identification.regression.weak_form import BUMPS_PER_HALF_WIDTH
from rtctl.reproduce.bistable.collected import HALF_WIDTH_S, Collected, collected
from rtctl.reproduce.bistable.regression import CUBIC, QUINTIC, least_squares, squared_error
from rtctl.reproduce.bistable.steps.local_fit import kept
from rtctl.reproduce.study import Comparison, Row, Run, Section, Table

THRESHOLD = 1e-3
"""Contribution of a term relative to the acceleration's RMS, below which it is dropped."""
CANDIDATES = (
    ("v", "z"),
    CUBIC,
    QUINTIC,
    (*QUINTIC, "z^7"),
    (*QUINTIC, "z^2"),
    (*QUINTIC, "1"),
    (*QUINTIC, "z^2 v"),
    (*QUINTIC, "abs(v) v"),
    (*QUINTIC, "sign v"),
    (*QUINTIC, "z^7", "z^2", "1", "z^2 v", "abs(v) v", "sign v"),
)


class Scored(NamedTuple):
    """Scores of a candidate."""

    terms: tuple[str, ...]
    left: float
    """Residual share of the acceleration's square on records it was fitted to, and on the others."""
    crossed: float
    spread: float
    """Standard error of `crossed` over the folds."""
    aic: float
    bic: float


def scored(grams: FloatArray, fold: NDArray[np.int64], independent: float) -> list[Scored]:
    """Score every candidate.

    Args:
        grams: (records, 11, 11) Gram matrices.
        fold: (records,) which records are left out together.
        independent: Number of independent rows.
    """
    total = grams.sum(axis=0)
    power = float(total[0, 0])
    folds = [grams[fold == number].sum(axis=0) for number in np.unique(fold)]
    errors = np.array(
        [
            [squared_error(out, least_squares(total - out, terms)) for out in folds]
            for terms in CANDIDATES
        ]
    ) / np.array([out[0, 0] for out in folds])  # fmt: skip
    means = errors.mean(axis=1)
    spreads = errors.std(axis=1, ddof=1) / np.sqrt(len(folds))
    marks = []
    for terms, crossed, spread in zip(CANDIDATES, means.tolist(), spreads.tolist(), strict=True):
        left = squared_error(total, least_squares(total, terms)) / power
        misfit = independent * float(np.log(left))
        size = len(terms)
        marks.append(
            Scored(
                terms, left, crossed, spread, misfit + 2.0 * size, misfit + size * float(np.log(independent))
            )
        )
    return marks


def by_one_error(marks: list[Scored]) -> Scored:
    """Return the smallest model within one standard error of the best (Hastie, Tibshirani, Friedman, section 7.10)."""
    best = min(marks, key=lambda mark: mark.crossed)
    near = (mark for mark in marks if mark.crossed <= best.crossed + best.spread)
    return min(near, key=lambda mark: len(mark.terms))


def sparse(gram: FloatArray) -> tuple[str, ...]:
    """Fit by sequentially thresholded least squares: terms below `THRESHOLD` of the acceleration are dropped."""
    terms: tuple[str, ...] = COLUMNS[1:]
    while True:
        fit = least_squares(gram, terms)
        share = {
            term: abs(fit.coefficient(term)) * float(np.sqrt(gram[k, k] / gram[0, 0]))
            for k, term in enumerate(COLUMNS) if term in terms
        }  # fmt: skip
        left = tuple(term for term in terms if share[term] >= THRESHOLD)
        if left == terms or not left:
            return terms
        terms = left


def selection(run: Run) -> Section:
    """Return the section: leave out one frequency at a time, on the weak form's rows and on the filter's."""
    found = collected(run)
    chosen = kept(found)
    fold = np.unique(found.frequency_hz[chosen], return_inverse=True)[1]
    both = {
        "weak form": scored(found.weak[chosen], fold, _bumps(found) / BUMPS_PER_HALF_WIDTH),
        "filter": scored(found.filtered[chosen], fold, _bumps(found) / BUMPS_PER_HALF_WIDTH),
    }
    tables = tuple(_table(name, marks) for name, marks in both.items())
    rows = []
    for name, marks in both.items():
        chosen_ones = {
            "least error in cross-validation": min(marks, key=lambda mark: mark.crossed),
            "one standard error from it": by_one_error(marks),
            "AIC": min(marks, key=lambda mark: mark.aic),
            "BIC": min(marks, key=lambda mark: mark.bic),
        }
        rows += [
            Row(quantity=f"{name}, {rule}: number of terms", unit="", paper=None, ours=len(mark.terms),
                note=f"{', '.join(mark.terms)}; the truth has 4")
            for rule, mark in chosen_ones.items()
        ]  # fmt: skip
    for name, grams in (("weak form", found.weak), ("filter", found.filtered)):
        terms = sparse(grams[chosen].sum(axis=0))
        rows.append(
            Row(quantity=f"{name}, sparse regression from ten terms: number of terms", unit="", paper=None,
                ours=len(terms), note=", ".join(terms))
        )  # fmt: skip
    return Section(
        title="Model choice",
        text="The paper's outlook asks for cross-validation and information criteria. One frequency at a time "
        "is left out, "
        "all its records with it: records of one frequency are nearly repeats, and leaving out single ones "
        "would flatter "
        "every model. The criteria take as many independent rows as bumps of the weak form fit beside each "
        "other. Where "
        "the regression itself is biased the criteria cannot know: they judge how well its rows are described.",
        parts=(Comparison(title="Chosen models", rows=tuple(rows)), *tables),
    )


def _bumps(found: Collected) -> float:
    """Return the number of bumps of all records that are kept."""
    records = int(kept(found).sum())
    return records * found.campaign.record_s / HALF_WIDTH_S * BUMPS_PER_HALF_WIDTH


def _table(name: str, marks: list[Scored]) -> Table:
    least_aic, least_bic = min(mark.aic for mark in marks), min(mark.bic for mark in marks)
    return Table(
        title=f"Candidates, {name}",
        headers=("terms", "left", "left on other frequencies", "AIC above least", "BIC above least"),
        rows=tuple(
            (", ".join(mark.terms), f"{mark.left:.3g}", f"{mark.crossed:.4g}", f"{mark.aic - least_aic:.1f}",
             f"{mark.bic - least_bic:.1f}")
            for mark in marks
        ),
        numbers=(1, 2, 3, 4),
    )  # fmt: skip
