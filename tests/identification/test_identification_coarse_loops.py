"""Loops that are too coarse: seen where domains switch as one, not where none does, and learned anew from records."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from coarse_cases import PERIOD_S, TAU_S, dataset, identified, readings, stepped_film

import rtctl.identification.vo2.coarse_loops
from rtctl.identification.vo2.coarse_loops import (
    COARSE_LIMITS,
    MIN_LACK_OF_FIT,
    LoopResolution,
    Samples,
    compute_lack_of_fit,
    find_coarse_loops,
    refit_loop,
)
from rtctl.identification.vo2.heating import simulate_heating

STATES = np.repeat(np.arange(60), 10)


@pytest.fixture(scope="module")
def stepped():
    return stepped_film()


@pytest.fixture(scope="module")
def found(stepped):
    return find_coarse_loops(stepped[1], stepped[0])


def test_noise_at_repeated_states_is_no_lack_of_fit():
    ratios = [compute_lack_of_fit(np.random.default_rng(k).normal(size=600), STATES) for k in range(20)]
    assert 0.9 < np.mean(ratios) < 1.1
    assert max(ratios) < 2.0


def test_what_is_left_alike_at_a_state_is_lack_of_fit():
    offset = np.random.default_rng(1).normal(size=60)[STATES]
    ratio = compute_lack_of_fit(offset + np.random.default_rng(2).normal(size=600), STATES)
    assert ratio == pytest.approx(
        1.0 + 10.0, rel=0.4
    )  # ten readings a state, of as much variance as their noise


def test_too_few_repeated_states_say_nothing():
    assert np.isnan(compute_lack_of_fit(np.ones(100), np.arange(100)))
    assert not np.nan < MIN_LACK_OF_FIT  # so that the finer grid is asked


def test_domains_that_switch_as_one_show_in_the_staircases(found):
    assert set(found) == {"deflection", "resistance"}
    one = found["deflection"]
    assert one.is_coarse
    assert one.share < 0.7
    misfit, low, high = one.misfit
    assert 0.0 < low < misfit < high


@pytest.mark.slow
def test_a_smooth_film_has_no_coarse_loops():
    data = dataset(share=0.0)
    model = identified(data)
    assert find_coarse_loops(model, data) == {}


def test_what_is_finer_but_of_no_size_is_not_told(found):
    one = found["deflection"]
    size = float(one.staircases.y[one.staircases.scored].std())
    (much, little), _ = COARSE_LIMITS
    kept = 0.5 * little * size
    small = one._replace(left=np.full(200, 2.0 * kept), left_finer=np.full(200, kept))
    assert small.share < much
    assert not small._replace(left=np.full(200, 1.02 * kept), left_finer=np.full(200, 0.6 * kept)).is_coarse
    assert small._replace(left=np.full(200, 4.0 * kept)).is_coarse
    uneven = np.where(np.arange(200) < 50, 6.0 * kept, kept)  # of a size that matters, in one block of four
    assert small._replace(left=uneven).misfit[0] > little * size
    assert not small._replace(left=uneven).is_coarse


def test_in_noise_what_is_finer_by_a_little_is_told_if_it_is_of_a_larger_size(found):
    one = found["deflection"]
    size = float(one.staircases.y[one.staircases.scored].std())
    (much, _), (some, least) = COARSE_LIMITS
    share = 0.5 * (much + some)

    def noisy(misfit: float) -> LoopResolution:
        left = misfit * size / np.sqrt(1.0 - share**2)
        return one._replace(left=np.full(200, left), left_finer=np.full(200, share * left))

    assert noisy(1.2 * least).is_coarse
    assert not noisy(0.8 * least).is_coarse
    hidden = noisy(1.2 * least)
    assert not hidden._replace(left_finer=0.5 * (1.0 + some) * hidden.left).is_coarse


def test_without_staircases_nothing_is_known(stepped):
    data, model = stepped
    apart = dataclasses.replace(data, records=tuple(one for one in data.records if one.use != "identify"))
    assert find_coarse_loops(model, apart) == {}


def test_loops_learned_from_records_too_follow_a_record_that_no_fit_saw(stepped, found):
    data, model = stepped
    records = [
        Samples(v, one.signals["deflection"], np.ones(len(v), bool))
        for one in data.used_for("fit")
        for v in [simulate_heating(one.signals["current"], PERIOD_S, TAU_S)]
    ]
    again = refit_loop(found["deflection"], records)
    test = data.used_for("test")[0]
    v = simulate_heating(test.signals["current"], PERIOD_S, TAU_S)
    truth = readings(v, 0.3, seed=77)["deflection"]
    given, finer = (
        np.sqrt(np.mean((read.simulate(v) - truth) ** 2)) for read in (model.deflection_preisach, again)
    )
    assert finer < 0.8 * given
    assert len(again.grid) == len(model.deflection_preisach.grid)


@pytest.mark.parametrize(("together", "first"), [(True, None), (False, 10)])
def test_only_relays_that_switch_together_want_a_first_grid_of_all_cells(found, monkeypatch, together, first):
    monkeypatch.setattr(rtctl.identification.vo2.coarse_loops, "SMOOTH_CELLS", 10)
    fit, tried = rtctl.identification.vo2.coarse_loops.fit_preisach, []

    def watched(*samples, nodes, **options):
        tried.append(len(nodes) - 1)
        return fit(*samples, nodes=nodes, **options)

    monkeypatch.setattr(rtctl.identification.vo2.coarse_loops, "fit_preisach", watched)
    one = found["deflection"]
    refit_loop(one if together else one._replace(finer=one.given, left_finer=one.left), [])
    cells = len(one.given.grid) - 1
    assert tried == [first or cells, cells]


def test_a_read_out_that_is_too_noisy_to_lack_is_asked_where_the_other_one_lacks(stepped):
    data, _ = stepped
    draw = np.random.default_rng(3)
    records = tuple(
        dataclasses.replace(
            one,
            signals=one.signals
            | {"deflection": one.signals["deflection"] + draw.normal(0.0, 3.0, one.samples)},
        )
        for one in data.records
    )
    noisy = dataclasses.replace(data, records=records)
    found = find_coarse_loops(identified(noisy), noisy)
    assert set(found) == {"deflection", "resistance"}
    assert found["resistance"].is_coarse
