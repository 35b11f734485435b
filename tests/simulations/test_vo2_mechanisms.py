"""Each mechanism against its sentence, written out a second time; the whole registry for what all must hold."""

from __future__ import annotations

import string
from itertools import permutations

import numpy as np
import pytest
from scipy.signal import lsim
from vo2_dense_oracle import STEPS, Film, dense, heated_by_phase
from vo2_model_cases import PERIOD_S, TAU_S, predict, simulation, small_model, stimulus, telegraph

from rtctl.border.mechanisms import Scales
from rtctl.border.units.quantities import convert, unit_registry
from rtctl.diagnosis.thresholds import ProblemThresholds
from rtctl.simulations.vo2 import MECHANISMS
from rtctl.wiring_models import mechanism_ids

SIZES = Scales(
    displacement=30.0, velocity=600.0, acceleration=1e4, drive=6.0, rate=20.0, duration=0.6, period=1e-3,
    excursion=30.0, sensed=5e4,
)  # fmt: skip
FORMATS = (
    "thermal.second_time_constant thermal.nonlinear_loss thermal.latent_heat thermal.ambient_drift heater.tcr "
    "actuation.delay actuation.deadband structure.resonance hysteresis.rate_dependence hysteresis.creep "
    "hysteresis.shape sensor.self_heating sensor.lag sensor.ageing sensor.crosstalk "
    "sensor.deflection_lag timing.skew sensor.highpass sensor.drift sensor.quantisation input.gain_drift "
    "thermal.phase_heating"
)
CURRENT = telegraph(120, seed=4)
PURE = {"activation": 0.03, "expansion": 0.4, "mixing": 0.0}
"""What the pure phases do at once where the transition is late."""


def of_size(made, size):
    """Values with every amplitude at `size` times its scale and every shape at its default or scale."""
    values = []
    for one in made.parameters:
        declared = one.declared
        if not one.mechanism:
            values.append(one.value)
        elif declared.is_shape:
            values.append(declared.scale(SIZES) if declared.default is None else declared.default)
        else:
            values.append(size * declared.scale(SIZES))
    return np.array(values)


def check_sampled(found, expected, nominal, share):
    """The difference to the oracle is a small share of what the mechanism does, and that is not small."""
    effect = np.std(expected - nominal)
    assert effect > 1e-3 * np.std(nominal)
    assert np.std(found - expected) < share * effect


@pytest.mark.parametrize(
    ("identity", "values", "oracle"),
    [
        ("thermal__second_time_constant", {"share": 0.3, "time_constant": 8e-3}, {"share": 0.3, "slow_s": 8e-3}),
        ("thermal__nonlinear_loss", {"loss": 0.01}, {"loss": 0.01}),
        ("thermal__nonlinear_loss", {"loss": 0.002, "known": 0.0}, {"loss": 0.002, "known": 0.0}),
        ("thermal__latent_heat", {"heat": 4.0}, {"latent": 4.0}),
        ("thermal__latent_heat", {"heat": 4.0, "film": 0.75}, {"latent": 1.0, "film_heat": 3.0}),
        ("thermal__ambient_drift", {"rate": 20.0}, {"drift": 20.0}),
        ("thermal__ambient_drift", {"rate": 60.0, "settling_time": 0.03}, {"drift": 60.0, "settling_s": 0.03}),
        ("heater__tcr", {"tcr": 0.004}, {"tcr": 0.004}),
        ("heater__tcr", {"tcr": 0.002, "known": 0.0}, {"tcr": 0.002, "known": 0.0}),
        ("actuation__delay", {"delay": 0.3e-3}, {"late": int(0.3 * STEPS)}),
        ("actuation__delay", {"delay": 2.5e-3}, {"late": int(2.5 * STEPS)}),
        ("actuation__deadband", {"zone": 2.0}, {"zone": 2.0}),
        ("hysteresis__rate_dependence", {"time_constant": 0.7e-3}, {"lag_s": 0.7e-3}),
        ("hysteresis__rate_dependence", {"time_constant": 0.7e-3} | PURE, {"lag_s": 0.7e-3} | PURE),
        ("hysteresis__rate_dependence", {"time_constant": 0.7e-3} | PURE | {"mixing": -0.5},
         {"lag_s": 0.7e-3} | PURE | {"mixing": -0.5}),
        ("sensor__self_heating", {"heat": 3.0}, {"own": 3.0}),
        ("sensor__self_heating", {"heat": 3.0, "known": 0.0}, {"own": 3.0, "known": 0.0}),
    ],
)  # fmt: skip
def test_heat_is_that_of_the_sentence_in_tiny_steps(identity, values, oracle):
    made = simulation(**{identity: values})
    nominal = predict(simulation(), stimulus(CURRENT))
    resistance, deflection = predict(made, stimulus(CURRENT))
    expected = dense(CURRENT, **oracle)
    check_sampled(deflection, expected.deflection[::STEPS], nominal[1], 0.02)
    check_sampled(np.log(resistance), -expected.reading[::STEPS], np.log(nominal[0]), 0.02)


