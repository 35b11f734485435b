"""Every mechanism does what its sentence says, alone and with others, and nothing at all where it is neutral."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from duffing_cases import (
    CUBIC,
    GAIN,
    OPTIONS,
    PERIOD_S,
    SAMPLES,
    STIFFNESS,
    UNITS,
    V_0,
    Z_0,
    Drive,
    FloatArray,
    duffing,
    lane,
    model,
    multisine,
    simulation,
    solved,
    stick_slip,
    stimulus,
)
from mechanism_oracles import EXACT, ORACLES, bouc_wen, cut, dead, oracle_motion
from scipy.integrate import solve_ivp

from plant_sim.oscillator.equation.terms import NOMINAL, TERMS, law_for
from plant_sim.oscillator.integration.holds import nodes
from plant_sim.oscillator.integration.steps import Plan
from plant_sim.oscillator.mechanism import Driven, Moved, Values
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.nominal import NOMINAL_PARAMETERS
from rtctl.border.errors import InputError
from rtctl.border.mechanisms import Parameter, Scales
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Prediction, Stimulus
from rtctl.border.units.quantities import unit_registry

CATALOGUE = [
    "stiffness.quadratic", "stiffness.cubic", "stiffness.quintic", "stiffness.parametric", "stiffness.drift",
    "stiffness.viscoelastic", "damping.nonlinear", "damping.quadratic", "friction.coulomb", "hysteresis.bouc_wen",
    "mode.second", "drive.harmonics", "drive.saturation", "drive.deadband", "drive.delay", "drive.lag",
    "drive.offset", "sensor.saturation", "sensor.offset", "sensor.lag", "sensor.hum", "input.hold",
    "friction.stribeck", "friction.presliding", "damping.power",
    "stiffness.clearance", "stop.one_sided", "stop.two_sided", "stiffness.gravity", "base.motion", "actuator.backlash",
    "timing.skew", "sensor.highpass", "sensor.drift", "sensor.quantisation", "input.gain_drift",
    "damping.asymmetric", "sensor.crosstalk", "actuator.hysteresis",
]  # fmt: skip
"""Of the file formats, sections 5 and 6, and three that are not in them."""


def full(identity: str) -> dict[str, float]:
    """The oracle's values by their full names."""
    return {f"{identity}.{name}": value for name, value in ORACLES[identity].values.items()}


def predicted(samples: FloatArray, hold: str, *identities: str, **nominal: float) -> tuple[FloatArray, ...]:
    """Displacement and velocity (samples,) with these mechanisms at their oracles' values."""
    bound = simulation(*identities, **nominal)
    values = {name: value for identity in identities for name, value in full(identity).items()}
    found = bound.predict(stimulus(samples, hold), lane(bound, values))
    assert found.diverged_at[0] == -1
    return found.outputs["displacement"][0], found.outputs["velocity"][0]


