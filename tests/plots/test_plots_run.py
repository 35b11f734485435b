"""The figure of a run draws what was recorded, says what it found, and stays small."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from plots_cases import run_signals

from rtctl.border.records import VO2, Channel
from rtctl.plots.elements.errors import shown_limit
from rtctl.plots.run import plot_run, run_figure

LABELS = {"deflection [µm]", "error [µm]", "current [mA]", "resistance [kΩ]", "time [s]"}


def line(axes: Axes, label: str) -> np.ndarray:
    """The drawn points (2, n) of the labelled line."""
    (found,) = [drawn for drawn in axes.lines if drawn.get_label().startswith(label)]
    return np.array(found.get_data(), dtype=np.float64)


def panel(figure: Figure, label: str) -> Axes:
    """The first panel against time with that y label."""
    return next(axes for axes in figure.subfigs[0].axes if axes.get_ylabel() == label)


def headline_of(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


def test_short_runs_draw_every_sample_given() -> None:
    time_s, signals = run_signals(2000)
    figure = run_figure(time_s, signals, title="a sine", closed_loop=True, output_range=57.0, profile=VO2)
    following, errors = panel(figure, "deflection [µm]"), panel(figure, "error [µm]")
    for label in ("setpoint", "deflection", "estimate"):
        assert np.array_equal(line(following, label), [time_s, signals[label]])
    assert np.array_equal(line(errors, "setpoint")[1], signals["setpoint"] - signals["deflection"])
    assert np.array_equal(line(errors, "estimate")[1], signals["estimate"] - signals["deflection"])
    drawn = panel(figure, "resistance [kΩ]").lines[0].get_ydata()
    assert np.allclose(drawn, signals["resistance"] / 1e3, rtol=1e-12)
    assert np.array_equal(panel(figure, "current [mA]").lines[0].get_ydata(), signals["current"])


def test_a_further_output_is_drawn_with_its_setpoint_and_planes_are_of_a_command_that_moves() -> None:
    time_s, signals = run_signals(2000)
    tilt, heater = (
        Channel(name="tilt", unit="mrad", register=130),
        Channel(name="heater", unit="mW", register=10),
    )
    signals |= {
        "tilt": np.sin(time_s), "setpoint_tilt": 1.1 * np.sin(time_s), "estimate_tilt": 0.9 * np.sin(time_s),
        "heater": np.full(2000, 5.0),
    }  # fmt: skip
    profile = replace(VO2, sensed=(*VO2.sensed, tilt), commands=(*VO2.commands, heater))
    figure = run_figure(time_s, signals, title="two", closed_loop=True, output_range=57.0, profile=profile)
    for label, name in (("setpoint", "setpoint_tilt"), ("tilt", "tilt"), ("estimate", "estimate_tilt")):
        assert np.array_equal(line(panel(figure, "tilt [mrad]"), label)[1], signals[name])
    assert figure.subfigs[1].axes[0].get_xlabel() == "current [mA]"
    assert "two, deflection" in headline_of(figure)


def test_every_axis_has_a_label_with_its_unit() -> None:
    time_s, signals = run_signals(2000)
    figure = run_figure(time_s, signals, title="a sine", closed_loop=True, output_range=57.0, profile=VO2)
    against_time, planes = figure.subfigs[0].axes, figure.subfigs[1].axes
    labels = {axes.get_ylabel() for axes in against_time} | {against_time[-1].get_xlabel()}
    assert labels == LABELS
    assert panel(figure, "error [µm]").child_axes[0].get_ylabel() == "error [% of range]"
    pairs = [(axes.get_xlabel(), axes.get_ylabel()) for axes in planes]
    r, i, d = "resistance [kΩ]", "current [mA]", "deflection [µm]"
    assert pairs == [(i, r), (i, d), (r, d)]
    assert (planes[0].get_yscale(), planes[2].get_xscale()) == ("linear", "linear"), "19 of 36 kohm"


def test_a_resistance_over_decades_is_logarithmic_and_a_metallic_film_is_in_ohm() -> None:
    time_s, signals = run_signals(3900, 0.5)
    signals["resistance"] = 14.0 + 400.0 * np.exp(-signals["deflection"])
    figure = run_figure(time_s, signals, title="a sine", closed_loop=True, output_range=57.0, profile=VO2)
    drawn = panel(figure, "resistance [Ω]").lines[0].get_ydata()
    assert np.allclose(drawn, signals["resistance"], rtol=1e-12)
    signals["resistance"] = 1e3 * np.exp(4.0 - signals["deflection"] / 10.0)
    figure = run_figure(time_s, signals, title="a sine", closed_loop=True, output_range=57.0, profile=VO2)
    assert panel(figure, "resistance [kΩ]").get_yscale() == "log"


def test_a_loop_is_drawn_as_a_line_and_a_random_staircase_as_dots() -> None:
    time_s, signals = run_signals(8000, 0.5)
    signals["current"] = 7.0 + 1.5 * np.sin(np.pi * time_s)
    drawn = run_figure(time_s, signals, title="x", closed_loop=True, output_range=57.0, profile=VO2)
    assert [line.get_linestyle() for line in drawn.subfigs[1].axes[1].lines] == ["-", "-"]
    signals["current"] = np.repeat(np.random.default_rng(0).uniform(5.0, 8.0, 800), 10)
    drawn = run_figure(time_s, signals, title="x", closed_loop=True, output_range=57.0, profile=VO2)
    assert [line.get_linestyle() for line in drawn.subfigs[1].axes[1].lines] == ["None", "None"]


def test_one_wrong_reading_does_not_flatten_a_panel_and_is_counted() -> None:
    time_s, signals = run_signals(8000)
    signals["deflection"][4000] = 1e6
    following = panel(
        run_figure(time_s, signals, title="x", closed_loop=True, output_range=57.0, profile=VO2),
        "deflection [µm]",
    )
    assert following.get_ylim()[1] < 100.0
    assert following.texts[0].get_text() == "1 sample beyond this axis"


def test_the_headline_states_mean_and_maximum_in_um_and_percent() -> None:
    time_s, signals = run_signals(2000)
    signals["deflection"] = signals["setpoint"] + 1.14
    signals["estimate"] = signals["deflection"] - 0.57
    text = headline_of(
        run_figure(time_s, signals, title="steps", closed_loop=True, output_range=57.0, profile=VO2)
    )
    assert "steps: tracks to 2.00 % of range on average" in text
    assert "tracking error mean 1.14 µm (2.00 %), max 1.14 µm (2.00 %)" in text
    assert "self-sensing error mean 0.57 µm (1.00 %), max 0.57 µm (1.00 %)" in text


def test_an_open_loop_run_speaks_of_self_sensing_only() -> None:
    time_s, signals = run_signals(2000)
    figure = run_figure(time_s, signals, title="staircase", closed_loop=False, output_range=57.0, profile=VO2)
    assert "self-senses to" in headline_of(figure)
    assert "tracking" not in headline_of(figure)
    assert not [
        drawn for axes in figure.subfigs[0].axes for drawn in axes.lines if drawn.get_label() == "setpoint"
    ]


@pytest.mark.parametrize("frequency_hz", [0.1, 10.0])
def test_a_run_of_a_minute_draws_a_bounded_number_of_points(frequency_hz: float, tmp_path: Path) -> None:
    time_s, signals = run_signals(60_000, frequency_hz)
    figure = run_figure(time_s, signals, title="long", closed_loop=True, output_range=57.0, profile=VO2)
    drawn = [line for part in figure.subfigs for axes in part.axes for line in axes.lines]
    assert max(len(line.get_xdata()) for line in drawn) <= 12_000
    assert sum(len(line.get_xdata()) for line in drawn) < 90_000
    figure.draw_without_rendering()


def test_a_fast_reference_is_magnified_over_its_last_cycles() -> None:
    time_s, signals = run_signals(60_000, 10.0)
    figure = run_figure(time_s, signals, title="fast", closed_loop=True, output_range=57.0, profile=VO2)
    top = figure.subfigs[0].axes[0]
    shown = line(top, "deflection")
    assert shown[0][-1] == time_s[-1]
    assert 0.5 < shown[0][-1] - shown[0][0] < 5.0
    assert np.array_equal(shown[1], signals["deflection"][-len(shown[1]) :])


def test_without_an_instrument_the_figure_shows_estimate_and_says_so(tmp_path: Path) -> None:
    time_s, signals = run_signals(2000)
    signals["deflection"] = np.full(2000, np.nan)
    signals["estimate_standard_error"] = np.full(2000, np.inf)
    figure = run_figure(time_s, signals, title="blind", closed_loop=True, output_range=57.0, profile=VO2)
    assert "no external instrument" in headline_of(figure)
    drawn = line(panel(figure, "error [µm]"), "setpoint − estimate")
    assert np.array_equal(drawn[1], signals["setpoint"] - signals["estimate"])
    plot_run(
        tmp_path / "blind.png",
        time_s,
        signals,
        title="blind",
        closed_loop=True,
        output_range=57.0,
        profile=VO2,
    )


def test_a_run_cut_short_with_missing_readings_is_still_drawn(tmp_path: Path) -> None:
    time_s, signals = run_signals(300)
    for name in signals:
        signals[name][250:] = np.nan
    plot_run(
        tmp_path / "fault.png",
        time_s,
        signals,
        title="fault",
        closed_loop=True,
        output_range=57.0,
        profile=VO2,
    )
    nothing = {name: np.full(300, np.nan) for name in signals}
    plot_run(
        tmp_path / "nothing.png",
        time_s,
        nothing,
        title="nothing",
        closed_loop=True,
        output_range=57.0,
        profile=VO2,
    )
    assert (tmp_path / "nothing.png").stat().st_size > 10_000


def test_the_file_is_a_picture_wide_enough_for_a_readme(tmp_path: Path) -> None:
    time_s, signals = run_signals(2000)
    path = tmp_path / "made" / "run.png"
    plot_run(path, time_s, signals, title="a sine", closed_loop=True, output_range=57.0, profile=VO2)
    height, width, _ = imread(path).shape
    assert (width, height) == (1840, 1344)
    assert list(path.parent.iterdir()) == [path]


def test_the_error_axis_shows_noise_whole_and_cuts_the_jumps_of_steps_with_a_note() -> None:
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, 1000)
    assert shown_limit(noise, 2.0) == np.abs(noise).max()
    time_s, signals = run_signals(2000)
    signals["setpoint"][1000:1010] += 40.0
    axes = panel(
        run_figure(time_s, signals, title="steps", closed_loop=True, output_range=57.0, profile=VO2),
        "error [µm]",
    )
    assert axes.get_ylim()[1] < 10.0
    assert "beyond this axis" in axes.texts[0].get_text()


def test_a_missing_signal_or_another_length_is_named() -> None:
    time_s, signals = run_signals(100)
    del signals["current"]
    with pytest.raises(ValueError, match="missing: current"):
        run_figure(time_s, signals, title="", closed_loop=True, output_range=57.0, profile=VO2)
    with pytest.raises(ValueError, match=r"current \(7,\)"):
        run_figure(
            time_s,
            signals | {"current": np.ones(7)},
            title="",
            closed_loop=True,
            output_range=57.0,
            profile=VO2,
        )
    with pytest.raises(ValueError, match="range that percents refer to must be > 0"):
        run_figure(
            time_s, signals | {"current": time_s}, title="", closed_loop=True, output_range=0.0, profile=VO2
        )
