"""The device of another lab on the wire: its film is the one of the files, and it speaks the registers."""

from __future__ import annotations

import math
import struct
import threading

import foreign_wire_server
import numpy as np
import pytest
from foreign_device import Effect, simulate
from foreign_excitations import random_steps
from foreign_wire_benches import HIGH_MA, LOW_MA, wire_bench
from foreign_wire_film import Film
from foreign_wire_registers import CLAMPED, ENABLED, REFUSED, SOURCE_LIMIT_MA, TRIPPED, Registers

from drivers.modbus import ModbusTcpDriver
from rtctl.border.records import VO2

SAMPLES = 300
EFFECTS = [
    Effect(id="thermal.second_time_constant", size=0.3, unit="1", values={"tau2_s": 0.02}),
    Effect(id="thermal.ambient_drift", size=4.0, unit="K", values={"settling_s": 0.1, "sign": -1.0}),
    Effect(id="thermal.latent_heat", size=6.0, unit="K"),
    Effect(id="heater.tcr", size=2e-3, unit="1/K"),
    Effect(id="actuation.delay", size=2.6e-3, unit="s"),
    Effect(id="actuation.deadband", size=0.4, unit="mA", values={"form": "hold"}),
    Effect(id="actuation.deadband", size=0.4, unit="mA", values={"form": "zero"}),
    Effect(id="hysteresis.rate_dependence", size=3e-3, unit="s"),
    Effect(id="hysteresis.creep", size=0.2, unit="1"),
    Effect(id="sensor.self_heating", size=2.0, unit="K"),
    Effect(id="sensor.lag", size=3e-3, unit="s"),
    Effect(
        id="sensor.ageing", size=0.2, unit="1", values={"over_s": SAMPLES * 1e-3, "exponent": 0.8}
    ),
    Effect(id="sensor.crosstalk", size=300.0, unit="ohm/mA"),
    Effect(id="structure.resonance", size=0.01, unit="s", values={"quality": 8.0}),
]  # fmt: skip


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
@pytest.mark.parametrize("seed", [0, 4], ids=["read at the end", "read at the start"])
def test_a_film_that_is_moved_a_period_a_command_reads_what_whole_records_read(
    effect: Effect, seed: int
) -> None:
    bench = wire_bench(seed)
    current = random_steps(bench, SAMPLES, 4.0, np.random.default_rng(seed))
    whole = simulate(bench.device, current, effect)
    film = Film(bench.device, effect)
    moved = np.array([film.advance(level) for level in current.tolist()])
    np.testing.assert_allclose(moved[:, 0], whole.resistance, rtol=1e-9)
    np.testing.assert_allclose(moved[:, 1], whole.deflection, atol=1e-9 * bench.device.deflection_um)


def test_an_effect_begins_when_it_is_told_to() -> None:
    bench = wire_bench(1)
    current = random_steps(bench, SAMPLES, 4.0, np.random.default_rng(1))
    healthy, film = Film(bench.device), Film(bench.device, EFFECTS[4], begin_s=0.1)
    before, after = (np.array([one.advance(level) for level in current]) for one in (healthy, film))
    changed = np.flatnonzero((before != after).any(axis=1))
    assert changed[0] >= 100
    assert changed[0] < 120


class Bench:
    """Registers with a clock that a test winds."""

    def __init__(self) -> None:
        self.now = 0.0
        bench = wire_bench(0)
        self.registers = Registers(bench, Film(bench.device), "foreign 0", 0, lambda: self.now)
        self.registers.write(3, [1])
        self.registers.write(5, [1])

    def exchange(self, current: float, sequence: int) -> tuple[float | int, ...]:
        """Resistance, counter, status, time, deflection, sequence number in force; or the exception's code."""
        words = (*struct.unpack(">2H", struct.pack(">f", current)), sequence)
        request = struct.pack(">B4HB3H", 23, 100, 10, 0, 3, 6, *words)
        reply = foreign_wire_server.answer(self.registers, request)
        return struct.unpack(">fIHIfH", reply[2:]) if reply[0] == 23 else tuple(reply)


def test_the_foreign_device_follows_the_map() -> None:
    bench = Bench()
    resistance, counter, status, time_us, deflection, in_force = bench.exchange(8.0, 7)
    assert resistance % 15.0 == 0.0
    assert math.isfinite(deflection)
    assert (status, in_force) == (ENABLED, 7)
    assert bench.exchange(8.0, 7) == (resistance, counter, ENABLED, time_us, deflection, 7)
    assert bench.exchange(8.0, 8)[1:4] == (counter + 1, ENABLED, time_us + 1000)
    assert bench.exchange(math.nan, 9) == (0x80 | 23, 3)
    assert bench.exchange(SOURCE_LIMIT_MA + 1.0, 10)[2] == ENABLED | CLAMPED
    assert foreign_wire_server.answer(bench.registers, b"\x03\x00\x78\x00\x08")[2:11] == b"foreign 0"
    assert foreign_wire_server.answer(bench.registers, b"\x04\x00\x00\x00\x01") == b"\x84\x01"
    assert foreign_wire_server.answer(bench.registers, b"\x03\x00\x32\x00\x01") == b"\x83\x02"


def test_the_foreign_watchdog_trips_and_is_armed_again() -> None:
    bench = Bench()
    bench.registers.write(4, [50])
    bench.now = 1.0
    assert bench.exchange(5.0, 1)[2] == ENABLED  # asleep until the first command
    bench.now = 1.06
    assert bench.exchange(5.0, 2)[2] == ENABLED | TRIPPED | REFUSED
    bench.registers.write(3, [0])
    bench.registers.write(3, [1])
    assert bench.exchange(5.0, 3)[2] == ENABLED


@pytest.mark.wire
def test_the_driver_moves_the_foreign_device() -> None:
    bench = wire_bench(2)
    registers = Registers(bench, Film(bench.device), "foreign 2", 2)
    listener = foreign_wire_server.listen()
    threading.Thread(target=foreign_wire_server.serve, args=(listener, registers), daemon=True).start()
    host, port = listener.getsockname()
    driver = ModbusTcpDriver(host=host, port=port, unit=1, profile=VO2)
    driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=2.0)
    assert driver.identity == "foreign 2"
    cold = driver.exchange([LOW_MA])
    for _ in range(200):
        hot = driver.exchange([HIGH_MA])
    driver.close([LOW_MA])
    assert hot.sensed[0] < 0.2 * cold.sensed[0]
    assert hot.reference > cold.reference + 20.0
    assert hot.counter == cold.counter + 200
