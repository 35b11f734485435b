"""`rtctl.preview`: what was read of a dataset, with where its units come from; tables, a picture, notes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from first_look_cases import SIGNALS, motion, write_text
from PIL import Image

import rtctl
from rtctl.cli import main
from rtctl.measured.summary import strongest_hz

M = motion(6000)
MANIFEST = (
    '[dataset]\nname = "bench"\nplant = "oscillator"'
    + SIGNALS.replace("COLUMN", "x [mm]")
    + """[[records]]
file = "a.csv"
sample_rate_hz = 1000.0
rows = [0, 4000]
[[records]]
file = "b.csv"
sample_rate_hz = 1000.0
use = "test"
"""
)


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    for name in ("a.csv", "b.csv"):
        write_text(tmp_path / name, "u,x [mm]\n", M.u, M.x)
    (tmp_path / "dataset.toml").write_text(MANIFEST)
    return tmp_path / "dataset.toml"


def test_the_tables_tell_columns_units_and_values(manifest: Path) -> None:
    shown = rtctl.preview(manifest)
    drive, displacement = shown.signals
    assert (drive.column, drive.unit, drive.unit_from) == ("u", "V", "manifest")
    assert (displacement.column, displacement.unit_from) == ("x [mm]", 'manifest; file: "mm"')
    assert (drive.first, drive.largest) == (
        pytest.approx(M.u[0], rel=1e-5),
        pytest.approx(M.u.max(), rel=1e-5),
    )
    assert displacement.last == pytest.approx(M.x[-1], rel=1e-5)
    assert displacement.strongest_hz == pytest.approx(15.0, abs=0.7)
    assert drive.strongest_hz is None, "broadband: no line stands out"
    first, second = shown.records
    assert (first.rows, first.duration_s, first.rate_hz) == (4000, pytest.approx(4.0), 1000.0)
    assert (second.use, second.rows) == ("test", 6000)
    assert json.loads(json.dumps(shown.to_dict()))["signals"][0]["name"] == "drive"
    assert "displacement" in shown._repr_html_()


def test_the_picture_has_a_row_for_each_signal_in_its_unit(manifest: Path, tmp_path: Path) -> None:
    shown = rtctl.preview(rtctl.read_dataset(manifest))
    labels = [axes.get_ylabel() for axes in shown.plot().axes]
    rows = ["drive [V]", "displacement [mm]"]
    assert [label for label in labels if label in rows] == rows
    assert labels.count("amplitude density [V/√Hz]") == labels.count("amplitude density [mm/√Hz]") == 1
    assert shown.save(tmp_path / "look.png") == tmp_path / "look.png"
    assert np.asarray(Image.open(tmp_path / "look.png")).std() > 10.0


def test_the_verb_prints_the_tables_and_writes_the_picture(
    manifest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["preview", str(manifest), "--out", str(tmp_path / "look.png")]) == 0
    said = capsys.readouterr().out
    for words in ("bench: signals", "bench: records", "x [mm]", "1000 Hz", "look.png"):
        assert words in said
    assert main(["preview", str(manifest), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["picture"] is None
    assert main(["preview", str(tmp_path / "no.toml")]) == 2


def test_arrays_of_python_have_a_preview(tmp_path: Path) -> None:
    record = rtctl.Record(name="r", period_s=1e-3, signals={"drive": M.u, "displacement": M.x})
    dataset = rtctl.write_dataset(
        tmp_path, [record], name="mine", plant="oscillator", units={"drive": "V", "displacement": "mm"}
    )
    assert [one.column for one in rtctl.preview(dataset).signals] == ["drive", "displacement"]
    loose = rtctl.Dataset(
        path=tmp_path / "nowhere.toml", name="loose", plant="oscillator", units=dataset.units, holds=dataset.holds,
        records=dataset.records,
    )  # fmt: skip
    assert [one.column for one in rtctl.preview(loose).signals] == ["", ""]


def test_an_expert_is_told_of_clipping_few_samples_and_constants(tmp_path: Path) -> None:
    t = np.arange(4000) / 1000.0
    u = np.sin(2.0 * np.pi * 170.0 * t)
    x = np.clip(np.sin(2.0 * np.pi * 5.0 * t), -0.5, 0.5)
    record = rtctl.Record(
        name="r", period_s=1e-3, signals={"drive": 0.0 * u, "displacement": x, "velocity": u}
    )
    dataset = rtctl.write_dataset(
        tmp_path, [record], name="odd", plant="oscillator",
        units={"drive": "V", "displacement": "mm", "velocity": "mm/s"},
    )  # fmt: skip
    notes = " | ".join(rtctl.preview(dataset).notes)
    assert "drive is 0 V throughout" in notes
    assert re.search(r"displacement stays \d+ samples at an extreme: clipped\?", notes)
    assert "velocity: its strongest line, 170 Hz, has 5.88 samples a period" in notes


def test_the_strongest_line_is_that_of_a_tone_and_none_of_noise() -> None:
    t = np.arange(5000) / 500.0
    noise = np.random.default_rng(2).normal(size=5000)
    assert strongest_hz(np.sin(2.0 * np.pi * 12.5 * t) + 0.1 * noise, 2e-3) == pytest.approx(12.5, abs=0.1)
    assert strongest_hz(noise, 2e-3) is None
    assert strongest_hz(np.ones(100), 2e-3) is None


def test_the_report_of_a_diagnosis_has_the_tables_behind_a_fold(manifest: Path) -> None:
    from rtctl.diagnosis.report.page.sections import tabulate_data

    html = tabulate_data(rtctl.read_dataset(manifest))
    assert html.startswith("<details><summary>What was read: 2 signals, 2 records</summary>")
    assert "x [mm]" in html
    assert "b.csv" in html


def test_a_random_staircase_and_a_trend_have_no_strongest_line() -> None:
    rng = np.random.default_rng(5)
    levels = np.repeat(rng.uniform(0.0, 24.0, 40), 45)
    assert strongest_hz(levels, 1.0) is None
    assert strongest_hz(np.cumsum(rng.normal(size=4000)), 1.0) is None
    assert strongest_hz(levels + 60.0 * np.sin(2.0 * np.pi * 0.05 * np.arange(1800)), 1.0) == pytest.approx(
        0.05, rel=0.02
    )


def test_the_strongest_record_is_in_the_spectra_beside_the_longest(tmp_path: Path) -> None:
    m = motion(1500)
    records = [
        rtctl.Record(
            name=name,
            period_s=1e-3,
            use="fit",
            signals={"drive": size * m.u[:end], "displacement": size * m.x[:end]},
        )
        for name, size, end in (("long", 1.0, 1500), ("strong", 10.0, 1000), ("weak", 0.1, 1000))
    ]
    dataset = rtctl.write_dataset(
        tmp_path, records, name="two", plant="oscillator", units={"drive": "V", "displacement": "mm"}
    )
    spectrum = rtctl.preview(dataset).plot().axes[2]
    assert [len(line.get_xdata()) > 3 for line in spectrum.lines] == [True, True]


def words_of(shown: rtctl.Preview) -> str:
    from matplotlib.text import Text

    return " | ".join(str(one.get_text()) for one in shown.plot().findobj(Text))


def test_the_picture_tells_what_only_leads_to_the_test(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    shown = rtctl.init(path, plot=False).summary
    words = words_of(shown)
    assert "2 records of an oscillator, 6 s" in words
    assert "fit 4 s in 1 record; test 2 s in 1 record, after 4 s that only lead there" in words


def test_nothing_leads_to_records_that_are_scored_from_their_first_row(manifest: Path) -> None:
    assert "only lead there" not in words_of(rtctl.preview(manifest))
    manifest.write_text(MANIFEST + "ignore_first = 500\n")
    assert "after 0.5 s that only lead there" in words_of(rtctl.preview(manifest))


def test_the_largest_place_of_a_response_is_not_given_as_a_natural_frequency(
    manifest: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = words_of(rtctl.preview(manifest))
    assert re.search(r"largest at 1[45]\.\d+ Hz, where the drive counts too", words)
    assert "strongest line" not in words
    assert main(["preview", str(manifest)]) == 0
    assert "spectrum largest" in re.sub(r"\s+", " ", capsys.readouterr().out)
