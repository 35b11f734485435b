"""The ME study's short run: every step yields its section, and its claims hold by bounds that are derived."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from PIL import Image

from rtctl.cli import main
from rtctl.identification.oscillator.tone_cost import simulate_tone
from rtctl.reproduce.me import device
from rtctl.reproduce.me.fits import sized, tone_record, truth
from rtctl.reproduce.me.magnetisation import cycle_of, departure, distortion, langevin, magnetisation
from rtctl.reproduce.me.printed import TABLE_A1, below_the_drive, quality
from rtctl.reproduce.me.steps import coil
from rtctl.reproduce.me.steps.array import drift_alone, mode
from rtctl.reproduce.me.study import STUDY


@pytest.fixture(scope="module")
def sections(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, object]]:
    """The short run, by the command."""
    folder = tmp_path_factory.mktemp("me")
    assert main(["reproduce", "me", "--out", str(folder), "--short", "--quiet"]) == 0
    found = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    for section in found["sections"]:
        for part in section["parts"]:
            if part["kind"] == "picture":
                with Image.open(folder / "pictures" / part["file"]) as image:
                    assert image.width > 400
                    assert len(image.getcolors(1 << 20) or ()) > 10, "more than an empty page"
    return {section["name"]: section for section in found["sections"]}


def row(section: dict[str, object], quantity: str) -> float:
    rows = [r for part in section["parts"] if part["kind"] == "comparison" for r in part["rows"]]  # type: ignore[attr-defined]
    return float(next(r["ours"] for r in rows if r["quantity"].startswith(quantity)))


def table(section: dict[str, object], title: str) -> list[list[str]]:
    parts = [part for part in section["parts"] if part["kind"] == "table"]  # type: ignore[attr-defined]
    return list(next(part["rows"] for part in parts if title in part["title"]))


@pytest.mark.slow
def test_every_step_yields_its_section(sections):
    assert list(sections) == [step.name for step in STUDY.steps]


@pytest.mark.slow
def test_annealing_follows_the_record_no_worse_than_the_paper(sections):
    assert row(sections["coefficients"], "correlation with the record") >= 0.995


@pytest.mark.slow
def test_the_letter_drives_the_error_up_and_the_meant_algorithm_down(sections):
    error = table(sections["coefficients"], "by its letter")[1]
    start, letter, meant = (float(value) for value in error[1:4])
    assert letter > start > meant


@pytest.mark.slow
def test_least_squares_reaches_the_noise_that_annealing_only_nears(sections):
    rows = {cells[0]: cells for cells in table(sections["least-squares"], "Median of the seeds")}
    own = rows["least squares, its own start (weak form)"]
    assert own[1] == "1 of 1"
    # four parameters of 10,000 samples: the noise of 0.5 nm times sqrt(4 / 10000), and the quintic's 0.03 nm
    assert float(own[3].split()[0]) < 0.06


@pytest.mark.slow
def test_below_30_db_least_squares_still_finds_the_damping_from_rest(sections):
    assert row(sections["noise"], "damping at 10 dB from rest, least squares") < 5.0


@pytest.mark.slow
def test_a_steady_tone_hides_40_per_cent_of_the_damping(sections):
    for _, off, steady, from_rest in table(sections["noise"], "One steady motion"):
        assert abs(float(off)) >= 20.0
        assert float(steady) > 0.9999 > float(from_rest)


@pytest.mark.slow
def test_the_resonance_softens_then_hardens_and_the_device_agrees(sections):
    peaks = [float(cells[1]) for cells in table(sections["response"], "The curves")]
    assert peaks[1] < peaks[0] < peaks[2]
    for cells in table(sections["response"], "Check in time"):
        for tried in (cells[2], cells[4]):
            count, of = tried.split(" of ")
            assert count == of != "0"


@pytest.mark.slow
def test_the_third_harmonic_rises_out_of_the_noise_between_the_paper_s_two_fields(sections):
    weak, strong = (row(sections["harmonics"], f"third harmonic at {field} mT") for field in ("0.28", "0.8"))
    # a cubic spring's third harmonic grows with the square of the amplitude: more than twice here
    assert strong - weak > 20.0 * math.log10(2.0**1.5)
    assert (
        row(sections["harmonics"], "THD in resonance")
        < row(sections["harmonics"], "THD below resonance")
        < 2.48
    )


@pytest.mark.slow
def test_force_and_stiffness_lead_over_wide_ranges_and_damping_counts_over_narrow_ones(sections):
    rows = {
        cells[0]: [float(cell) for cell in cells[1:]]
        for cells in table(sections["sensitivity"], "Mean elasticity")
    }
    # far from resonance the amplitude is F / |k - w^2|: exactly proportional to the force, blind to the damping
    assert rows["force"][0] == pytest.approx(1.0, abs=0.01)
    assert rows["stiffness"][0] > rows["force"][0] > 10.0 * rows["damping"][0]
    assert rows["damping"][2] > 10.0 * rows["damping"][0]


@pytest.mark.slow
def test_the_array_predicts_another_field_better_than_the_paper(sections):
    assert row(sections["array"], "correlation, mean of the points") >= 0.99
    assert abs(row(sections["array"], "its error against the measured one")) < 3.0


@pytest.mark.slow
def test_the_diagnosis_names_the_hysteresis_that_duffing_misses(sections):
    causes = [cells[0] for cells in table(sections["hysteresis"], "What the diagnosis named")]
    assert causes == ["hysteresis.bouc_wen"]
    assert row(sections["hysteresis"], "RMS error on the test record") > 2.0


@pytest.mark.wire
@pytest.mark.slow
def test_the_loop_stands_on_the_unstable_branch_over_the_wire(sections):
    points = table(sections["continuation"], "Points")
    assert [cells[-1] for cells in points] == ["unstable"]
    # a hundredth of the half-width of 9.4 Hz; amplitude and frequency move together along the branch
    assert row(sections["continuation"], "largest error of frequency") < 0.1
    assert row(sections["continuation"], "largest error of amplitude") < 0.5


def test_an_amplitude_that_a_correlation_does_not_see_is_restored():
    values = truth()
    record = tone_record(simulate_tone(tone_record(np.ones(4000)), values))
    scaled = values * np.array([1.0, 1.0, 1.3**-2, 1.3, 1.0])
    assert sized(record, scaled) == pytest.approx(values, rel=1e-4)  # what is left of a mean in 4000 samples


def test_no_printed_point_is_a_resonator():
    assert len(TABLE_A1) == 10
    for one in TABLE_A1:
        assert quality(one.mass, one.delta, one.alpha) < 1.0
        assert below_the_drive(one) > 1e4


def test_table_a1_s_frequencies_drift_apart_by_themselves():
    rates = np.array([0.0, 0.5, -0.5]) + 46_633.0
    # sin(0.5) / 0.5 over one second
    assert drift_alone(rates) == pytest.approx([1.0, 0.958851, 0.958851], rel=1e-5)


def test_the_mode_is_clamped_at_one_end_and_1_at_the_other():
    assert mode(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 0.33952, 1.0], abs=1e-4)


def test_langevin_joins_its_series_and_saturates():
    a = np.array([0.0199999, 0.0200001])
    assert np.diff(langevin(a))[0] == pytest.approx(2e-7 / 3.0, rel=1e-3)
    assert float(magnetisation(np.array(1e4))) == pytest.approx(device.SATURATION, rel=1e-3)


def test_distortion_of_a_weak_field_is_its_cubic_term():
    # a^3/45 against a/3: third harmonic a^2 / 60 of the fundamental
    field = 0.02
    assert distortion(magnetisation(cycle_of(field))) == pytest.approx(
        (device.ARGUMENT * field) ** 2 / 60.0, rel=1e-3
    )
    assert departure(0.1) == pytest.approx((device.ARGUMENT * 0.1) ** 2 / 15.0, rel=1e-3)


def test_the_beam_of_one_layer_has_the_text_books_frequency():
    modulus = coil.young(*coil.LAYERS[1][2:])
    exact = 3.5160152685 / (2.0 * math.pi * 9e-6) * 50e-6 * math.sqrt(modulus / (12.0 * 2329.0))
    assert coil.bending_hz(coil.LAYERS[1:2]) == pytest.approx(exact, rel=1e-9)
