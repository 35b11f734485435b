"""The top of an answer says what the model is: its main figures with standard errors, and what makes it nonlinear."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from diagnosis_cases import device, measured, noise_drive, write_case

import rtctl
from rtctl.cli.printing.diagnosis import print_diagnosis
from rtctl.diagnosis.report.page.summary import describe_causes, describe_verdict

SOFTENING, CUBIC_UNIT = -300.0, "1/(mm^2*s^2)"


@pytest.fixture(scope="module")
def beam(tmp_path_factory: pytest.TempPathFactory) -> rtctl.Diagnosis:
    """Diagnosis of a softening beam whose nominal model has the cubic stiffness: nothing is wrong."""
    folder = tmp_path_factory.mktemp("softening")
    soft = device(stiffness_cubic=(SOFTENING, CUBIC_UNIT))
    records = [
        (noise_drive(seed), measured(soft, noise_drive(seed)), use)
        for seed, use in ((1, "fit"), (2, "fit"), (3, "test"))
    ]
    manifest, model = write_case(folder, records), folder / "model.toml"
    cubic = f'stiffness_cubic = {{ value = {0.9 * SOFTENING}, unit = "{CUBIC_UNIT}" }}'
    model.write_text(f"{model.read_text()}{cubic}\n")
    return rtctl.diagnose(manifest, model, mechanisms="friction.coulomb")


def test_the_verdict_names_the_spring_with_its_size_and_error(beam: rtctl.Diagnosis) -> None:
    assert beam.verdict == "adequate"
    said = describe_verdict(beam.answer)
    spring = r"Beyond a linear oscillator it has a softening spring \(stiffness_cubic = (\S+) .*"
    found = re.search(spring + r", standard error (\S+) ", said)
    assert found, said
    assert abs(float(found[1]) - SOFTENING) < 5.0 * float(found[2])


def test_natural_frequency_and_damping_ratio_stand_on_top_with_their_errors(
    beam: rtctl.Diagnosis, capsys: pytest.CaptureFixture[str]
) -> None:
    print_diagnosis(beam.answer, Path("answer"))
    printed = capsys.readouterr().out.splitlines()
    figures = r"natural frequency \S+ Hz, standard error \S+ Hz; damping ratio \S+ %, standard error \S+ %"
    assert re.fullmatch(f"  {figures}", printed[2]), printed
    assert sum("natural frequency" in line for line in printed) == 1
    assert sum("cubic force" in line for line in printed) == 1
    assert re.search(figures[1:], describe_causes(beam.answer))
    rest = next(line for line in printed if line.startswith("  re-fitted model: "))
    assert all("standard error" in one for one in rest.split("; "))