@pytest.mark.parametrize(
    ("identity", "values", "oracle"),
    [
        ("thermal__latent_heat", {"heat": 4.0}, {"latent": 4.0}),
        ("thermal__ambient_drift", {"rate": 20.0}, {"drift": 20.0}),
        (
            "thermal__ambient_drift",
            {"rate": 60.0, "settling_time": 0.03},
            {"drift": 60.0, "settling_s": 0.03},
        ),
        ("sensor__self_heating", {"heat": 3.0}, {"own": 3.0}),
        ("sensor__self_heating", {"heat": 3.0, "known": 0.0}, {"own": 3.0, "known": 0.0}),
    ],
)
def test_other_heat_is_seen_by_the_loops_beside_a_current_that_does_not_heat(identity, values, oracle):
    zone = {"actuation__deadband": {"zone": 2.0}}
    alone = predict(simulation(**zone), stimulus(CURRENT))
    resistance, deflection = predict(simulation(**zone, **{identity: values}), stimulus(CURRENT))
    expected = dense(CURRENT, zone=2.0, **oracle)
    check_sampled(deflection, expected.deflection[::STEPS], alone[1], 0.02)
    check_sampled(np.log(resistance), -expected.reading[::STEPS], np.log(alone[0]), 0.02)


@pytest.mark.parametrize(
    ("identity", "values", "oracle"),
    [
        ("thermal__nonlinear_loss", {"loss": 0.02}, {"loss": 0.02}),
        ("heater__tcr", {"tcr": 0.006}, {"tcr": 0.006}),
        ("sensor__self_heating", {"heat": 8.0}, {"own": 8.0}),
        ("sensor__self_heating", {"heat": 8.0, "known": 0.0}, {"own": 8.0, "known": 0.0}),
        ("thermal__latent_heat", {"heat": 4.0}, {"latent": 4.0}),
        ("hysteresis__rate_dependence", {"time_constant": 0.7e-3} | PURE, {"lag_s": 0.7e-3} | PURE),
    ],
)
def test_the_room_drifts_beside_what_depends_on_temperature(identity, values, oracle):
    beside = {identity: values}
    alone = predict(simulation(**beside), stimulus(CURRENT))
    made = simulation(**beside, thermal__ambient_drift={"rate": 60.0})
    resistance, deflection = predict(made, stimulus(CURRENT))
    expected = dense(CURRENT, drift=60.0, **oracle)
    check_sampled(deflection, expected.deflection[::STEPS], alone[1], 0.02)
    check_sampled(np.log(resistance), -expected.reading[::STEPS], np.log(alone[0]), 0.02)


@pytest.mark.parametrize(("rate", "held"), [(-30.0, 3.7), (60.0, 8.5)], ids=["below", "above"])
def test_where_a_drift_leaves_the_loops_only_pure_phases_follow(rate, held):
    """The small model's loops go on a little below what its identification saw."""
    shapes = {"activation": 0.03, "expansion": 0.4}
    along = stimulus(np.full(400, held))
    loops = predict(simulation(thermal__ambient_drift={"rate": rate}), along)
    found = predict(simulation(thermal__ambient_drift={"rate": rate} | shapes), along)
    beyond = rate * PERIOD_S * np.arange(400)
    assert found[1] - loops[1] == pytest.approx(-0.4 * beyond, abs=1e-9)
    assert np.log(loops[0] / found[0]) == pytest.approx(0.03 * np.minimum(beyond, 0.0), abs=1e-9)
    within = predict(simulation(thermal__ambient_drift={"rate": -rate} | shapes), along)[1]
    assert within[1:] == pytest.approx(
        predict(simulation(thermal__ambient_drift={"rate": -rate}), along)[1][1:]
    )


