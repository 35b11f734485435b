"""A dataset to a model: what has a say and what has none, one bad dataset after the other, devices as a whole."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from vo2_cases import DEVICES, measure

from rtctl.api.identifying.fit_vo2 import READS_AFTER, check_vo2
from rtctl.border.errors import InputError
from rtctl.hysteresis.gpi_inverse import GpiInverse
from rtctl.identification.vo2 import identify as vo2
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.identification.vo2.staircase import extract_steady_states, find_hold_ends, simulate_hold_ends
from rtctl.models.vo2 import NOMINAL_TIME_CONSTANT_S, model_tables
from rtctl.scenario.schema import load_scenario

QUICK = Vo2FitOptions(plays=2, starts=1, fine_cells=12, paper_levels=5)
TRUE_TIME_CONSTANT_S = {"vo2_a": 1.8e-3, "vo2_b": 2.4e-3, "vo2_l2p": 1.8e-3}  # of the plant files


def quick(dataset, said=None):
    return identify_vo2(dataset, QUICK, (lambda _: None) if said is None else said.append)


def same(a, b):
    return model_tables(a) == model_tables(b)


@pytest.fixture(scope="module")
def small(identified):
    """The damped oscillation, the edges and the unseen staircase of device A: enough for a quick model."""
    dataset = identified("vo2_a").dataset
    return dataclasses.replace(dataset, records=tuple(dataset.records[k] for k in (0, 3, 4)))


@pytest.fixture(scope="module")
def small_model(small):
    return quick(small)


def with_records(dataset, *records):
    return dataclasses.replace(dataset, records=records)


def with_signals(record, **signals):
    kept = {name: values for name, values in (record.signals | signals).items() if values is not None}
    return dataclasses.replace(record, signals=kept)


@pytest.mark.parametrize("name", DEVICES)
def test_the_time_constant_of_a_simulated_device_is_within_three_standard_errors(identified, name):
    model = identified(name).model
    assert abs(model.time_constant_s - TRUE_TIME_CONSTANT_S[name]) < 3.0 * model.time_constant_error_s
    assert model.time_constant_error_s < 0.01 * model.time_constant_s


@pytest.mark.parametrize("name", DEVICES)
def test_ranges_identity_and_fit_errors_are_those_of_the_data(identified, name):
    device = identified(name)
    model, ends = device.model, extract_steady_states(device.dataset)
    assert model.identity == device.dataset.identity != ""
    for span, values in (
        (model.current, ends.current_mA),
        (model.resistance, ends.resistance_ohm),
        (model.deflection, ends.deflection_um),
    ):
        assert span.low == pytest.approx(values[ends.scored].min())
        assert span.high == pytest.approx(values[ends.scored].max())
    data = vo2._prepare_data(device.dataset)
    behind_gpi = vo2.compute_surrogate(data, GpiInverse.of(model.resistance_gpi).estimate, -1e-3)
    behind_gap_free = vo2.compute_surrogate(data, model.resistance_gap_free.invert, None)
    fits = {
        "resistance_gpi": (model.resistance_gpi, data.v, -1e-3 * np.exp(-data.u)),
        "resistance_gap_free": (model.resistance_gap_free, data.v, data.u),
        "composite": (model.composite_egpi, behind_gpi, data.deflection),
        "gap_free_composite": (model.gap_free_egpi, behind_gap_free, data.deflection),
        "deflection_egpi": (model.deflection_egpi, data.v, data.deflection),
        "direct_egpi": (model.direct_egpi, data.u, data.deflection),
        "direct_preisach": (model.direct_preisach, data.u, data.deflection),
    }
    for fit, (hysteresis, v, y) in fits.items():
        error = np.abs(hysteresis.simulate(v) - y)[data.scored]
        quality = model.quality[fit]
        # the fits cool to v = 0, the models until the envelopes are -1: a little of the first branch
        assert quality.mean_abs == pytest.approx(error.mean(), rel=1e-3), fit
        assert quality.max_abs == pytest.approx(error.max(), rel=1e-3), fit
        assert quality.rms == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-3), fit


def test_a_test_record_influences_nothing(small, small_model):
    spoilt = with_signals(
        small.records[2], resistance=-small.records[2].signals["resistance"], deflection=None
    )
    assert same(quick(with_records(small, *small.records[:2], spoilt)), small_model)
    assert same(quick(with_records(small, *small.records[:2])), small_model)


def test_a_fit_record_does_influence_the_time_constant(small, small_model):
    without = quick(with_records(small, small.records[0]))
    assert without.time_constant_s != small_model.time_constant_s


def test_the_same_data_and_seed_give_the_same_model(small, small_model):
    assert same(quick(small), small_model)


def test_the_order_of_records_does_not_matter(identified):
    dataset = identified("vo2_a").dataset
    records = dataset.records
    models = [quick(with_records(dataset, *(records[k] for k in order))) for order in ((0, 1, 3), (3, 1, 0))]
    v = np.concatenate(([0.0], np.random.default_rng(2).uniform(3.7, 8.4, 300)))
    for part in ("resistance_preisach", "deflection_preisach"):
        one, other = (getattr(model, part).simulate(v) for model in models)
        assert np.abs(one - other).max() < 1e-3 * np.ptp(one), part
    assert models[0].time_constant_s == pytest.approx(models[1].time_constant_s, rel=1e-3)
    for name in ("resistance_preisach", "deflection_preisach", "direct_preisach"):
        assert models[0].quality[name].rms == pytest.approx(models[1].quality[name].rms, rel=0.01), name


def test_a_record_without_deflection_still_serves_for_resistance(identified):
    dataset = identified("vo2_a").dataset
    blind = with_signals(dataset.records[1], deflection=None)
    both = quick(with_records(dataset, dataset.records[0], blind, dataset.records[3]))
    data = vo2._prepare_data(with_records(dataset, dataset.records[0], blind))
    assert data.scored.sum() > data.deflection_scored.sum() > 900
    assert np.isfinite(data.deflection).all()
    one = quick(with_records(dataset, dataset.records[0], dataset.records[3]))
    assert both.quality["deflection_egpi"].rms == pytest.approx(one.quality["deflection_egpi"].rms, rel=1e-3)
    assert both.quality["deflection_preisach"].rms == pytest.approx(
        one.quality["deflection_preisach"].rms, rel=0.05
    )
    assert both.quality["resistance_gpi"].rms != one.quality["resistance_gpi"].rms


def one_row_a_hold(record, period_s):
    ends = find_hold_ends(record.signals["current"])
    signals = {name: values[ends] for name, values in record.signals.items()}
    return dataclasses.replace(record, period_s=period_s, signals=signals)


@pytest.mark.parametrize("period_s", [10e-3, 1e-3])
def test_one_row_a_hold_is_a_staircase_at_rest_with_the_nominal_time_constant(small, small_model, period_s):
    said = []
    slow = with_records(small, one_row_a_hold(small.records[0], period_s))
    model = quick(slow, said)
    assert model.time_constant_s == NOMINAL_TIME_CONSTANT_S
    assert math.isinf(model.time_constant_error_s)
    assert {"low", "high"}.isdisjoint(model_tables(model)["model"]["parameters"]["thermal_time_constant"])
    assert any("nominal 1.8 ms" in line and "without an interval" in line for line in said)
    np.testing.assert_array_equal(simulate_hold_ends(slow, 1.8e-3), extract_steady_states(slow).current_mA)
    for name in ("resistance_gpi", "deflection_egpi", "direct_egpi"):
        assert model.quality[name] == small_model.quality[name], "the steady states are the same"


def test_what_could_be_seen_is_not_called_nominal(small):
    said = []
    quick(small, said)
    assert not any("nominal" in line for line in said)


def test_hold_ends_are_the_last_rows_of_equal_current():
    assert find_hold_ends(np.array([4.0, 4.0, 5.0, 5.0, 5.0, 4.0])).tolist() == [1, 4, 5]


def test_each_staircase_is_preceded_by_a_cold_sample_and_what_is_ignored_is_not_scored(small):
    record = dataclasses.replace(small.records[0], ignore_first=25)
    ends = extract_steady_states(with_records(small, record, small.records[0]))
    count = len(find_hold_ends(record.signals["current"]))
    assert np.flatnonzero(ends.reset).tolist() == [0, count + 1]
    assert (ends.current_mA[ends.reset] == 0.0).all()
    ignored = int((find_hold_ends(record.signals["current"]) < 25).sum())
    assert np.flatnonzero(~ends.scored).tolist() == [*range(ignored + 1), count + 1]
    heated = simulate_hold_ends(with_records(small, record, small.records[0]), 1.8e-3)
    assert heated.shape == ends.current_mA.shape
    assert 0.0 < np.abs(heated - ends.current_mA).max() < 0.01, "0.4 % of a step is still to come"


FROM_ZERO = """
[scenario]
title = "from zero current"
period = "1 ms"