def off(found: FloatArray, expected: FloatArray) -> float:
    """Largest difference in parts of the peak."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def test_the_registry_is_the_list_of_the_file_formats_in_its_order() -> None:
    assert list(MECHANISMS) == CATALOGUE
    assert all(mechanism.id == name for name, mechanism in MECHANISMS.items())


def test_every_mechanism_has_its_oracle() -> None:
    assert set(ORACLES) == set(MECHANISMS)
    for name, oracle in ORACLES.items():
        assert set(oracle.values) == {parameter.name for parameter in MECHANISMS[name].parameters}, name


@pytest.mark.parametrize("identity", ORACLES)
def test_its_effect_is_what_its_sentence_says(identity: str) -> None:
    oracle, samples = ORACLES[identity], multisine()
    for hold in ("linear", "zero") if oracle.drive_side else ("linear",):
        z, v = oracle_motion(identity, samples, hold)
        found_z, found_v = predicted(samples, hold, identity)
        nominal_z, _ = predicted(samples, hold)
        assert off(nominal_z, z) > 0.01  # or the oracle would not see it
        assert off(found_z, z) < oracle.tolerance
        assert off(found_v, v) < 2.0 * oracle.tolerance  # higher frequencies weigh more in it


@pytest.mark.parametrize("exponent", [0.3, 0.7])
def test_a_damping_of_a_power_below_one_is_steep_at_rest(exponent: float) -> None:
    level, speed, samples = 400.0, 12.0, multisine()

    def rate(t: float, y: FloatArray, u: float) -> list[float]:
        return [y[1], duffing(y[0], y[1], u) - level * math.copysign(abs(y[1] / speed) ** exponent, y[1])]

    z = solved(rate, samples, "linear", [Z_0, V_0])[:, 0]
    bound = simulation("damping.power")
    values = {"damping.power.level": level, "damping.power.exponent": exponent, "damping.power.speed": speed}
    found = bound.predict(stimulus(samples, "linear"), lane(bound, values)).outputs["displacement"][0]
    assert off(predicted(samples, "linear")[0], z) > 0.01
    assert off(found, z) < 2e-4  # it is smooth within a thousandth of that speed


def test_the_frictions_oracle_sticks_and_slips() -> None:
    _, v = oracle_motion("friction.coulomb", multisine(), "linear")
    assert 10 < np.count_nonzero(v == 0.0) < SAMPLES - 100


@pytest.mark.parametrize("weight", [1.0, 0.4])
def test_an_input_towards_band_limited_is_the_multisine_that_was_sampled(weight: float) -> None:
    samples, base = multisine(odd=True), math.pi / (PERIOD_S * (SAMPLES - 1))

    def between(at: float) -> Drive:
        k = math.floor(at / PERIOD_S)

        def u(t: float) -> float:
            wave = 1.1 * math.sin(3 * base * t) + 0.9 * math.sin(7 * base * t) - 0.8 * math.sin(11 * base * t)
            return float(weight * wave + (1.0 - weight) * samples[k])

        return u

    z = solved(lambda t, y, u: [y[1], duffing(y[0], y[1], u)], samples, "zero", [Z_0, V_0], drive=between)[
        :, 0
    ]
    bound = simulation("input.hold")
    values = lane(bound, {"input.hold.toward_band_limited": weight})
    found = bound.predict(stimulus(samples, "zero"), values).outputs["displacement"][0]
    assert off(predicted(samples, "zero")[0], z) > 0.01
    assert off(found, z) < 1e-5  # its ends are continued by 128 samples, not for ever: 1e-6 of the drive


def test_both_memories_at_once() -> None:
    identities = ("stiffness.viscoelastic", "hysteresis.bouc_wen")
    a, b = (ORACLES[name] for name in identities)

    def rate(t: float, y: FloatArray, u: float) -> list[float]:
        force = duffing(y[0], y[1], u) - a.values["stiffness"] * y[2] - b.values["level"] * y[3]
        yielding = bouc_wen(np.array([y[0], y[1], y[3]]), b.values)
        return [y[1], force, y[1] - y[2] / a.values["time_constant"], yielding]

    expected = solved(rate, multisine(), "linear", [Z_0, V_0, 0.0, 0.0])
    for order in (identities, identities[::-1]):
        z, v = predicted(multisine(), "linear", *order)
        assert off(z, expected[:, 0]) < b.tolerance
        assert off(v, expected[:, 1]) < 2.0 * b.tolerance


def test_a_memory_a_term_and_a_lagging_drive() -> None:
    p = {**full("stiffness.viscoelastic"), **full("stiffness.quadratic"), **full("drive.lag")}

    def rate(t: float, y: FloatArray, u: float) -> list[float]:
        relaxing = p["stiffness.viscoelastic.stiffness"] * y[2]
        force = duffing(y[0], y[1], y[3]) - p["stiffness.quadratic.coefficient"] * y[0] ** 2 - relaxing
        relaxation = y[1] - y[2] / p["stiffness.viscoelastic.time_constant"]
        return [y[1], force, relaxation, (u - y[3]) / p["drive.lag.time_constant"]]

    samples = multisine()
    expected = solved(rate, samples, "zero", [Z_0, V_0, 0.0, p["drive.lag.settled"] * samples[0]])
    z, _ = predicted(samples, "zero", "drive.lag", "stiffness.viscoelastic", "stiffness.quadratic")
    assert off(z, expected[:, 0]) < EXACT


def test_friction_sticks_with_a_relaxing_spring_too() -> None:
    p = {**full("stiffness.viscoelastic"), **full("friction.coulomb")}
    stiffness, time_constant = (
        p[f"stiffness.viscoelastic.{name}"] for name in ("stiffness", "time_constant")
    )
    expected = stick_slip(
        multisine(), "linear", p["friction.coulomb.level"],
        other=lambda y, u: duffing(y[0], y[1], u) - stiffness * y[2],
        rates=lambda y: [y[1] - y[2] / time_constant], more=(0.0,),
    )  # fmt: skip
    z, _ = predicted(multisine(), "linear", "stiffness.viscoelastic", "friction.coulomb")
    assert np.count_nonzero(expected[:, 1] == 0.0) > 10
    assert off(z, expected[:, 0]) < 2e-5


def test_what_acts_on_the_drive_acts_in_the_order_of_its_stages() -> None:
    p = {**full("drive.offset"), **full("drive.deadband"), **full("drive.lag")}

    def rate(t: float, y: FloatArray, u: float) -> list[float]:
        alive = dead(u + p["drive.offset.offset"], p["drive.deadband.width"])
        return [y[1], duffing(y[0], y[1], y[2]), (alive - y[2]) / p["drive.lag.time_constant"]]

    samples = multisine()
    first = dead(samples[0] + p["drive.offset.offset"], p["drive.deadband.width"])
    expected = solved(rate, samples, "zero", [Z_0, V_0, p["drive.lag.settled"] * first])
    for order in (
        ("drive.lag", "drive.deadband", "drive.offset"),
        ("drive.offset", "drive.deadband", "drive.lag"),
    ):
        assert off(predicted(samples, "zero", *order)[0], expected[:, 0]) < EXACT


def test_what_acts_on_the_reading_acts_in_the_order_of_its_stages() -> None:
    p = {**full("mode.second"), **full("sensor.lag"), **full("sensor.saturation"), **full("sensor.offset")}
    w = 2.0 * math.pi * p["mode.second.frequency"]

    def rate(t: float, y: FloatArray, u: float) -> list[float]:
        c = 2.0 * p["mode.second.damping_ratio"] * w
        second = p["mode.second.gain"] * u - c * y[3] - w * w * y[2]
        lagging = (y[0] + y[2] - y[4]) / p["sensor.lag.time_constant"]
        pull = c * (y[6] - y[1]) + w * w * (y[5] - y[0])
        first = duffing(y[0], y[1], u) + p["mode.second.mass_ratio"] * pull
        return [y[1], first, y[3], second, lagging, y[6], -pull]

    root = math.sqrt(p["sensor.saturation.curvature"])
    cuts = ORACLES["sensor.saturation"].values
    read = solved(rate, multisine(), "linear", [Z_0, V_0, 0.0, 0.0, Z_0, Z_0, V_0])[:, 4]
    expected = cut(np.tanh(root * read) / root, cuts) + p["sensor.offset.offset"]
    z, _ = predicted(
        multisine(), "linear", "sensor.offset", "sensor.saturation", "sensor.lag", "mode.second"
    )  # fmt: skip
    assert off(z, expected) < ORACLES["sensor.lag"].tolerance


def test_a_sensor_that_lags_reads_the_motion_and_not_the_samples() -> None:
    """Of three samples a period a cubic from one to the next is off by a twentieth."""
    device = simulation("sensor.lag")
    values = lane(device, full("sensor.lag"))
    period_s = 2.0 * math.pi / math.sqrt(STIFFNESS) / 3.2
    drive = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], 40), 3)

    def read(finer: int) -> FloatArray:
        stimulus = Stimulus(
            inputs={"drive": np.repeat(drive, finer)}, holds={"drive": "zero"}, period_s=period_s / finer,
            initial={"displacement": Z_0, "velocity": V_0},
        )  # fmt: skip
        return device.predict(stimulus, values).outputs["displacement"][0, ::finer]

    exact = read(32)
    assert np.abs(read(1) - exact).max() < 1e-4 * np.abs(exact).max()


def test_a_lag_behind_a_high_pass_reads_what_came_through_it() -> None:
    p = {**full("sensor.highpass"), **full("sensor.lag")}
    rate, lag_s = p["sensor.highpass.rate"], p["sensor.lag.time_constant"]

    def rates(t: float, y: FloatArray, u: float) -> list[float]:
        coupled = y[0] - y[2]
        return [y[1], duffing(y[0], y[1], u), rate * coupled, (coupled - y[3]) / lag_s]

    read = solved(rates, multisine(), "linear", [Z_0, V_0, 0.0, Z_0])[:, 3]
    for order in (("sensor.highpass", "sensor.lag"), ("sensor.lag", "sensor.highpass")):
        z, _ = predicted(multisine(), "linear", *order)
        assert off(z, read) < ORACLES["sensor.lag"].tolerance


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_rows_that_are_read_early_are_those_of_a_late_drive(hold: str) -> None:
    late = 1.7 * PERIOD_S
    skewed, delayed = simulation("timing.skew"), simulation("drive.delay")
    record = stimulus(multisine(), hold)
    found = skewed.predict(record, lane(skewed, {"timing.skew.late": -late})).outputs
    expected = delayed.predict(record, lane(delayed, {"drive.delay.delay": late})).outputs
    for name in skewed.outputs:
        assert np.array_equal(found[name], expected[name])


def test_a_search_leaves_rows_that_are_read_early_to_the_delay_and_a_file_does_not() -> None:
    assert simulation("timing.skew").parameters[-1].low == 0.0
    file = model(("timing.skew", {"late": (-2.0, "ms")}))
    assert oscillator_simulation(file, UNITS, "m.toml").parameters[-1].value == pytest.approx(-2e-3)


# --- neutral values --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("identity", CATALOGUE)
@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_a_neutral_mechanism_leaves_the_nominal_prediction_as_it_is_to_the_last_bit(
    identity: str, hold: str
) -> None:
    nominal, bound = simulation(), simulation(identity)
    record = stimulus(multisine(), hold)
    shapes = {
        name: value
        for name, value in full(identity).items()
        if name.rpartition(".")[2] not in {amplitude.name for amplitude in MECHANISMS[identity].amplitudes}
    }
    expected = nominal.predict(record, lane(nominal, {})).outputs
    found = bound.predict(record, lane(bound, shapes)).outputs
    for name in nominal.outputs:
        assert np.array_equal(found[name], expected[name])


def test_all_mechanisms_at_neutral_are_the_nominal_model_to_the_last_bit() -> None:
    nominal, bound = simulation(), simulation(*CATALOGUE)
    record = stimulus(multisine())
    expected = nominal.predict(record, lane(nominal, {})).outputs["displacement"]
    assert np.array_equal(bound.predict(record, lane(bound, {})).outputs["displacement"], expected)
    bent = lane(bound, {"stiffness.quadratic.coefficient": 1.0})
    assert not np.array_equal(bound.predict(record, bent).outputs["displacement"], expected)


def neutral(identity: str) -> dict[str, float]:
    """Its parameters' values there; shapes at the oracle's."""
    parameters = MECHANISMS[identity].parameters
    return {p.name: ORACLES[identity].values[p.name] if p.neutral is None else p.neutral for p in parameters}


@pytest.mark.parametrize(
    "identity", [name for name in CATALOGUE if MECHANISMS[name].acts_before_the_equation]
)
def test_a_neutral_contribution_to_the_drive_changes_no_bit_of_it(identity: str) -> None:
    bound, record = simulation(identity), stimulus(multisine(), "zero")
    values = lane(bound, {})
    untouched = bound._drive(record, [], values, 3)
    touched = bound._drive(record, [MECHANISMS[identity]], values, 3)
    assert np.array_equal(touched.nodes, untouched.nodes)
    assert touched.step_s == untouched.step_s


@pytest.mark.parametrize("identity", [name for name in CATALOGUE if MECHANISMS[name].terms])
def test_a_neutral_term_changes_no_bit_of_the_motion_in_the_law_that_has_it(identity: str) -> None:
    bound = simulation(identity)
    values = lane(bound, {})[None, :]
    drive, how = Driven(nodes(multisine(), "linear", 13), PERIOD_S / 13), Plan(13, False)
    start = np.array([[Z_0, V_0]])
    with_term = Equation.of(bound.parameters, [MECHANISMS[identity]], values)
    without = Equation.of(bound.parameters, [], values)
    assert with_term.terms >= without.terms
    assert identity in ("stiffness.cubic", "friction.coulomb") or law_for(with_term.terms) is not law_for(
        without.terms
    )
    for found, expected in zip(
        with_term.integrate(drive, how, start), without.integrate(drive, how, start), strict=True
    ):
        assert np.array_equal(found, expected)


def test_two_memories_have_one_kernel_whichever_was_added_first() -> None:
    both = ("hysteresis.bouc_wen", "stiffness.viscoelastic")
    made = [
        Equation.of(one.parameters, one.mechanisms, lane(one, {})[None, :])
        for one in (simulation(*both), simulation(*both[::-1]))
    ]
    assert made[0].memories == made[1].memories
    assert np.array_equal(made[0].rows, made[1].rows)


def test_beside_a_memory_a_spring_of_any_order_has_the_law_of_the_nominal_one() -> None:
    asymmetric = NOMINAL | {"quadratic"}
    assert law_for(asymmetric, memory=True) is law_for(NOMINAL, memory=True)
    assert law_for(asymmetric) is not law_for(NOMINAL)
    assert law_for(NOMINAL | {"damping_2"}, memory=True) is law_for(frozenset(TERMS))


@pytest.mark.parametrize("identity", [name for name in CATALOGUE if MECHANISMS[name].memory])
def test_a_neutral_memory_has_no_force_whatever_its_state(identity: str) -> None:
    memory = MECHANISMS[identity].memory
    assert memory is not None
    rng = np.random.default_rng(3)
    terms = rng.standard_normal(len(TERMS))  # a law may read those of the spring
    rows = np.array([[*terms, *memory.constants(neutral(identity))]]).T
    for z, v, u, *w in rng.standard_normal((50, 3 + memory.states)):
        force, rates = memory.law(z, v, u, 0.3, tuple(w), rows, len(TERMS), 0)
        assert force == 0.0
        assert len(rates) == memory.states
        assert np.isfinite(rates).all()


@pytest.mark.parametrize("identity", [name for name in CATALOGUE if MECHANISMS[name].sensor])
def test_a_neutral_contribution_to_the_reading_changes_no_bit_of_it(identity: str) -> None:
    bound = simulation(identity)
    shapes = {f"{identity}.{name}": value for name, value in neutral(identity).items()}
    values = lane(bound, shapes)
    seen = []

    def spy(moved: Moved, p: Values) -> Moved:
        # copies: they are views, which the reading replaces
        before = moved.displacement.copy(), moved.velocity.copy()
        result = MECHANISMS[identity].sensor(moved, p)  # type: ignore[misc]
        seen.append((*before, result.displacement.copy(), result.velocity.copy()))
        return result

    def always(*_: object) -> bool:
        return True

    watched = replace(bound, mechanisms=(replace(MECHANISMS[identity], sensor=spy),))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(bound), "acts", always)
        watched.predict(stimulus(multisine()), values)
    ((z_before, v_before, z_after, v_after),) = seen
    assert np.ptp(z_before) > 0.0
    assert np.array_equal(z_after, z_before)
    assert np.array_equal(v_after, v_before)


# --- scales and units ------------------------------------------------------------------------------------------


def scales() -> Scales:
    """Of the nominal motion [mm, V, s]."""
    z, v = predicted(multisine(), "linear")
    u = multisine()
    a = GAIN * u - STIFFNESS * z - CUBIC * z**3

    def rms(values: FloatArray) -> float:
        return float(np.sqrt(np.mean(values**2)))

    return Scales(
        rms(z),
        rms(v),
        rms(a),
        rms(u),
        rms(v) / rms(z),
        SAMPLES * PERIOD_S,
        PERIOD_S,
        rms(z - z.mean()),
        reading=rms(z),
    )


AMPLITUDES = [
    (name, p.name)
    for name in CATALOGUE
    if not MECHANISMS[name].by_levels
    for p in MECHANISMS[name].amplitudes
    if (name, p.name) != ("actuator.hysteresis", "remanence")  # which is nothing without hysteresis
]


@pytest.mark.parametrize(("identity", "name"), AMPLITUDES)
def test_a_small_step_from_neutral_is_seen_and_twice_the_step_is_twice_as_much(
    identity: str, name: str
) -> None:
    """1e-3 of the scale moves the reading by more than 1e-5 of it: a thousand times what the integrator adds."""
    bound, mechanism = simulation(identity), MECHANISMS[identity]
    declared = next(parameter for parameter in mechanism.parameters if parameter.name == name)
    moves = name == "toward_zero" or (identity, name) == ("sensor.crosstalk", "rate")  # a held drive does not
    record = stimulus(multisine(), "linear" if moves else "zero")
    shapes = {
        f"{identity}.{p.name}": ORACLES[identity].values[p.name] for p in mechanism.parameters if p.is_shape
    }
    step = 1e-3 * declared.scale(scales())
    assert declared.low <= 2.0 * step <= declared.high
    sets = [lane(bound, {**shapes, f"{identity}.{name}": k * step}) for k in (0.0, 1.0, 2.0)]
    z = [bound.predict(record, own).outputs["displacement"][0] for own in sets]
    once, twice = (np.linalg.norm(moved - z[0]) / np.linalg.norm(z[0]) for moved in z[1:])
    assert once > 1e-5
    assert once < 0.1  # and the scale is not absurdly large
    assert twice / once == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("identity", ["stiffness.drift", "input.gain_drift", "sensor.drift"])
def test_a_drift_that_settles_after_all_records_is_steady(identity: str) -> None:
    bound, record = simulation(identity), stimulus(multisine(), "zero")
    rate = ORACLES[identity].values["rate"]
    steady, late, none = (
        bound.predict(record, lane(bound, {f"{identity}.rate": r, f"{identity}.settling_time": d})).outputs[
            "displacement"
        ][0]
        for r, d in ((rate, 0.0), (rate, 1e4), (0.0, 0.0))
    )
    change = np.linalg.norm(steady - none)
    assert change > 1e-3 * np.linalg.norm(none)
    assert np.linalg.norm(late - steady) < 1e-4 * change


EVERY = [("", p) for p in NOMINAL_PARAMETERS] + [(m.id, p) for m in MECHANISMS.values() for p in m.parameters]
NAMES = [f"{identity}.{p.name}" for identity, p in EVERY]


@pytest.mark.parametrize(("identity", "declared"), EVERY, ids=NAMES)
def test_the_unit_is_one_and_is_that_of_the_scale(identity: str, declared: Parameter) -> None:
    registry = unit_registry()
    plain = declared.scale(Scales(*(1.0,) * 8))
    for z, u in itertools.product(("mm", "m", "V"), ("V", "N", "m/s^2")):
        unit = registry.Quantity(1.0, declared.unit_in(z=z, u=u, y=z))
        one, second = registry.Quantity(1.0, z), registry.Quantity(1.0, "s")
        drive = registry.Quantity(1.0, u)
        sizes: Any = Scales(
            one, one / second, one / second**2, drive, 1 / second, second, second, one, reading=one,
            largest_drive=drive, largest_reading=one,
        )  # fmt: skip
        scale = declared.scale(sizes)
        if isinstance(scale, registry.Quantity):
            assert (scale / unit).to("dimensionless").magnitude == pytest.approx(plain, rel=1e-12)
        else:  # a number of its own
            assert declared.is_shape or unit.check("[]")


def inside(declared: Parameter) -> float:
    """A value that every parameter may have, but for an exponent."""
    return max(0.25, declared.low)


@pytest.mark.parametrize(("z", "u"), [("mm", "V"), ("m", "N"), ("V", "m/s^2")])
def test_every_mechanism_takes_its_values_in_units_of_the_data(z: str, u: str) -> None:
    nominal = {p.name: {"value": 1.0, "unit": p.unit_in(z=z, u=u, y=z)} for p in NOMINAL_PARAMETERS}
    extensions = [
        {
            "id": m.id,
            "parameters": {
                p.name: {"value": inside(p), "unit": p.unit_in(z=z, u=u, y=z)} for p in m.parameters
            },
        }
        for m in MECHANISMS.values()
    ]
    tables = {"model": {"kind": "oscillator", "parameters": nominal, "mechanisms": extensions}}
    bound = oscillator_simulation(
        ModelFile.model_validate(tables), {"drive": u, "displacement": z}, "model.toml"
    )  # fmt: skip
    assert [p.value for p in bound.parameters[:4]] == [1.0] * 4
    assert [p.value for p in bound.parameters[4:]] == [inside(p.declared) for p in bound.parameters[4:]]
    assert [p.name for p in bound.parameters[4:]] == NAMES[4:]


def test_a_value_in_another_unit_is_converted() -> None:
    values = {"gain": (2.5, "m/s^2/kV"), "frequency": (0.041, "kHz"), "damping_ratio": (3.0, "percent")}
    bound = oscillator_simulation(model(("mode.second", values)), UNITS, "test")
    assert [p.value for p in bound.parameters[4:]] == pytest.approx([2.5, 0.0, 41.0, 0.03])


# --- messages --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("identity", "values", "words"),
    [
        ("friction.coulomb", {"level": (1.8, "mm/s")}, ["model.mechanisms.0.parameters.level", '"mm/s"', "mm/s^2"]),
        ("friction.coulomb", {}, ["model.mechanisms.0.parameters.level", "[mm/s^2]", "missing"]),
        ("friction.coulomb", {"levle": (1.8, "mm/s^2")}, ["model.mechanisms.0.parameters.levle", 'mean "level"?']),
        ("friction.columb", {}, ["model.mechanisms.0.id", '"friction.columb"', 'mean "friction.coulomb"?']),
        ("friction.coulomb", {"level": (-1.0, "mm/s^2")}, ["model.mechanisms.0.parameters.level = -1", "between 0"]),
        ("input.hold", {"toward_zero": (1.5, "")}, ["model.mechanisms.0.parameters.toward_zero = 1.5", "0 and 1"]),
        ("stiffness.viscoelastic", {"stiffness": (9.0, "1/s^2")}, ["parameters.time_constant", "[s]", "missing"]),
        ("sensor.saturation", {"clipped": (1.0, "")}, ["model.mechanisms.0.parameters.limit", "[mm]", "missing"]),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_mechanism_is_told_with_file_key_and_what_is_near(
    identity: str, values: dict[str, tuple[float, str]], words: list[str]
) -> None:
    with pytest.raises(InputError) as report:
        oscillator_simulation(model((identity, values)), UNITS, "beam.toml")
    message = str(report.value)
    assert all(line.startswith("beam.toml: ") for line in message.splitlines())
    for word in words:
        assert word in message


def test_all_that_is_wrong_is_told_at_once() -> None:
    file = model(("friction.columb", {}), ("drive.lag", {}), ("drive.delay", {"delay": (1.0, "mm")}))
    with pytest.raises(InputError) as report:
        oscillator_simulation(file, UNITS, "beam.toml")
    assert [line.split(":")[1].split()[0] for line in str(report.value).splitlines()] == [
        "model.mechanisms.0.id", "model.mechanisms.1.parameters.time_constant", "model.mechanisms.2.parameters.delay",
    ]  # fmt: skip


# --- lanes -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "identities",
    [
        ("stiffness.quadratic", "damping.quadratic", "stiffness.drift"),
        ("friction.coulomb", "stiffness.quintic"),
        ("stiffness.viscoelastic", "hysteresis.bouc_wen"),
        ("hysteresis.bouc_wen", "friction.coulomb", "stiffness.viscoelastic"),
    ],
)
def test_lanes_of_an_equation_march_as_each_alone(identities: tuple[str, ...]) -> None:
    bound, active = simulation(*identities), [MECHANISMS[name] for name in identities]
    own = {name: value for identity in identities for name, value in full(identity).items()}
    factors = np.random.default_rng(8).uniform(0.6, 1.2, (11, len(bound.parameters)))
    values = lane(bound, own) * factors
    starts = np.random.default_rng(9).uniform(-0.1, 0.1, (11, 2)) * [1.0, 90.0]
    drive, how = Driven(nodes(multisine(), "linear", 12), PERIOD_S / 12), Plan(12, False)
    together, _ = Equation.of(bound.parameters, active, values).integrate(drive, how, starts)
    assert off(together[0], together[1]) > 0.01
    for j in range(len(values)):
        one = Equation.of(bound.parameters, active, values[[j]])
        alone, _ = one.integrate(drive, how, starts[[j]])
        assert off(together[j], alone[0]) < 1e-12


def test_lanes_that_differ_in_what_acts_on_the_drive_are_each_as_alone() -> None:
    identities = ("drive.delay", "drive.lag", "input.hold", "sensor.hum", "drive.saturation")
    bound = simulation(*identities)
    own = {name: value for identity in identities for name, value in full(identity).items()}
    rows = [
        {**own},
        {**own, "drive.delay.delay": 0.0},
        {**own, "drive.lag.time_constant": 0.0, "sensor.hum.sine": 0.1},
        {**own, "input.hold.toward_zero": 0.0},
        {**own, "damping": 9.0},  # shares its drive with the first
        {**own, "drive.saturation.curvature": 0.0, "drive.delay.delay": 0.0},
    ]
    values = np.array([lane(bound, row) for row in rows])
    groups = sorted(group.tolist() for group in bound.sharing_a_drive(values))
    assert groups == [[0, 4], [1], [2], [3], [5]]
    record = replace(stimulus(multisine()), peak={"displacement": 0.25})  # one step for all
    together = bound.predict(record, values).outputs["displacement"]
    for j in range(len(values)):
        alone = bound.predict(record, values[j]).outputs["displacement"][0]
        assert off(together[j], alone) < 1e-12
        assert all(off(together[j], together[k]) > 1e-4 for k in range(j))


# --- single properties -----------------------------------------------------------------------------------------


def test_friction_holds_at_rest_what_is_weaker_and_lets_go_what_is_stronger() -> None:
    bound = simulation("friction.coulomb")
    values = lane(bound, {"friction.coulomb.level": 100.0})
    t = PERIOD_S * np.arange(SAMPLES)
    for share, moves in ((0.999, False), (1.001, True)):
        swing = share * 100.0 / GAIN * np.sin(2 * np.pi * 11.0 * t)
        record = Stimulus(inputs={"drive": swing}, holds={"drive": "linear"}, period_s=PERIOD_S)
        found = bound.predict(record, values).outputs
        assert found["displacement"].any() == moves
        assert found["velocity"].any() == moves


def test_it_comes_to_rest_off_the_middle_and_stays_there() -> None:
    bound = simulation("friction.coulomb")
    found = bound.predict(stimulus(np.zeros(SAMPLES)), lane(bound, {"friction.coulomb.level": 60.0})).outputs
    z, v = found["displacement"][0], found["velocity"][0]
    at_rest = np.flatnonzero(v == 0.0)
    assert len(at_rest) > 100
    assert (z[at_rest] == z[-1]).all()
    assert 0.0 < abs(STIFFNESS * z[-1] + CUBIC * z[-1] ** 3) < 60.0


def test_a_cycle_of_bouc_wen_takes_energy_from_the_motion_and_its_backbone_alone_does_not() -> None:
    """A slow cycle of the displacement, where the force is the law's own: area of force over displacement."""
    memory = MECHANISMS["hysteresis.bouc_wen"].memory
    assert memory is not None
    areas = {}
    for loop in (0.0, 0.6):
        constants = np.array(
            [memory.constants({"level": 1.0, "displacement": 0.03, "loop": loop, "bend": 0.3, "order": 1.4})]
        ).T
        h, force_at, angle = 0.0, [], np.linspace(0.0, 6.0 * np.pi, 30_001)
        z, v = 0.1 * np.sin(angle), 0.1 * np.cos(angle)
        for k in range(len(angle)):
            force, (rate,) = memory.law(z[k], v[k], 0.0, 0.0, (h,), constants, 0, 0)
            force_at.append(force)
            h += rate * angle[1]
        last = slice(20_000, None)
        areas[loop] = -float(np.trapezoid(np.array(force_at)[last], z[last]))
    assert areas[0.6] > 0.05  # of level times four amplitudes, 0.4
    assert abs(areas[0.0]) < 1e-3