@pytest.mark.slow
def test_the_order_in_which_a_file_has_two_mechanisms_says_nothing():
    along, sizes = stimulus(CURRENT), {}
    for names in permutations([name for name, one in MECHANISMS.items() if not one.by_levels], 2):
        made = simulation().extended(names)
        outputs = made.predict(along, of_size(made, 0.5)).outputs
        sizes[names] = np.concatenate([np.log(outputs["resistance"][0]), outputs["deflection"][0]])
    for (one, other), found in sizes.items():
        assert found == pytest.approx(sizes[other, one], rel=1e-9, abs=1e-9), f"{one} and {other}"


def test_steady_effects_that_the_loops_know_leave_slow_currents_alone():
    slow = np.repeat([4.0, 6.0, 7.5, 8.2, 6.5, 5.0], 60)
    nominal = predict(simulation(), stimulus(slow))[1][59::60]
    for identity, values in {
        "thermal__nonlinear_loss": {"loss": 0.01}, "heater__tcr": {"tcr": 0.004}, "sensor__self_heating": {"heat": 5.0},
        "thermal__latent_heat": {"heat": 20.0}, "sensor__crosstalk": {"leak": 300.0},
        "actuation__deadband": {"zone": 2.0},
    }.items():  # fmt: skip
        found = predict(simulation(**{identity: values}), stimulus(slow))[1][59::60]
        assert found == pytest.approx(nominal, abs=1e-5), identity


@pytest.mark.parametrize("values", [{"width": 0.3, "behind": 0.0}, {"held": 1.0, "hold": 0.3}])
def test_a_deadband_ignores_small_changes(values):
    held = np.empty_like(CURRENT)
    held[0] = CURRENT[0]
    for k in range(1, len(CURRENT)):
        held[k] = CURRENT[k] if abs(CURRENT[k] - held[k - 1]) > 0.3 else held[k - 1]
    found = predict(simulation(actuation__deadband=values), stimulus(CURRENT))[1]
    np.testing.assert_array_equal(found, predict(simulation(), stimulus(held))[1])


def played(current, width):
    """A backlash, from below."""
    y = np.empty_like(current)
    y[0] = current[0] - width
    for k in range(1, len(current)):
        y[k] = min(max(y[k - 1], current[k] - width), current[k] + width)
    return y


def test_a_deadband_is_a_backlash_that_the_identified_loops_hold_at_rest():
    made = simulation(actuation__deadband={"width": 0.3})
    resistance, deflection = predict(made, stimulus(CURRENT))
    nominal = predict(simulation(), stimulus(CURRENT))
    expected = dense(played(CURRENT, 0.3), back=0.3)
    check_sampled(deflection, expected.deflection[::STEPS], nominal[1], 0.02)
    check_sampled(np.log(resistance), -expected.reading[::STEPS], np.log(nominal[0]), 0.02)
    slow = np.repeat([5.0, 6.0, 7.5, 6.4, 5.2, 8.0, 7.0, 7.9, 6.8], 60)
    at_rest = slice(59, None, 60)
    assert predict(made, stimulus(slow))[1][at_rest] == pytest.approx(
        predict(simulation(), stimulus(slow))[1][at_rest], abs=1e-5
    )


def fine_time(values):
    return np.arange(len(values)) * PERIOD_S / STEPS


def followed(values, numerator, denominator):
    """A linear filter, settled on the first value, at the samples."""
    y = lsim((numerator, denominator), values - values[0], fine_time(values))[1]
    return (y + values[0])[::STEPS]


def test_a_resonance_is_a_second_order_response_to_the_deflection():
    made = simulation(structure__resonance={"participation": 0.8, "frequency": 130.0, "damping_ratio": 0.05})
    d = dense(CURRENT).deflection
    w = 2.0 * np.pi * 130.0
    expected = 0.2 * d[::STEPS] + 0.8 * followed(d, [w * w], [1.0, 0.1 * w, w * w])
    check_sampled(predict(made, stimulus(CURRENT))[1], expected, d[::STEPS], 0.02)


