"""The records of a case: which excitation, how strong, how long, which repeat; strengths from the linear response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .equation import P
from .excitations import POOR, RICH, excite
from .options import Options
from .plan import Input, LeftDeviceError, Plan, simulate

NUDGE = 1e-6
GROWTH = 30.0  # a nudge that grows more than this over a record means chaos or a jump hanging on a hair
CHECKED_SAMPLES = 8000
SLICES = 0.15  # share of cases whose records are slices of one file
GAP = 200  # samples at rest between slices


def draw_inputs(rng: np.random.Generator, options: Options, plan: Plan) -> tuple[list[Input], bool]:
    """Records with drives scaled so that the linear device's response has each record's level (about 1)."""
    longest = options.samples or 16_000
    fits = options.fit_records or int(rng.integers(3, 6))
    tests = options.test_records or int(rng.integers(1, 4))
    first_repeats = fits > 2 and rng.random() < 0.3
    linear = plan.having(K=1.0, K3=0.0)
    linear = replace(linear, rest=0.0)
    inputs: list[Input] = []
    for i in range(fits + tests):
        if i == 1 and first_repeats:
            inputs.append(inputs[0])
            continue
        use = "fit" if i < fits else "test"
        kind = str(rng.choice(RICH if i == 0 else (*RICH, *POOR)))
        samples = int(rng.integers(min(options.least_samples or 4000, longest), longest + 1))
        shift = 1.0 if use == "fit" else float(rng.choice([0.8, 0.9, 1.15, 1.3]))
        level = float(rng.uniform(0.5, 1.4) if use == "fit" else rng.choice([0.4, 0.7, 1.25, 1.6]))
        smooth = plan.hold == "band-limited"
        u = excite(rng, kind, samples, plan.samples_a_period, smooth, shift)
        displaced = 0.0
        if kind == "ring-down":
            displaced = float(rng.choice([-1.0, 1.0]) * level * rng.uniform(1.5, 3.0))
        record = Input(number=i, excitation=kind, use=use, drive=u, displaced=displaced)
        if kind != "ring-down":
            response, _ = simulate(linear, record)
            record = replace(record, drive=u * level / np.sqrt(np.mean(response**2)))
        inputs.append(record)
    return _in_files(inputs, bool(rng.random() < SLICES) if options.slices is None else options.slices)


def _in_files(inputs: list[Input], slices: bool) -> tuple[list[Input], bool]:
    placed, start = [], 0
    for i, record in enumerate(inputs):
        placed.append(replace(record, file_start=start if slices else 0, file_number=0 if slices else i))
        start += record.drive.size + GAP
    return placed, slices


def gain_of(inputs: list[Input]) -> float:
    """rms of the driven fit records: the dimensionless drive is scaled by it, so that u is about 1."""
    driven = np.concatenate([r.drive for r in inputs if r.use == "fit" and r.excitation != "ring-down"])
    return float(np.sqrt(np.mean(driven**2)))


def weaker(record: Input, factor: float) -> Input:
    """The same record at another strength."""
    return replace(record, drive=factor * record.drive, displaced=factor * record.displaced)


def predictable(plan: Plan, record: Input) -> bool:
    """Whether two runs that begin 1e-6 apart stay together: else no model could be judged on the record."""
    try:
        y, _ = simulate(plan, record, CHECKED_SAMPLES)
        nudged, _ = simulate(plan, record, CHECKED_SAMPLES, NUDGE)
    except LeftDeviceError:
        return False
    return bool(np.max(np.abs(nudged - y)) < GROWTH * NUDGE)


def made_predictable(plan: Plan, inputs: list[Input]) -> list[Input]:
    """Each record at the highest of a few strengths where the nominal device is predictable."""
    if plan.parameters[P.K3] == 0.0:
        return inputs
    known: dict[int, Input] = {}
    for record in inputs:
        candidate = known.get(record.number, record)
        for _ in range(6):
            if record.number in known or predictable(plan, candidate):
                break
            candidate = weaker(candidate, 0.65)
        known[record.number] = candidate
    return [replace(known[r.number], file_start=r.file_start, file_number=r.file_number) for r in inputs]
