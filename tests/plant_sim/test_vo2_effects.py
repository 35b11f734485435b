"""Effects of a VO2 device: each against its own formula, none of them a change, all together against SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rtctl.border.errors import InputError

AMBIENT, GAIN, TAU_S = 23.0, 0.945, 1.8e-3


def effects(**keys):
    return {"effects": keys}


@pytest.mark.parametrize("name", ["vo2_a", "vo2_l2p"])
def test_a_device_with_a_vanishing_effect_is_the_one_without(make_device, silent, name):
    plain, with_effects = make_device(name, silent), make_device(name, silent | effects(ageing="1e-15 1/s"))
    for k in range(300):
        current_mA = 6.0 + 2.4 * math.sin(k / 20.0)
        assert with_effects.step((current_mA,), 1e-3)[1] == pytest.approx(
            plain.step((current_mA,), 1e-3)[1], abs=0.02
        ), "one relay of 8192 may decide otherwise"


def test_a_delayed_device_is_the_plain_one_later(make_device, silent):
    plain, late = make_device("vo2_a", silent), make_device("vo2_a", silent | effects(delay="3 ms"))
    levels = [5.0, 7.0, 8.0, 6.5, 6.0, 7.5, 3.7, 8.2]
    expected = [plain.step((level,), 1e-3) for level in levels]
    for _ in range(3):
        late.step((levels[0],), 1e-3)
        levels = [*levels[1:], levels[-1]]
    for (resistance, deflection), (own, bent) in zip(
        expected, [late.step((x,), 1e-3) for x in levels], strict=True
    ):
        assert own[0] == pytest.approx(resistance[0], rel=1e-3)
        assert bent == pytest.approx(deflection, abs=0.02)


def test_a_delay_need_not_be_whole_periods(make_device, silent):
    device = make_device("vo2_a", silent | effects(delay="0.25 ms"))
    device.advance((5.0,), 1e-3)
    expected = AMBIENT + GAIN * 25.0 * (1.0 - math.exp(-0.75e-3 / TAU_S))
    assert device.temperature_degC == pytest.approx(expected, abs=1e-9)


def test_a_second_time_constant_is_a_sum_of_exponentials(make_device):
    device = make_device("vo2_a", effects(second_share=0.3, second_time_constant="9 ms"))
    device.advance((5.0,), 2.5e-3)
    rise = 0.7 * (1.0 - math.exp(-2.5 / 1.8)) + 0.3 * (1.0 - math.exp(-2.5 / 9.0))
    assert device.temperature_degC == pytest.approx(AMBIENT + GAIN * 25.0 * rise, rel=1e-12)


def test_a_growing_heater_and_loss_follow_the_equation(make_device):
    device = make_device("vo2_a", effects(tcr="4e-3 1/K", loss="3e-3 1/K"))
    device.advance((7.0,), 3e-3)

    def slope(t, r):
        return (GAIN * 49.0 * (1.0 + 4e-3 * r) - 3e-3 * r * r - r) / TAU_S

    rise = solve_ivp(slope, (0.0, 3e-3), [0.0], rtol=1e-10, atol=1e-10).y[0, -1]
    assert device.temperature_degC - AMBIENT == pytest.approx(rise, rel=2e-5)


def test_a_current_whose_gain_drifts_heats_as_its_square(make_device):
    device = make_device("vo2_a", effects(gain_drift="0.5 1/s"))
    device.advance((5.0,), 0.4)

    def slope(t, r):
        return (GAIN * 25.0 * (1.0 + 0.5 * t) ** 2 - r) / TAU_S

    rise = solve_ivp(slope, (0.0, 0.4), [0.0], method="LSODA", rtol=1e-9, atol=1e-9).y[0, -1]
    assert device.temperature_degC - AMBIENT == pytest.approx(rise, rel=1e-4)


def test_a_film_that_turns_metallic_heats_itself_further(make_device, silent):
    """At rest: k i^2 (1 + growth phi), phi its own; half way through the transition more than without."""
    plain = make_device("vo2_a", silent)
    device = make_device("vo2_a", silent | effects(phase_heating=0.2))
    ahead = []
    for current_mA in (3.0, 6.5, 6.8, 7.1, 8.0, 6.0):
        for one in (plain, device):
            one.advance((current_mA,), 0.1)
        rise = GAIN * current_mA**2 * (1.0 + 0.2 * device.electrical_fraction)
        assert device.temperature_degC - AMBIENT == pytest.approx(rise, rel=1e-6)
        ahead.append(device.electrical_fraction - plain.electrical_fraction)
    assert max(ahead) > 0.05


def test_domains_that_lag_switch_later_and_end_at_the_same_place(make_device, silent):
    plain = make_device("vo2_a", silent)
    lagging = make_device("vo2_a", silent | effects(domain_lag="4 ms"))
    for device in (plain, lagging):
        device.advance((8.0,), 4e-3)
    assert lagging.electrical_fraction < 0.7 * plain.electrical_fraction
    assert lagging.temperature_degC == pytest.approx(plain.temperature_degC, rel=1e-9)
    for device in (plain, lagging):
        device.advance((8.0,), 0.2)
    assert lagging.electrical_fraction == pytest.approx(plain.electrical_fraction, abs=2e-4)


def test_a_sensor_that_lags_reads_what_a_follower_of_the_film_reads(make_device, silent):
    plain = make_device("vo2_a", silent)
    lagging = make_device("vo2_a", silent | effects(sensor_lag="2 ms"))
    y, h = plain.resistance_ohm, 2e-6
    for k in range(4000):
        before = plain.resistance_ohm
        plain.advance((7.5,), h)
        middle = 0.5 * (before + plain.resistance_ohm)
        y = middle + (y - middle) * math.exp(-h / 2e-3)
        if k % 500 == 499:
            lagging.advance((7.5,), 1e-3)
            assert lagging.resistance_ohm == pytest.approx(y, rel=2e-3)


def test_a_swinging_beam_overshoots_at_its_frequency_and_settles(make_device, silent):
    keys = effects(swing_share=1.0, swing_frequency="100 Hz", swing_damping=0.05)
    plain, swinging = make_device("vo2_a", silent), make_device("vo2_a", silent | keys)
    rows = []
    for _ in range(400):
        rows.append((plain.step((8.0,), 2.5e-4)[1], swinging.step((8.0,), 2.5e-4)[1]))
    rest, measured = np.array(rows).T
    ringing = (measured - rest)[60:]
    crossings = np.flatnonzero(np.diff(np.sign(ringing)))
    assert np.diff(crossings).mean() == pytest.approx(20.0, abs=0.5), "half a period of 10 ms, in samples"
    assert np.abs(ringing).max() > 3.0
    swinging.advance((8.0,), 0.5)
    assert swinging.deflection_um == pytest.approx(plain.deflection_um, abs=0.02)


def test_backlash_leak_ageing_sensing_and_warming(make_device, silent):
    device = make_device("vo2_a", silent | effects(backlash="0.2 mA"))
    device.advance((5.0,), 0.1)
    device.advance((4.7,), 0.1)
    assert device.temperature_degC == pytest.approx(AMBIENT + GAIN * 4.8**2, abs=1e-6), (
        "5 - 0.2, held from above"
    )
    plain = make_device("vo2_a", silent)
    plain.advance((5.0,), 0.1)
    leaking = make_device("vo2_a", silent | effects(leak="500 ohm/mA", ageing="0.1 1/s"))
    leaking.advance((5.0,), 0.1)
    assert leaking.resistance_ohm == pytest.approx(1.01 * plain.resistance_ohm + 2500.0, rel=1e-4)
    warm = make_device("vo2_a", silent | effects(warming="2 K/s", sensing="3 K"))
    warm.advance((0.0,), 0.5)
    assert AMBIENT + 1.0 + 2.5 < warm.temperature_degC < AMBIENT + 1.0 + 3.0


def test_a_reset_forgets_what_was_on_its_way(make_device):
    keys = effects(
        delay="5 ms", domain_lag="2 ms", sensor_lag="1 ms", second_share=0.2, second_time_constant="9 ms"
    )
    used, fresh = make_device("vo2_a", keys), make_device("vo2_a", keys)
    for current_mA in (8.0, 5.0, 7.0):
        used.step((current_mA,), 1e-3)
    used.reset()
    for current_mA in (3.0, 7.5, 6.0):
        assert used.step((current_mA,), 1e-3) == fresh.step((current_mA,), 1e-3)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"delay": "2 s"}, "effects.delay"),
        ({"second_share": 0.3}, "second_share needs second_time_constant"),
        ({"dealy": "1 ms"}, "delay"),
    ],
)
def test_what_is_wrong_is_named(make_device, keys, words):
    with pytest.raises(InputError, match=words):
        make_device("vo2_a", effects(**keys))