def test_a_sensor_lags_the_resistance():
    made = simulation(sensor__lag={"time_constant": 1.2e-3})
    resistance = np.exp(-dense(CURRENT).reading)
    expected = followed(resistance, [1.0], [1.2e-3, 1.0])
    check_sampled(predict(made, stimulus(CURRENT))[0], expected, resistance[::STEPS], 0.02)


def late_by_creep(share):
    """0.04 a decade from 0.01 s to 10 s, of what is sampled (n,)."""
    found = share.copy()
    for time_constant in 0.01 * 10.0 ** (np.arange(10) / 3.0):
        along = lsim(([1.0], [time_constant, 1.0]), share - share[0], PERIOD_S * np.arange(len(share)))[1]
        found += 0.04 / 3.0 * (along + share[0] - share)
    return found


@pytest.mark.parametrize("power", [0.0, 0.4, -0.5], ids=["logarithmic", "parallel", "serial"])
def test_what_has_switched_creeps_and_the_pure_phases_do_not(power):
    creep = {"rate": 0.04, "onset": 0.01, "end": 10.0} | PURE | {"mixing": power}
    resistance, deflection = predict(simulation(hysteresis__creep=creep), stimulus(CURRENT))
    model, found = small_model(), dense(CURRENT)
    T = found.v[::STEPS] ** 2
    of_beam = late_by_creep(found.deflection[::STEPS] + PURE["expansion"] * T) - PURE["expansion"] * T
    assert deflection == pytest.approx(of_beam, abs=1e-6 * np.ptp(of_beam))
    cold = np.exp(PURE["activation"] * (T - model.current.low**2)) / model.resistance.high
    metal, of_film = 1 / model.resistance.low, np.exp(found.reading[::STEPS])
    if power == 0.0:
        share = late_by_creep(np.log(of_film / cold) / np.log(metal / cold))
        expected = np.log(cold) + share * np.log(metal / cold)
    else:
        share = late_by_creep((of_film**power - cold**power) / (metal**power - cold**power))
        expected = np.log(cold**power + share * (metal**power - cold**power)) / power
    assert -np.log(resistance) == pytest.approx(expected, abs=1e-6 * np.ptp(expected))


def test_creep_goes_on_by_its_rate_a_decade():
    made = simulation(hysteresis__creep={"rate": 0.04, "onset": 0.01, "end": 10.0})
    step = np.repeat([4.0, 8.0], [10, 20_000])
    after = predict(made, stimulus(step, period_s=1e-2))[1][10:]
    within = np.diff(after[[8, 26, 80]])  # 0.09 s, 0.27 s, 0.81 s: away from both ends of the creep
    assert within[0] == pytest.approx(within[1], rel=0.15), "even in the logarithm of time"
    assert after[-1] - after[3000] < 0.1 * within[1], "over soon after its end"


def test_shape_corrects_each_loop_and_knows_the_branch():
    sweep = np.concatenate((np.linspace(3.7, 8.5, 4000), np.linspace(8.5, 3.7, 4000)))
    made = simulation(
        hysteresis__shape={"deflection_first": 1.0, "deflection_side": 0.5, "resistance_second": 0.1}
    )
    nominal, found = (predict(one, stimulus(sweep)) for one in (simulation(), made))
    x = (np.sqrt(np.interp(np.arange(8000) - 1.8, np.arange(8000), sweep**2)) - 3.7) / 4.8
    side = np.where(np.arange(8000) < 4000, 1.0, -1.0)
    away = np.r_[200:3900, 4400:7800]  # from the reversal, where the branch changes
    expected = ((1.0 + 0.5 * side) * np.sin(np.pi * x))[away]
    assert (found[1] - nominal[1])[away] == pytest.approx(expected, abs=4e-3)
    logarithm = np.log(found[0] / nominal[0])[away]
    assert logarithm == pytest.approx(0.1 * np.sin(2 * np.pi * x)[away], abs=2e-3)


