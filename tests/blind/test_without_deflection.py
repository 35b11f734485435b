"""A VO2 actuator without an instrument for its deflection: diagnosed by the film's resistance alone."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from case import diagnosed, identified
from generator import generate


@pytest.mark.slow
def test_a_delay_is_named_by_the_resistance_alone(tmp_path: Path) -> None:
    generate(
        200_500, tmp_path, plant="vo2", effects=("actuation.delay",), samples=3000, fit_records=2, test_records=1,
        snr_dB=50.0, file_format="npz", missing_deflection=False,
    )  # fmt: skip
    identified(tmp_path)
    without_deflection(tmp_path)
    found = diagnosed(tmp_path)
    assert [cause.id for cause in found.causes] == ["actuation.delay"]
    assert found.verdict in ("explained", "partly_explained")
    assert found.gain is not None
    assert (found.gain.output, found.gain.unit) == ("log_resistance", "ln(ohm)")
    assert found.gain.ratio_low > 1.0
    assert "no record to fit has a deflection: the diagnosis used the resistance alone" in found.warnings[0]


def without_deflection(folder: Path) -> None:
    """Takes that column out of all records but the quasi-static ones."""
    manifest = tomllib.loads((folder / "dataset.toml").read_text(encoding="utf-8"))
    column = manifest["signals"]["deflection"].get("column", "deflection")
    for record in manifest["records"]:
        if record.get("use") != "identify":
            with np.load(folder / record["file"]) as columns:
                kept = {name: values for name, values in columns.items() if name != column}
            np.savez(folder / record["file"], **kept)
    (folder / "dataset.toml").write_text(tomli_w.dumps(manifest), encoding="utf-8")