[limits]
low = "0 mA"

[[excitation]]
kind = "damped_oscillation"
use = "identify"
hold = "10 ms"
cycles = 3
step = "2 %"
centre = "70 %"

[[excitation]]
kind = "reversal_curves"
use = "identify"
hold = "10 ms"
curves = 4
span = ["60 %", "95 %"]
step = "3 %"
"""


def test_a_measured_current_of_zero_is_no_reset(tmp_path):
    path = tmp_path / "from_zero.toml"
    path.write_text(FROM_ZERO)
    dataset = measure(load_scenario(path, [])[0], tmp_path / "data")
    data = vo2._prepare_data(dataset)
    cold = (data.v == 0.0) & data.scored
    assert cold.sum() >= 4
    np.testing.assert_allclose(data.u[cold], -np.log(data.ends.resistance_ohm[cold]))
    model = quick(dataset)
    assert model.current.low == 0.0
    assert model.quality["direct_preisach"].mean_abs < 0.05 * model.deflection.width


def spoil(record, name, value, where=50):
    values = record.signals[name].copy()
    values[where] = value
    return with_signals(record, **{name: values})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: (dataclasses.replace(r[0], use="fit"), r[1]), ['use = "identify"', "rtctl acquire"]),
        (
            lambda r: (with_signals(r[0], current=np.repeat([4.0, 5.0], [5000, 4641])), r[1]),
            ["r00-damped_oscillation.parquet", "only 2 holds", "rtctl acquire"],
        ),
        (
            lambda r: (spoil(r[0], "resistance", -12.5), r[1]),
            ["r00-damped_oscillation.parquet", "resistance is -12.5 ohm at sample 50", "sign or its unit"],
        ),
        (
            lambda r: (r[0], spoil(r[1], "resistance", 0.0)),
            ["r03-levels.parquet", "resistance is 0 ohm at sample 50", 'use = "test"'],
        ),
        (lambda r: (spoil(r[0], "current", -1.0), r[1]), ["current is -1 mA at sample 50", ">= 0"]),
        (
            lambda r: tuple(with_signals(x, deflection=None) for x in r[:2]),
            ["0 steady states with deflection", "external instrument", "at least 100"],
        ),
        (
            lambda r: (with_signals(r[0], resistance=np.full(r[0].samples, 1e4)), r[1]),
            ["no transition", "range of the current"],
        ),
        (
            lambda r: (with_signals(r[0], deflection=np.full(r[0].samples, 3.0)), r[1]),
            ["deflection never changes", "instrument"],
        ),
        (
            lambda r: tuple(with_signals(x, deflection=-x.signals["deflection"]) for x in r[:2]),
            ["deflection falls while the film heats", "scale = -1", "[signals.deflection]"],
        ),
    ],
    ids=[
        "no staircase",
        "two holds",
        "negative",
        "zero in edges",
        "current",
        "no deflection",
        "stuck R",
        "stuck D",
        "counted against",
    ],
)
def test_a_dataset_that_cannot_give_a_model_is_refused_by_file_and_cure(small, change, words):
    with pytest.raises(InputError) as caught:
        quick(with_records(small, *change(small.records)))
    message = str(caught.value)
    assert str(small.path) in message
    for word in words:
        assert word in message


def test_every_bad_record_is_named_at_once(small):
    records = (spoil(small.records[0], "resistance", -1.0), spoil(small.records[1], "current", -2.0))
    with pytest.raises(InputError, match=r"(?s)r00-damped.*r03-levels"):
        quick(with_records(small, *records))


def test_the_data_of_another_plant_are_refused(small):
    with pytest.raises(InputError, match='"oscillator", --kind vo2 needs "vo2"'):
        quick(dataclasses.replace(small, plant="oscillator"))


def test_a_bench_that_reads_at_the_end_of_a_period_is_recognised_and_told(small, small_model):
    later = with_records(
        small,
        *(
            dataclasses.replace(
                record,
                signals={
                    name: values[:-1] if name == "current" else values[1:]
                    for name, values in record.signals.items()
                },
            )
            for record in small.records
        ),
    )
    model = quick(later)
    assert model.reads_after
    assert model.time_constant_s == pytest.approx(small_model.time_constant_s, rel=0.01)
    assert READS_AFTER in check_vo2(model, later)[0]
    assert not small_model.reads_after
    assert READS_AFTER not in check_vo2(small_model, small)[0]