def test_ageing_grows_by_the_same_fraction_and_crosstalk_follows_the_current():
    plain = predict(simulation(), stimulus(CURRENT))[0]
    aged = predict(simulation(sensor__ageing={"rate": 0.3}), stimulus(CURRENT))[0]
    time_s = PERIOD_S * np.arange(len(plain))
    assert aged == pytest.approx(plain * (1.0 + 0.3 * time_s), rel=1e-12)
    slackening = predict(simulation(sensor__ageing={"rate": 0.3, "slowing_time": 0.1}), stimulus(CURRENT))[0]
    assert slackening == pytest.approx(plain * (1.0 + 0.03 * np.log(1.0 + time_s / 0.1)), rel=1e-12)
    leaking = predict(simulation(sensor__crosstalk={"leak": 50.0, "known": 0.0}), stimulus(CURRENT))[0]
    before = np.concatenate((CURRENT[:1], CURRENT[:-1]))  # a reading is taken before its row's current acts
    assert leaking == pytest.approx(plain + 50.0 * before, rel=1e-12)
    stepped = {"leak": 50.0, "known": 0.0, "before": 0.0}
    late = predict(simulation(sensor__crosstalk=stepped), stimulus(CURRENT))[0]
    assert late[:-1] == pytest.approx((plain + 50.0 * CURRENT)[:-1], rel=1e-12)
    known = predict(simulation(sensor__crosstalk={"leak": 50.0}), stimulus(CURRENT))[0]
    v = dense(CURRENT).v[::STEPS]
    assert known == pytest.approx(plain + 50.0 * (before - v), rel=1e-9)


@pytest.mark.parametrize(("growth", "known"), [(0.4, 1.0), (-0.1, 1.0), (0.4, 0.0), (-0.3, 0.0)])
def test_the_heating_grows_with_the_phase(growth, known):
    made = simulation(thermal__phase_heating={"growth": growth, "known": known})
    nominal = predict(simulation(), stimulus(CURRENT))
    resistance, deflection = predict(made, stimulus(CURRENT))
    expected = heated_by_phase(CURRENT, growth, known)
    check_sampled(deflection, expected.deflection[::STEPS], nominal[1], 0.02)
    check_sampled(np.log(resistance), -expected.reading[::STEPS], np.log(nominal[0]), 0.02)


@pytest.mark.parametrize("settled", [0.0, 1.0])
def test_a_reading_that_is_ac_coupled_forgets_what_is_slow(settled):
    made = simulation(sensor__highpass={"rate": 40.0, "settled": settled})
    nominal = predict(simulation(), stimulus(CURRENT))
    resistance, deflection = predict(made, stimulus(CURRENT))
    fine = dense(CURRENT).deflection
    driven = fine - settled * fine[0]
    expected = lsim(([1.0, 0.0], [1.0, 40.0]), driven, fine_time(fine))[1][::STEPS]
    expected += settled * fine[0]  # lsim passes the first value at once
    check_sampled(deflection, expected, nominal[1], 0.02)
    assert resistance == pytest.approx(nominal[0], rel=1e-12)


def test_a_drift_of_the_deflection_reading_and_of_the_currents_gain():
    plain = predict(simulation(), stimulus(CURRENT))
    time_s = PERIOD_S * np.arange(len(CURRENT))
    drifting = predict(simulation(sensor__drift={"rate": -3.0}), stimulus(CURRENT))
    assert drifting[1] == pytest.approx(plain[1] - 3.0 * time_s, rel=1e-12)
    np.testing.assert_array_equal(drifting[0], plain[0])
    settling = predict(simulation(sensor__drift={"rate": -3.0, "settling_time": 0.02}), stimulus(CURRENT))
    assert settling[1] == pytest.approx(plain[1] - 3.0 * 0.02 * (1.0 - np.exp(-time_s / 0.02)), rel=1e-12)
    found = predict(simulation(input__gain_drift={"rate": 0.7}), stimulus(CURRENT))
    within = np.repeat(CURRENT[:-1], STEPS) * (
        1.0 + 0.7 * PERIOD_S / STEPS * (np.arange(len(CURRENT[:-1]) * STEPS) + 0.5)
    )
    assert np.ptp(found[1] - plain[1]) > 0.5
    power = np.empty(len(within) + 1)
    power[0] = CURRENT[0] ** 2
    for k, i in enumerate(within):
        power[k + 1] = i * i + (power[k] - i * i) * np.exp(-PERIOD_S / STEPS / TAU_S)
    beam = Film(small_model().deflection_preisach)
    expected = np.array([beam.at(v) for v in np.sqrt(power)])[::STEPS]
    check_sampled(found[1], expected, plain[1], 0.02)


