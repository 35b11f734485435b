"""Figures of the device, of its models and of the comparison with the paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from plots_cases import SteadyStates

from rtctl.plots.hysteresis import hysteresis_figure, plot_hysteresis
from rtctl.plots.identification import identification_figure, plot_identification
from rtctl.plots.loops import leaves_major_loop
from rtctl.plots.scenarios import plot_scenarios, scenarios_figure


def drawn(axes: Axes, label: str) -> np.ndarray:
    (found,) = [line for line in axes.lines if line.get_label() == label]
    return np.array(found.get_data(), dtype=np.float64)


def texts(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


def test_identification_draws_measurement_and_models_as_given(steady_states: SteadyStates) -> None:
    current, resistance, deflection = steady_states
    models = {"GPI": (1.01 * resistance, None), "both": (resistance + 9.0, deflection + 0.57)}
    figure = identification_figure(*steady_states, models)
    of_r, of_d = (part.axes for part in figure.subfigs)
    assert np.allclose(drawn(of_r[0], "measured"), [current, resistance / 1e3], rtol=1e-12)
    assert np.allclose(drawn(of_r[0], "GPI"), [current, 1.01 * resistance / 1e3], rtol=1e-12)
    assert np.array_equal(drawn(of_d[0], "both"), [current, deflection + 0.57])
    strip = of_d[1]
    expected = 57.0 / np.ptp(deflection)
    assert np.allclose(strip.lines[0].get_ydata(), expected)
    assert strip.get_title(loc="left") == f"both: mean {expected:.2f} %, max {expected:.2f} %"


def test_identification_ranks_models_and_names_the_best(steady_states: SteadyStates) -> None:
    d = steady_states.deflection_um
    models = {"worse": (None, d + 2.0), "best": (None, d - 0.5), "middle": (None, d + 1.0)}
    figure = identification_figure(*steady_states, models)
    titles = [axes.get_title(loc="left").split(":")[0] for axes in figure.subfigs[1].axes[1:]]
    assert titles == ["best", "middle", "worse"]
    assert "deflection: best" in texts(figure)


def test_identification_labels_every_visible_axis(steady_states: SteadyStates) -> None:
    r, d = steady_states.resistance_ohm, steady_states.deflection_um
    figure = identification_figure(*steady_states, {"one": (r, d), "two": (None, d)})
    of_r, of_d = (part.axes for part in figure.subfigs)
    assert (of_r[0].get_xlabel(), of_r[0].get_ylabel()) == ("current [mA]", "resistance [kΩ]")
    assert (of_d[0].get_xlabel(), of_d[0].get_ylabel()) == ("current [mA]", "deflection [µm]")
    assert [axes.get_ylabel() for axes in of_d[1:]] == ["error [%]", "error [%]"]
    assert of_d[-1].get_xlabel() == "sample [–]"
    assert not of_r[-1].axison


def test_identification_without_deflection_shows_resistance_only(
    steady_states: SteadyStates, tmp_path: Path
) -> None:
    current, resistance, deflection = steady_states
    blind = np.full(len(current), np.nan)
    models = {"GPI": (1.01 * resistance, None), "EGPI": (None, deflection)}
    path = tmp_path / "fit.png"
    plot_identification(path, current, resistance, blind, models)
    assert path.stat().st_size > 10_000
    assert "deflection" not in texts(identification_figure(current, resistance, blind, models))


def test_identification_refuses_what_it_cannot_compare(steady_states: SteadyStates) -> None:
    with pytest.raises(ValueError, match="no model has an output"):
        identification_figure(*steady_states, {"empty": (None, None)})
    with pytest.raises(ValueError, match=r"short \(3,\)"):
        identification_figure(*steady_states, {"short": (None, np.ones(3))})


def test_hysteresis_draws_every_steady_state_once_as_heating_or_cooling(steady_states: SteadyStates) -> None:
    figure = hysteresis_figure(*steady_states, title="vo2_a")
    sequence, of_r = figure.axes[0], figure.axes[1]
    assert np.array_equal(sequence.lines[0].get_ydata(), steady_states.current_mA)
    heating, cooling = drawn(of_r, "heating")[1], drawn(of_r, "cooling")[1]
    union = np.where(np.isnan(heating), cooling, heating)
    assert np.allclose(union, steady_states.resistance_ohm / 1e3, rtol=1e-12)
    turning = np.count_nonzero(np.isfinite(heating) & np.isfinite(cooling))
    assert turning == np.count_nonzero(np.diff(np.sign(np.diff(steady_states.current_mA))))


def test_hysteresis_labels_and_zooms_where_loops_are_not_nested(steady_states: SteadyStates) -> None:
    figure = hysteresis_figure(*steady_states, title="vo2_a")
    assert all("[" in axes.get_xlabel() and "[" in axes.get_ylabel() for axes in figure.axes)
    outside = leaves_major_loop(*steady_states)
    assert outside is not None
    zoom = figure.axes[5]
    assert zoom.get_xlim()[0] < steady_states.resistance_ohm[outside.sample] / 1e3 < zoom.get_xlim()[1]
    assert f"by up to {outside.overshoot_um:.2f} µm" in texts(figure)


def test_loops_of_a_single_valued_device_are_nested() -> None:
    current = np.concatenate([np.linspace(4, 8, 50), np.linspace(8, 4, 50), np.linspace(4, 7, 40)])
    assert leaves_major_loop(current, 1e5 / current, 10.0 * current) is None


def test_a_minor_loop_lifted_over_the_major_one_is_found_with_its_height() -> None:
    sweeps = [np.linspace(4, 8, 81), np.linspace(8, 4, 81), np.linspace(4, 8, 81), np.linspace(7, 5, 41)]
    current = np.concatenate(sweeps)
    deflection = 10.0 * current
    deflection[-20] += 3.0
    outside = leaves_major_loop(current, 1e5 / current, deflection)
    assert outside is not None
    assert outside.sample == len(current) - 20
    assert outside.overshoot_um == pytest.approx(3.0)


def test_hysteresis_without_an_instrument_and_of_long_records(
    steady_states: SteadyStates, tmp_path: Path
) -> None:
    current, resistance, deflection = steady_states
    plot_hysteresis(tmp_path / "r.png", current, resistance, np.full(len(current), np.nan), title="blind")
    long = [np.repeat(column, 60_000 // len(column)) for column in (current, resistance, deflection)]
    figure = hysteresis_figure(*long, title="long")
    assert max(len(line.get_xdata()) for axes in figure.axes for line in axes.lines) <= 8000


def test_hysteresis_refuses_a_resistance_without_logarithm(steady_states: SteadyStates) -> None:
    with pytest.raises(ValueError, match="resistance must be > 0 ohm"):
        hysteresis_figure(
            steady_states.current_mA, -steady_states.resistance_ohm, steady_states.deflection_um, title=""
        )


ROWS = [("1 s steps", 0.8, 1.95), ("10 Hz", 1.9, None), ("0.5 Hz", None, None), ("fast", 4.5, 4.3)]


def test_bars_are_as_long_as_the_errors_and_carry_their_numbers(tmp_path: Path) -> None:
    figure = scenarios_figure(ROWS)
    (axes,) = figure.axes
    ours, paper = ([bar.get_width() for bar in bars] for bars in axes.containers)
    assert ours == [0.8, 1.9, 0.0, 4.5]
    assert paper == [1.95, 0.0, 0.0, 4.3]
    written = [text.get_text() for text in axes.texts]
    assert written == ["0.80 %", "1.90 %", "not run", "4.50 %", "1.95 %", "", "", "4.30 %"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == [row[0] for row in ROWS]
    assert axes.get_xlabel() == "mean error [% of range]"
    plot_scenarios(tmp_path / "bars.png", ROWS)
    assert (tmp_path / "bars.png").exists()


def test_the_chart_says_in_how_many_scenarios_the_error_is_lower() -> None:
    assert "below the paper's in 1 of 2 scenarios" in texts(scenarios_figure(ROWS))
    with pytest.raises(ValueError, match="at least one row"):
        scenarios_figure([])