def test_bouc_wen_of_the_first_order_is_the_general_law_there() -> None:
    memory = MECHANISMS["hysteresis.bouc_wen"].memory
    assert memory is not None
    law: dict[str, float] = {"level": 2.0, "displacement": 0.03, "loop": 0.6, "bend": -0.3, "order": 1.0}
    assert memory.at([law, law]).law is memory.simpler
    assert memory.at([law, {**law, "order": 1.1}]).law is memory.law
    rows = np.array([memory.constants(law)]).T
    for v, h in np.random.default_rng(0).normal(size=(50, 2)):
        expected = (-2.0 * h, (v - 0.6 * abs(v) * h + 0.3 * v * abs(h)) / 0.03)
        for one in (memory.law, memory.simpler):
            force, (rate,) = one(0.1, v, 0.0, 0.0, (h,), rows, 0, 0)
            assert (force, rate) == pytest.approx(expected, rel=1e-12)


RM5 = {"damping": 0.9, "stiffness": -3558.6, "stiffness_cubic": 82.1, "drive_gain": 1.0}
RM5_QUINTIC = -1.34e-2
"""1/(mm^4 s^2): beyond +-78 mm the restoring force points outwards."""


def leaves_at(start: float) -> float:
    """Time [s] at which the undriven beam from `start` [mm] at rest is at 10 m, a moment before infinity."""

    def far(t: float, y: FloatArray) -> float:
        return abs(y[0]) - 1e4

    far.terminal = True  # type: ignore[attr-defined]
    damping, stiffness, cubic, _ = RM5.values()

    def rate(t: float, y: FloatArray) -> list[float]:
        return [y[1], -damping * y[1] - stiffness * y[0] - cubic * y[0] ** 3 - RM5_QUINTIC * y[0] ** 5]

    return float(solve_ivp(rate, (0.0, 20.0), [start, 0.0], events=far, **OPTIONS).t[-1])