def test_a_drift_that_settles_after_all_records_is_steady_and_one_that_settles_at_once_is_a_gain():
    def drifting(**settling):
        return predict(simulation(input__gain_drift={"rate": 0.7} | settling), stimulus(CURRENT))[1]

    plain = predict(simulation(), stimulus(CURRENT))[1]
    check_sampled(drifting(settling_time=1e4), drifting(), plain, 1e-4)
    at_once = predict(simulation(input__gain_drift={"rate": 7e3, "settling_time": 1e-5}), stimulus(CURRENT))[
        1
    ]
    stronger = predict(simulation(), stimulus(1.07 * CURRENT))[1]
    assert at_once[1:] == pytest.approx(stronger[1:], abs=0.05 * float(np.ptp(stronger - plain)))


def test_the_drift_of_a_late_current_goes_on_with_time():
    """A delay makes pieces of two lengths of each period."""
    both = {"actuation__delay": {"delay": 0.3 * PERIOD_S}, "input__gain_drift": {"rate": 0.7}}
    late = 0.3 * PERIOD_S
    found = predict(simulation(**both), stimulus(CURRENT))[1]
    nearly = predict(
        simulation(actuation__delay={"delay": late}),
        stimulus(CURRENT * (1.0 + 0.7 * (PERIOD_S * (np.arange(len(CURRENT)) + 0.5) + late))),
    )[1]
    plain = predict(simulation(actuation__delay={"delay": late}), stimulus(CURRENT))[1]
    check_sampled(found, nearly, plain, 0.05)


def test_both_readings_are_rounded_each_by_its_step():
    plain = predict(simulation(), stimulus(CURRENT))
    steps = {"resistance": 500.0, "resistance_level": 120.0, "deflection": 2.0, "deflection_level": 0.3}
    for found, exact, step, level in zip(
        predict(simulation(sensor__quantisation=steps), stimulus(CURRENT)),
        plain,
        (500.0, 2.0),
        (120.0, 0.3),
        strict=True,
    ):
        levels = level + step * np.arange(-1000, 1001)
        np.testing.assert_allclose(found, levels[np.abs(exact[:, None] - levels).argmin(axis=1)], rtol=1e-12)


def test_every_mechanism_of_the_formats_is_there_in_its_order():
    assert list(MECHANISMS) == FORMATS.split() == list(mechanism_ids("vo2"))


@pytest.mark.parametrize("identity", list(MECHANISMS))
def test_units_scales_and_sentences_hold(identity):
    mechanism = MECHANISMS[identity]
    names = {parameter.name for parameter in mechanism.parameters}
    used = {name for _, name, _, _ in string.Formatter().parse(mechanism.statement) if name}
    assert used <= names
    assert used & {one.name for one in mechanism.amplitudes}
    for parameter in mechanism.parameters:
        assert convert(1.0, parameter.unit, parameter.unit) == 1.0
        scale = parameter.scale(SIZES)
        assert np.isfinite(scale)
        assert scale > 0.0
        inside = [x for x in (parameter.neutral, parameter.default, scale * 0.1) if x is not None]
        assert all(parameter.low <= x <= parameter.high for x in inside), parameter.name


@pytest.mark.parametrize("identity", [name for name, one in MECHANISMS.items() if not one.by_levels])
def test_its_derivative_at_neutral_is_neither_zero_nor_infinite(identity):
    made, given = simulation().extended((identity,)), stimulus(telegraph(400))
    base = made.predict(given, of_size(made, 0.0)).outputs
    slopes = []
    for size in (1e-5, 1e-3):
        found = made.predict(given, of_size(made, size)).outputs
        slopes.append(
            (np.concatenate([np.log(found["resistance"][0] / base["resistance"][0]),
                             (found["deflection"][0] - base["deflection"][0]) / 30.0])) / size
        )  # fmt: skip
    assert np.sqrt(np.mean(slopes[1] ** 2)) > 0.005, "seen at a hundredth of its scale at 40 dB"
    assert np.std(slopes[0] - slopes[1]) < 0.05 * np.std(slopes[1])


