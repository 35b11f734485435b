"""A lockstep sample is a hold and a reading; a kernel bound to its types is the kernel."""

from __future__ import annotations

import numpy as np
import pytest

from plant_sim.kernels import compiled, direct


@pytest.mark.parametrize("name", ["vo2_a", "vo2_l2p"])
def test_a_step_is_an_advance_and_a_measurement_to_the_bit(make_device, name):
    stepped, apart = make_device(name), make_device(name)
    for k in range(600):  # beyond two blocks of noise
        current_mA, dt_s = 6.0 + 2.4 * np.sin(k / 20.0), 1e-3 * (1 + k % 3)
        apart.advance((current_mA,), dt_s)
        assert stepped.step((current_mA,), dt_s) == apart.measure()


@pytest.mark.parametrize("name", ["vo2_a", "vo2_l2p"])
def test_a_reset_forgets_the_steps_before(make_device, name):
    used, fresh = make_device(name), make_device(name)
    for current_mA in (8.0, 5.0, 7.0):
        used.step((current_mA,), 1e-3)
    used.reset()
    for current_mA in (3.0, 7.5, 6.0):
        assert used.step((current_mA,), 1e-3) == fresh.step((current_mA,), 1e-3)


def test_a_direct_kernel_takes_whole_numbers_and_numpy_numbers_as_floats(make_device):
    assert make_device().step((6,), 1) == make_device().step((np.float64(6.0),), np.float64(1.0))


def test_a_direct_kernel_is_compiled_but_not_run_by_its_examples():
    memory = np.zeros(2)
    add = direct(compiled(_add), memory, 0.0)
    assert memory.tolist() == [0.0, 0.0]
    assert add(memory, 1.5) == 1.5
    assert memory.tolist() == [1.5, 1.5]


def test_without_compilation_a_direct_kernel_is_the_function():
    assert direct(_add, np.zeros(2), 0.0) is _add


def _add(memory, amount):
    memory += amount
    return memory[0]
