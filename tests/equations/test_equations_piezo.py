"""A piezo stack whose charge reading drifts: stiff against its samples, and named within the usual work."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_equations_examples import EXAMPLES, stack

import rtctl
from rtctl import Record

SAMPLES, PERIOD_S, DRIFT_UC = 240, 1e-3, 30.0


def records() -> list[Record]:
    """Return two records and one for the test by SciPy; the charge is 30 uC off at their ends."""
    found = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(5.0, 110.0, 40), rng.integers(4, 14, 40))[:SAMPLES]
        x, read = np.zeros(5), []
        for level in u:
            read.append((6.0 * x[0] + 10.0 * x[3], x[3]))
            x = solve_ivp(lambda t, y, level=level: stack(t, y, level), (0.0, PERIOD_S), x, method="DOP853",
                          rtol=1e-8, atol=1e-9).y[:, -1]  # fmt: skip
        charge, place = np.array(read).T
        charge = charge + DRIFT_UC * np.arange(SAMPLES) / SAMPLES + 0.9 * rng.standard_normal(SAMPLES)
        place = place + 0.02 * rng.standard_normal(SAMPLES)
        signals = {"command": u, "charge": charge, "x": place}
        found.append(Record(name=f"r{seed}", period_s=PERIOD_S, use=use, signals=signals))
    return found


@pytest.mark.slow
def test_a_drift_of_the_charge_is_named_within_the_usual_work(tmp_path: Path) -> None:
    data = rtctl.write_dataset(
        tmp_path, records(), name="piezo", plant="equations", units={"command": "V", "charge": "uC", "x": "um"},
        holds={"command": "zero"},
    )  # fmt: skip
    found = rtctl.diagnose(data, EXAMPLES / "piezo_stack.toml")
    (cause,) = found.causes
    assert (found.verdict, cause.id) == ("explained", "output.charge.drift")
    assert cause.parameters["rate"].value == pytest.approx(DRIFT_UC / (SAMPLES * PERIOD_S), rel=0.02)
