"""Devices on a wire, by seed: the films of `foreign_styles` for a source of 3.68 to 8.49 mA and a clock of 1 ms.

Resistance meters with 15 ohm steps (even seeds) or noise, readings at the end or at the start of the period, films of
1.2 to 20 ms; the size of what is hidden is drawn as for the files of these styles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from foreign_common import log_uniform
from foreign_device import Effect
from foreign_excitations import random_steps
from foreign_sizes import sized_effect
from foreign_styles import Bench, draw_bench

WIRE_STYLES = ("few_domains", "many_domains", "smooth_loop")
LOW_MA, HIGH_MA = 3.68, 8.49
PERIOD_S = 1e-3
STEP_OHM = 15.0
SMALLEST_SHARE, LARGEST_SHARE = 0.05, 0.15  # of the readings' variation that the effect changes
SAMPLES = 3000  # of the random steps by which an effect is sized
FASTEST_S, SLOWEST_S = 1.2e-3, 20e-3
DRIFTING_S = 40.0  # device time after which a drift or an ageing has its size


def wire_bench(seed: int) -> Bench:
    """The bench of a seed; seeds one after the other have all styles, both conventions and all speeds."""
    rng = np.random.default_rng([77, seed])
    bench = draw_bench(WIRE_STYLES[seed % len(WIRE_STYLES)], seed)
    place = (seed * 0.618034) % 1.0  # spreads the seeds evenly, whichever are taken
    device = replace(
        bench.device,
        gain_C_per_mA2=bench.device.gain_C_per_mA2 * (bench.high_mA / HIGH_MA) ** 2,
        tau_s=FASTEST_S * (SLOWEST_S / FASTEST_S) ** place,
        period_s=PERIOD_S,
        convention="end" if seed // 3 % 2 == 0 else "start",
    )
    deflection = float(rng.uniform(50.0, 80.0))
    device = replace(
        device,
        deflection_um=deflection,
        bimorph_um_per_K=bench.device.bimorph_um_per_K * deflection / bench.device.deflection_um,
    )
    stepped = seed % 2 == 0
    return replace(
        bench,
        device=device,
        low_mA=LOW_MA,
        high_mA=HIGH_MA,
        centre_mA=bench.centre_mA * HIGH_MA / bench.high_mA,
        resistance_step_ohm=STEP_OHM if stepped else 0.0,
        resistance_noise=1e-4 if stepped else log_uniform(rng, 3e-4, 2e-3),
        resistance_flicker=0.0,
        deflection_noise_um=deflection * log_uniform(rng, 5e-4, 2e-3),
    )


def wire_effect(bench: Bench, seed: int, effect_id: str) -> tuple[Effect, float]:
    """The effect of that id on the bench, and the share of the readings' variation that it changes."""
    rng = np.random.default_rng([78, seed])
    current = random_steps(bench, SAMPLES, bench.device.tau_s / PERIOD_S, rng)
    share = log_uniform(rng, SMALLEST_SHARE, LARGEST_SHARE)
    effect, shares = sized_effect(bench, seed, effect_id, [current], share)
    slow = {"over_s": DRIFTING_S, "settling_s": DRIFTING_S / 3.0}
    values = effect.values | (slow if effect_id in ("sensor.ageing", "thermal.ambient_drift") else {})
    return replace(effect, values=values), max(shares.values())
