"""The drive on its way: Langevin to the last digits, weights of holds, amplitudes that a file leaves out."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from duffing_cases import UNITS, model, multisine, stimulus

from plant_sim.oscillator.integration.holds import nodes
from plant_sim.oscillator.integration.node_cache import Kept, cached
from plant_sim.oscillator.mechanism import Driven, Sampled
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from rtctl.border.errors import InputError


def magnetisation(x: float) -> float:
    """3 L(x) of the exact value of `x`."""
    with localcontext() as context:
        context.prec = 60
        e = (-2 * Decimal(abs(x))).exp()
        size = 3 * ((1 + e) / (1 - e) - 1 / Decimal(abs(x)))
    return float(size.copy_sign(Decimal(x)))


def test_saturation_is_langevins_function_to_fourteen_digits() -> None:
    sizes = np.concatenate((np.logspace(-9, 2, 500), [0.5, np.nextafter(0.5, 0.0)]))
    u = np.concatenate((sizes, -sizes)).reshape(-1, 1) * np.ones(3)
    saturated = MECHANISMS["drive.saturation"].drive
    assert saturated is not None
    found = saturated(Driven(u, 1.0), {"curvature": 1.0, "clipped": 0.0, "limit": 1.0}).nodes
    assert np.ptp(found, axis=1).max() == 0.0  # what is equal stays equal, though it is computed once
    assert found[:, 0] == pytest.approx([magnetisation(float(x)) for x in u[:, 0]], rel=1e-14)


def test_weights_of_holds_add_up_from_the_declared_one() -> None:
    samples = multisine()
    one, blend = stimulus(samples), (("zero", 0.25), ("band-limited", 0.5))
    declared, zero, limited = (nodes(samples, hold, 3, 0.4) for hold in ("linear", "zero", "band-limited"))
    expected = declared + 0.25 * (zero - declared) + 0.5 * (limited - declared)
    for _ in range(2):  # made, then kept
        found = cached(one, Sampled(samples, one.period_s, "linear", 0.4 * one.period_s, blend), 3)
        assert np.allclose(found, expected, rtol=0.0, atol=1e-14)
    kept = cached(one, Sampled(samples, one.period_s, "linear", 0.4 * one.period_s), 3)
    assert np.array_equal(kept, declared)


def test_what_is_kept_is_bounded_and_ends_with_its_record() -> None:
    values, owners = np.zeros(1000), [stimulus(multisine()) for _ in range(5)]
    kept = Kept(3 * values.nbytes)
    for k, owner in enumerate(owners[:3]):
        kept.keep((k,), owner, values)
    assert kept.find((0,), owners[0]) is values  # asked for last, so it outlives the second
    kept.keep((3,), owners[3], values)
    assert len(kept) == 3
    assert kept.find((1,), owners[1]) is None
    assert kept.find((2,), owners[0]) is None  # another record's
    del owner, owners[:4]
    kept.keep((4,), owners[0], values)
    assert len(kept) == 1


def test_one_of_several_amplitudes_is_enough_and_none_is_told() -> None:
    bound = oscillator_simulation(model(("drive.harmonics", {"third": (0.1, "1/V^2")})), UNITS, "m.toml")
    assert {p.name: p.value for p in bound.parameters if p.mechanism} == {
        "drive.harmonics.second": 0.0,
        "drive.harmonics.third": 0.1,
    }
    with pytest.raises(InputError, match=r"m\.toml: model\.mechanisms\.0.* at least one of second, third"):
        oscillator_simulation(model(("drive.harmonics", {})), UNITS, "m.toml")
    with pytest.raises(InputError, match="at least one of cosine, sine"):
        oscillator_simulation(model(("sensor.hum", {"frequency": (60.0, "Hz")})), UNITS, "m.toml")
