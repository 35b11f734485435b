"""What the fitted poles say of the kind of plant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import device, noise_drive, write_case

import rtctl
from rtctl.cli.printing.diagnosis import print_diagnosis
from rtctl.diagnosis.report.page.sections import tabulate_derived, tabulate_parameters
from rtctl.diagnosis.report.page.summary import describe_kind_doubt
from rtctl.identification.oscillator.response import describe_response


def test_a_response_with_a_resonance_is_not_remarked_on() -> None:
    assert describe_response(device()) == ""
    assert describe_response(device(damping=(120.0, "1/s"))) == ""


@pytest.mark.parametrize("damping", [147.2, 159.0, 180.0, 220.0])
def test_a_response_that_hardly_rings_may_be_that_of_an_oscillator_or_of_other_stages(damping: float) -> None:
    """Quality factors 0.86 (a loudspeaker, tanks that overflow), 0.8 (a geophone), 0.7, 0.575: real poles give 0.5."""
    said = describe_response(device(damping=(damping, "1/s")))
    assert "hardly rings (quality factor " in said
    assert "A well damped oscillator does that" in said


def test_one_whose_poles_may_be_real_is_remarked_on() -> None:
    """Quality factor sqrt(1.6e4) / 240: 0.527."""
    said = describe_response(device(damping=(240.0, "1/s")))
    assert "quality factor 0.527, and not clearly above 0.5" in said
    assert "reach up to 0.5" in said


@pytest.mark.parametrize(("error", "clear"), [(1.0, True), (10.0, False), (np.inf, False)])
def test_how_clear_that_is_follows_its_standard_error_where_there_is_one(error: float, clear: bool) -> None:
    """0.527 is 5.3 % above 0.5: 13 standard errors of 0.4 %, 1.2 of 4.2 %."""
    found = describe_response(device(damping=(240.0, "1/s")), {"damping": error, "stiffness": 0.0})
    assert ("hardly rings" in found) == clear


@pytest.mark.parametrize(("damping", "both"), [(1260.0, False), (300.0, True)])
def test_stages_of_the_first_order_are_told_with_their_times(damping: float, both: bool) -> None:
    """Poles by numpy, of s^2 + damping s + 1.6e4."""
    said = describe_response(device(damping=(damping, "1/s")))
    fast, slow = np.sort(1.0 / np.abs(np.roots([1.0, damping, 1.6e4])))
    assert f"{slow:.3g} s" in said
    assert (f"another stage with {fast:.3g} s" in said) == both
    assert "records at two frequencies" in said


def test_two_tanks_are_said_to_be_no_oscillator_below_the_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two tanks one above the other, whose outflow goes with the root of the level: no law of the catalogue."""
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = 0.5 + 0.25 * np.tanh(noise_drive(seed, 2.0))
        upper = lower = 0.0
        reading = []
        for flow in drive:
            reading.append(lower)
            for _ in range(4):
                out = 12.0 * np.sqrt(upper)
                upper = max(upper + 5e-4 * (40.0 * flow - out), 0.0)
                lower = max(lower + 5e-4 * (out - 14.0 * np.sqrt(lower)), 0.0)
        rng = np.random.default_rng(seed)
        records.append((drive, np.array(reading) + 0.004 * rng.standard_normal(len(drive)), use))
    manifest = write_case(tmp_path, records)
    mechanisms = "stiffness.cubic,damping.quadratic"
    found = rtctl.diagnose(manifest, tmp_path / "model.toml", mechanisms=mechanisms).answer
    assert found.verdict in ("unexplained", "partly_explained")
    assert "is this an oscillator?" in found.kind_doubt.lower()
    assert found.kind_doubt in found.warnings
    print_diagnosis(found, tmp_path)
    below_the_verdict = capsys.readouterr().out.splitlines()[1]
    assert below_the_verdict.strip() == found.kind_doubt
    assert "s this an oscillator?" in describe_kind_doubt(found)
    assert "docs/equations.md" in found.kind_doubt
    parameters = tabulate_parameters(found)  # of a model that lacks something: values without intervals
    assert "may be off by more" in tabulate_derived(found)
    assert "re-fitted, 95 %" not in parameters
    assert "[" not in parameters.partition("with the causes")[0]