@pytest.mark.parametrize("identity", list(MECHANISMS))
def test_lanes_are_what_each_would_be_alone(identity):
    made, given = simulation().extended((identity,)), stimulus(telegraph(200))
    lanes = np.array([of_size(made, size) for size in (0.0, 0.05, 0.1, 0.05)])
    lanes[3, 5] = 1.01  # gain of the deflection
    together = made.predict(given, lanes).outputs
    for k, own in enumerate(lanes):
        alone = made.predict(given, own).outputs
        assert all((together[name][k] == alone[name][0]).all() for name in alone)


def test_all_mechanisms_together_run_and_refining_changes_little():
    made = simulation().extended(tuple(MECHANISMS))
    given, values = stimulus(telegraph(300)), of_size(made, 0.03)
    coarse, fine = (made.predict(given, values, refine=refine) for refine in (1, 4))
    assert (coarse.diverged_at == -1).all()
    width = np.ptp(fine.outputs["deflection"])
    assert np.std(coarse.outputs["deflection"] - fine.outputs["deflection"]) < 2e-3 * width


def test_a_lane_that_leaves_the_numbers_is_told():
    made = simulation().extended(("sensor.ageing",))
    values = of_size(made, 0.0)
    values[[one.name for one in made.parameters].index("sensor.ageing.rate")] = -100.0
    found = made.predict(stimulus(np.full(40, 5.0)), np.array([of_size(made, 0.0), values]))
    assert found.diverged_at.tolist() == [-1, round(0.01 / PERIOD_S)]  # 1 - 100/s 10 ms = 0


@pytest.mark.parametrize(
    ("identity", "name", "largest"),
    [
        ("sensor.self_heating", "heat", 150.0),
        ("actuation.delay", "delay", 0.04),
        ("sensor.lag", "time_constant", 0.04),
        ("hysteresis.rate_dependence", "time_constant", 0.04),
    ],
)
def test_a_slow_or_strong_effect_is_within_what_a_search_looks_for(
    identity: str, name: str, largest: float
) -> None:
    """Scales of VO2 mechanisms are typical ones, not the data's: devices of ten times those are found too."""
    declared = next(one for one in MECHANISMS[identity].parameters if one.name == name)
    assert ProblemThresholds().most_scales * declared.scale(SIZES) >= largest


def test_the_frequencies_that_a_resonance_is_looked_for_at_lie_in_reach_of_a_fit():
    """A lightly damped beam rings at one frequency: a fit from a tenth off finds it, one from half of it does not."""
    frequency = next(one for one in MECHANISMS["structure.resonance"].parameters if one.name == "frequency")
    low, high = frequency.shape_range
    assert (high / low) ** (1.0 / (frequency.grid - 1)) < 1.3


def test_heat_that_runs_away_is_told_and_not_warned_of():
    """A heater that feeds itself, and a creep that takes its temperature times a slope of zero."""
    made = simulation(heater__tcr={"tcr": 0.065}, hysteresis__creep={"rate": 0.05})
    current = np.repeat([3.7, 8.5], [10, 600])
    found = made.predict(stimulus(current), np.array([one.value for one in made.parameters]))
    assert found.diverged_at[0] > 10


@pytest.mark.parametrize(
    "declared",
    [pytest.param(p, id=f"{m.id}.{p.name}") for m in MECHANISMS.values() for p in m.parameters],
)
def test_on_a_slower_device_the_search_looks_among_longer_times(declared):
    """A scale [s] that is a number of its own suits the devices that it was chosen on, and no others."""
    slow = SIZES._replace(
        velocity=SIZES.velocity / 100.0, acceleration=SIZES.acceleration / 1e4, rate=SIZES.rate / 100.0,
        duration=100.0 * SIZES.duration, period=100.0 * SIZES.period, response_s=100.0 * TAU_S,
    )  # fmt: skip
    seconds = dict(unit_registry().parse_units(declared.unit)._units).get("second", 0)
    grown = declared.scale(slow) / declared.scale(SIZES._replace(response_s=TAU_S))
    hertz = dict(unit_registry().parse_units(declared.unit)._units).get("hertz", 0)
    assert grown == pytest.approx(100.0 ** (seconds - hertz), rel=1e-12)
