"""The figures of a diagnosis show pieces of a record where they lie, in units that fit, with no cell of noise."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.plots.diagnosis import (
    LEAST_COUNT,
    cell_means,
    plane_figure,
    rate_unit,
    spectrum_figure,
    stretch_figure,
)
from rtctl.plots.elements.before_after import BeforeAfter, join_pieces
from rtctl.plots.elements.limits import robust_limits
from rtctl.plots.elements.readings import drawn_error, drawn_reading

RATE = 60.0


def piece(begin: int, count: int, **more: object) -> BeforeAfter:
    time_s = 1e-3 * (begin + np.arange(count))
    measured = np.sin(RATE * time_s)
    values = {
        "record": "r", "output": "displacement", "unit": "mm", "rate": RATE, "time_s": time_s, "measured": measured,
        "before": 1.001 * measured, "after": measured, "output_rate": RATE * np.cos(RATE * time_s),
    }  # fmt: skip
    return BeforeAfter(**(values | more))  # type: ignore[arg-type]


def test_pieces_of_one_record_lie_at_their_times_and_no_line_joins_them() -> None:
    record = join_pieces([piece(900, 300), piece(0, 300), piece(300, 301)])
    assert record.starts == (0, 300, 601)
    assert (np.diff(record.time_s) >= 0.0).all()
    broken = record.with_gaps(record.before)
    assert np.flatnonzero(np.isnan(broken)).tolist() == [299, 600]
    figure = stretch_figure(record, 1e-4, extended=True)
    assert "in 3 pieces" in figure.axes[2].get_xlabel()
    drawn = [line for line in figure.axes[2].lines if len(line.get_xdata()) > 2]
    assert len(drawn) == 6, "before and after of each piece"
    assert not [line for line in drawn if np.ptp(line.get_xdata()) > 0.31]


def test_an_error_of_nanometres_beside_a_motion_of_millimetres_has_its_own_unit() -> None:
    figure = stretch_figure(
        piece(0, 2000, before=np.sin(RATE * 1e-3 * np.arange(2000)) + 3e-5), 1e-5, extended=False
    )
    motion, error, whole = figure.axes
    assert motion.get_ylabel() == "displacement [mm]"
    assert error.get_ylabel() == whole.get_ylabel() == "error [nm]"
    assert max(abs(error.lines[0].get_ydata())) == pytest.approx(30.0)


def test_the_measurement_lies_above_the_simulations() -> None:
    motion = stretch_figure(piece(0, 2000), 1e-5, extended=True).axes[0]
    order = {line.get_label(): line.get_zorder() for line in motion.lines}
    assert order["measured"] > max(value for name, value in order.items() if name != "measured")


def test_a_logarithm_of_a_resistance_is_drawn_in_ohm_and_its_error_in_percent() -> None:
    reading = drawn_reading("log_resistance", "ln(ohm)", np.log(np.geomspace(12.0, 90_000.0, 500)))
    assert (reading.name, reading.unit, reading.is_logarithmic) == ("resistance", "kΩ", True)
    assert reading.of(np.log(np.array([2e3])))[0] == pytest.approx(2.0)
    error = drawn_error("ln(ohm)", np.array([0.02]))
    assert (error.label, error.factor) == ("error [%]", 100.0)


def test_a_cell_of_few_samples_is_left_blank() -> None:
    x = np.array([0.5] * LEAST_COUNT + [1.5] * (LEAST_COUNT - 1))
    edges = np.array([0.0, 1.0, 2.0])
    means = cell_means((x, np.full(len(x), 0.5)), np.arange(len(x), dtype=float), (edges, edges))
    assert means[0, 0] == 0.5 * (LEAST_COUNT - 1)
    assert np.isnan(means[1, 0])
    assert np.isnan(means[:, 1]).all()


def test_spectra_of_pieces_are_those_of_the_pieces() -> None:
    record = join_pieces([piece(0, 512), piece(4000, 512)])
    figure = spectrum_figure(record, np.array([1.0, 500.0]), np.array([1e-6, 1e-6]), extended=False)
    measured = figure.axes[0].lines[0]
    at = measured.get_xdata()[np.argmax(measured.get_ydata())]
    assert at == pytest.approx(RATE / (2.0 * np.pi), abs=6.0)


def test_limits_keep_sines_steps_and_noise_whole_and_leave_single_spikes_out() -> None:
    draw = np.random.default_rng(0)
    sine = np.sin(0.01 * np.arange(5000))
    for values in (sine, np.sign(sine), draw.standard_normal(5000)):
        low, high, beyond = robust_limits(values)
        assert low < values.min() <= values.max() < high
        assert beyond == 0
    spiked = sine.copy()
    spiked[[7, 4000]] = -1e5, 1e9
    low, high, beyond = robust_limits(spiked)
    assert low == pytest.approx(-1.1, abs=0.01)
    assert (high, beyond) == (pytest.approx(1.1, abs=0.01), 2)
    assert robust_limits(np.full(3, np.nan)) == (0.0, 1.0, 0)


def test_the_spectrum_of_short_pieces_begins_at_one_period_of_a_piece() -> None:
    record = join_pieces([piece(200 * k, 200) for k in range(10)])
    axes = spectrum_figure(record, np.linspace(0.0, 500.0, 9), np.full(9, 1e-6), extended=False).axes[0]
    assert axes.get_xlim()[0] == pytest.approx(1.0 / 0.2), "below the motion, 9.5 Hz"


@pytest.mark.parametrize(
    ("unit", "rate"), [("mm", "mm/s"), ("mm/s", "mm/s^2"), ("m/s^2", "m/s^3"), ("V", "V/s")]
)
def test_the_rate_of_a_rate_has_its_own_power_of_the_second(unit: str, rate: str) -> None:
    assert rate_unit(unit) == rate


def test_the_plane_of_a_velocity_names_its_unit() -> None:
    shown = piece(0, 2000, output="velocity", unit="mm/s", output_rate=np.linspace(-1.0, 1.0, 2000))
    axes = plane_figure([shown], extended=False).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("velocity [mm/s]", "rate of the velocity [mm/s²]")