def beam_run(start: float, patch: pytest.MonkeyPatch) -> tuple[Prediction, int]:
    """20 s of the undriven beam from `start` [mm] at rest, and the integration steps that it took."""
    bound, steps, original = simulation("stiffness.quintic", **RM5), list[int](), Equation.integrate

    def counted(self: Equation, drive: Driven, *more: Any) -> list[FloatArray]:
        steps.append(len(drive.nodes))
        return original(self, drive, *more)

    patch.setattr(Equation, "integrate", counted)
    record = Stimulus(
        inputs={"drive": np.zeros(20_001)},
        holds={"drive": "linear"},
        period_s=1e-3,
        initial={"displacement": start},
    )
    found = bound.predict(record, lane(bound, {"stiffness.quintic.coefficient": RM5_QUINTIC}))
    patch.undo()
    return found, sum(steps)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_beam_beyond_its_last_barrier_is_told_to_diverge_when_it_does_and_costs_no_more_than_one_that_stays(
    side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    stays, work = beam_run(side * 77.0, monkeypatch)
    assert stays.diverged_at[0] == -1
    assert np.abs(stays.outputs["displacement"]).max() == 77.0
    leaves, work_of_leaving = beam_run(side * 79.0, monkeypatch)
    at, z = int(leaves.diverged_at[0]), leaves.outputs["displacement"][0]
    assert at - 1 == math.floor(leaves_at(79.0) / 1e-3)
    assert (np.abs(z[:at]) < 1e100).all()
    assert not (np.abs(z[at:]) < 1e100).any()
    assert work_of_leaving <= 2 * work


def test_a_device_that_is_never_driven_has_a_scale_of_every_shape() -> None:
    """Of a free decay no size of the drive is known."""
    undriven = scales()._replace(drive=0.0, largest_drive=0.0)
    for mechanism in MECHANISMS.values():
        for one in mechanism.parameters:
            assert not one.is_shape or np.isfinite(one.scale(undriven)), f"{mechanism.id}.{one.name}"
