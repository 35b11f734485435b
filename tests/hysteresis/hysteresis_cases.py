"""Hypothesis strategies: inputs on the range of the paper's heater [mA], and models of every kind on it."""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from rtctl.hysteresis.egpi import EgpiModel, egpi_run
from rtctl.hysteresis.envelopes import Line, cooling_line
from rtctl.hysteresis.gap_free import GapFreeModel, gap_free_run
from rtctl.hysteresis.gpi import GpiModel, gpi_run
from rtctl.hysteresis.preisach.model import PreisachModel, preisach_run

LOW, HIGH = 3.6, 8.5
RUN = {GpiModel: gpi_run, EgpiModel: egpi_run, GapFreeModel: gap_free_run, PreisachModel: preisach_run}

claim = settings(deadline=None, max_examples=60, derandomize=True)  # the first example compiles

levels = st.floats(LOW, HIGH).map(lambda x: round(x, 3))


def histories(min_size=2, max_size=40):
    """Inputs (samples,) that jump between levels."""
    return st.lists(levels, min_size=min_size, max_size=max_size).map(np.array)


def lines():
    """Ordered envelopes: a_R, b_R, a_L, b_L."""

    @st.composite
    def draw_lines(draw):
        a = draw(st.floats(0.3, 4.0))
        heating = Line(a, -a * draw(st.floats(5.0, 8.0)))
        gaps = draw(st.floats(0.0, 0.9 * a * (HIGH - LOW))), draw(st.floats(0.0, 4.0))
        return heating, cooling_line(heating, gaps, (LOW, HIGH))

    return draw_lines()


@st.composite
def radii(draw, n):
    """n radii that rise from zero to below one."""
    return np.array([0.0, *sorted(draw(st.lists(st.floats(0.0, 0.95), min_size=n - 1, max_size=n - 1)))])


@st.composite
def gpi_models(draw):
    n = draw(st.integers(1, 7))
    p = [draw(st.floats(0.05, 2.0)), *draw(st.lists(st.floats(0.0, 2.0), min_size=n - 1, max_size=n - 1))]
    heating, cooling = draw(lines())
    return GpiModel(
        p=np.array(p), r=draw(radii(n)), a_R=heating.a, b_R=heating.b, a_L=cooling.a, b_L=cooling.b,
        c=draw(st.floats(-5.0, 5.0)), v_low=LOW, v_high=HIGH,
    )  # fmt: skip


@st.composite
def plays(draw, least_weight):
    """p, r and envelopes of each play, as keyword arguments."""
    n = draw(st.integers(1, 7))
    pairs = [draw(lines()) for _ in range(n)]
    columns = np.array([[*heating, *cooling] for heating, cooling in pairs]).T
    return {
        "p": np.array(draw(st.lists(st.floats(least_weight, 2.0), min_size=n, max_size=n))),
        "r": draw(radii(n)),
        **dict(zip(("a_R", "b_R", "a_L", "b_L"), columns, strict=True)),
        "v_low": LOW,
        "v_high": HIGH,
    }


@st.composite
def egpi_models(draw):
    c2, c3, c4 = (draw(st.floats(-2.0, 2.0)) for _ in range(3))
    return EgpiModel(**draw(plays(-2.0)), c2=c2, c3=c3, c4=c4)


@st.composite
def gap_free_models(draw):
    q1, q2 = draw(st.floats(0.02, 1.0)), draw(st.floats(0.0, 0.2))
    return GapFreeModel(**draw(plays(0.0)), q1=q1, q2=q2, c=draw(st.floats(-5.0, 5.0)))


@st.composite
def preisach_models(draw, rising=False):
    n = draw(st.integers(1, 8))
    parts = np.cumsum(draw(st.lists(st.floats(0.1, 1.0), min_size=n, max_size=n)))
    grid = np.concatenate(([LOW], LOW + (HIGH - LOW) * parts[:-1] / parts[-1], [HIGH]))
    cells = n * (n + 1) // 2
    mu = np.array(draw(st.lists(st.floats(0.0, 2.0), min_size=cells, max_size=cells)))
    least = 0.02 if rising else -1.0
    c1, c2 = draw(st.floats(least, 1.0)), draw(st.floats(0.0 if rising else -0.2, 0.2))
    sign = 1.0 if rising else draw(st.sampled_from([-1.0, 1.0]))
    return PreisachModel(grid=grid, mu=mu, c=draw(st.floats(-5.0, 5.0)), c1=c1, c2=c2, sign=sign)


rising_models = st.one_of(gpi_models(), gap_free_models(), preisach_models(rising=True))
any_models = st.one_of(gpi_models(), egpi_models(), gap_free_models(), preisach_models())


def scale(model):
    """How large y can get, to make tolerances relative."""
    polynomial = sum(abs(getattr(model, name, 0.0)) for name in ("c", "c1", "c2", "c3", "q1"))
    weights = model.mu if isinstance(model, PreisachModel) else model.p
    quadratic = abs(getattr(model, "c4", 0.0)) + abs(getattr(model, "q2", 0.0))
    return (
        1.0
        + HIGH * polynomial
        + HIGH**2 * (quadratic + abs(getattr(model, "c2", 0.0)))
        + np.abs(weights).sum()
    )
