"""What a motion under harmonic drive does in the end is told rightly, and as soon as it can be."""

from __future__ import annotations

import numpy as np
import pytest
from orbit_cases import HM, LINEAR, drive, lanes

from plant_sim.oscillator.sweep import follow
from rtctl.border.errors import InputError
from rtctl.border.model_file import ModelFile
from rtctl.orbits.classes import Kind, Patience, classify, rule
from rtctl.orbits.lyapunov import lyapunov
from rtctl.orbits.settling import LONGEST_PERIOD, repeats, settle
from rtctl.orbits.turning_points import different, turning_points, turning_points_of
from rtctl.wiring_models import build_forced


def test_a_linear_oscillator_settles_on_its_frequency_response() -> None:
    beam = drive(LINEAR)
    frequencies = [8.0, 11.25, 15.0]
    several = lanes(beam, frequencies)
    found = settle(beam, several, np.zeros((3, 2)), np.full(3, 10_000))
    assert found.period.tolist() == [1, 1, 1]
    turns = turning_points_of(beam, several, found.state, 1)
    omega = 2.0 * np.pi * np.array(frequencies)
    amplitude = 3810.0 / np.abs(5000.0 - omega**2 + 4j * omega)
    assert np.allclose([points.max() for points in turns], amplitude, rtol=6e-6)


def test_lanes_of_several_frequencies_are_each_the_motion_of_its_own_sweep() -> None:
    beam = drive(HM)
    three = lanes(beam, [8.0, 11.5, 14.0])
    start = np.array([[7.0, 0.0], [3.0, -100.0], [-6.0, 5.0]])
    together = beam.march(three, start, 6)
    for lane, frequency in enumerate(three.frequency_hz.tolist()):
        alone = beam.march(three.of(np.array([lane])), start[[lane]], 6)
        assert np.allclose(alone.displacement[:, 0], together.displacement[:, lane], rtol=1e-9)
        equation = beam.model._in_periods(three.values[:1], np.ones(1), np.ones(1))  # type: ignore[attr-defined]
        oracle = follow(equation, start[[lane]], 3.81, frequency, 6)
        assert np.allclose(oracle.displacement[:, 0], together.displacement[:, lane], rtol=0.0, atol=1e-8)


def test_a_decay_that_nearly_fits_five_periods_of_the_drive_is_no_subharmonic() -> None:
    beam = drive(HM)  # 14.7 Hz in its well: 8.17 swings in five periods of 9 Hz
    found = settle(beam, lanes(beam, [9.0, 9.0]), np.array([[7.0, 20.0], [-7.0, -20.0]]), np.full(2, 9000))
    assert found.period.tolist() == [1, 1]


@pytest.mark.parametrize("period", [1, 2, 3, 7, LONGEST_PERIOD])
def test_the_least_period_is_found(period: int) -> None:
    orbit = np.random.default_rng(period).standard_normal((2, period))
    z, w = (np.tile(part, 65 // period + 1)[:65, None] for part in orbit)
    assert repeats(z, w, 1e-6).tolist() == [period]


def test_the_exponent_of_a_linear_oscillator_is_minus_half_its_damping() -> None:
    beam = drive(LINEAR)
    exponent, _ = lyapunov(beam, lanes(beam, [9.0, 12.0]), np.array([[1.0, 0.0], [0.0, 50.0]]), 300)
    assert np.allclose(exponent, -2.0, atol=0.05)  # log of an ellipse's axes over 300 periods: 0.7 / 25 s


def test_a_quarter_of_a_hertz_parts_chaos_that_stays_from_none() -> None:
    beam = drive(HM)
    found = classify(
        beam,
        lanes(beam, [12.25, 9.0, 9.0]),
        np.array([[3.0, 0.0], [7.5, 0.0], [12.0, 200.0]]),
        Patience(150.0, 170.0),
    )
    assert found.kind == [Kind.CHAOTIC, Kind.INTRAWELL, Kind.INTERWELL]
    assert found.by_rule == found.kind
    assert found.exponent[0] > 1.0
    assert np.isnan(found.exponent[1:]).all()
    assert found.settled_s[1] < 150.0


def test_a_model_without_bound_is_named_so() -> None:
    beam = drive({"damping": 0.3, "stiffness": 4000.0, "stiffness_cubic": -50.0})
    found = classify(
        beam, lanes(beam, [9.0, 9.0], 0.5), np.array([[30.0, 0.0], [0.1, 0.0]]), Patience(20.0, 80.0)
    )
    assert found.kind == [Kind.UNBOUNDED, Kind.INTERWELL]
    assert np.isnan(found.state[0]).all()


def test_turning_points_of_a_sine_are_its_crests_between_the_samples() -> None:
    t = np.arange(65)[:, None] / 32.0
    phase = np.array([0.3, 1.7])
    z, v = 5.0 * np.cos(2.0 * np.pi * t + phase), -10.0 * np.pi * np.sin(2.0 * np.pi * t + phase)
    for points in turning_points(z, v, np.full(2, 1.0 / 32.0)):
        assert len(points) == 4
        assert np.allclose(np.abs(points), 5.0, rtol=5e-6)  # Hermite: (2 pi / 32)^4 / 384 = 4e-6
        assert different(points) == 2


def test_the_papers_rule() -> None:
    assert rule(np.array([7.0, 6.0])) is Kind.INTRAWELL
    assert rule(np.array([-7.0, 6.0])) is Kind.INTERWELL
    assert rule(np.linspace(-8.0, 8.0, 20)) is Kind.CHAOTIC
    assert rule(np.linspace(-8.0, 8.0, 19)) is Kind.INTERWELL


def test_what_is_not_the_same_in_every_period_is_refused() -> None:
    tables = {
        "kind": "oscillator",
        "parameters": {"stiffness": {"value": 4000.0, "unit": "1/s^2"}},
        "mechanisms": [{"id": "drive.lag", "parameters": {"time_constant": {"value": 1.0, "unit": "ms"}}}],
    }
    model = ModelFile.model_validate({"model": tables})
    with pytest.raises(InputError, match=r"m\.toml: drive\.lag cannot be swept"):
        build_forced(model, {"drive": "V", "displacement": "mm"}, "m.toml")
