"""A velocity or acceleration that somebody computed from the displacement is no second instrument."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Record
from rtctl.measured.reading import read_dataset
from rtctl.measured.records.instrument import Instrument, instrument_of

PERIOD_S, SAMPLES = 1e-3, 3000


def motion(noise: float, seed: int = 0) -> dict[str, FloatArray]:
    """Displacement, velocity and acceleration of two tones, each read by an instrument of its own."""
    random, t = np.random.default_rng(seed), PERIOD_S * np.arange(SAMPLES)
    rates = 2.0 * np.pi * np.array([[31.0], [52.0]])
    exact = {
        "displacement": np.sin(rates * t).sum(axis=0),
        "velocity": (rates * np.cos(rates * t)).sum(axis=0),
        "acceleration": (-(rates**2) * np.sin(rates * t)).sum(axis=0),
    }
    return {name: y + noise * y.std() * random.standard_normal(SAMPLES) for name, y in exact.items()}


def record(**signals: FloatArray) -> Record:
    return Record(name="r", period_s=PERIOD_S, signals={"drive": np.ones(SAMPLES), **signals})


def looked_at(*records: Record) -> Instrument:
    return instrument_of(records, "oscillator", {"drive": "linear"})


def backward(x: FloatArray) -> FloatArray:
    return np.diff(x, prepend=x[0]) / PERIOD_S


def forward(x: FloatArray) -> FloatArray:
    return np.diff(x, append=x[-1]) / PERIOD_S


def central(x: FloatArray) -> FloatArray:
    return np.asarray(np.gradient(x, PERIOD_S))


@pytest.mark.parametrize("noise", [0.0, 1e-4, 0.01])
@pytest.mark.parametrize("quotient", [central, forward, backward])
def test_a_velocity_computed_from_the_displacement_is_left_out(quotient: object, noise: float) -> None:
    x = motion(noise)["displacement"]
    computed = np.round(quotient(np.round(x, 7)), 4)  # type: ignore[operator]
    whole = record(displacement=x, velocity=computed)
    instrument = looked_at(whole)
    assert instrument.left_out == {"velocity": "displacement"}
    assert set(instrument.applied(whole).signals) == {"drive", "displacement"}


@pytest.mark.parametrize("noise", [1e-4, 0.01])
def test_so_is_an_acceleration_computed_from_either(noise: float) -> None:
    x = motion(noise)["displacement"]
    v = central(x)
    for signals in ({"velocity": v, "acceleration": central(v)}, {"acceleration": central(v)}):
        assert set(looked_at(record(displacement=x, **signals)).left_out) == set(signals)
    neighbours = np.convolve(x, (1.0, -2.0, 1.0), mode="same") / PERIOD_S**2
    found = looked_at(record(displacement=x, acceleration=neighbours))
    assert found.left_out == {"acceleration": "displacement"}


@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-3, 0.05])
def test_instruments_of_their_own_are_kept(noise: float) -> None:
    whole = record(**motion(noise))
    instrument = looked_at(whole)
    assert instrument.left_out == {}
    assert instrument.applied(whole).signals == whole.signals


def test_it_has_to_be_so_in_all_records() -> None:
    x = motion(0.01)["displacement"]
    computed, read = record(displacement=x, velocity=central(x)), record(**motion(0.01, seed=1))
    assert looked_at(computed, read).left_out == looked_at(read, computed).left_out == {}


def test_the_dataset_says_so_and_has_the_displacement_alone(tmp_path: Path) -> None:
    x = motion(0.01)["displacement"]
    table = np.column_stack((np.sin(np.arange(SAMPLES)), x, central(x)))
    np.savetxt(tmp_path / "r.csv", table, delimiter=",", header="u,x,v", comments="", fmt="%.8g")
    (tmp_path / "dataset.toml").write_text(
        '[dataset]\nname = "b"\nplant = "oscillator"\n'
        '[signals.drive]\nrole = "input"\nunit = "V"\ncolumn = "u"\n'
        '[signals.displacement]\nrole = "output"\nunit = "mm"\ncolumn = "x"\n'
        '[signals.velocity]\nrole = "output"\nunit = "mm/s"\ncolumn = "v"\n'
        '[[records]]\nfile = "r.csv"\nsample_rate_hz = 1000\nuse = "fit"\n'
    )
    data = read_dataset(tmp_path / "dataset.toml")
    assert list(data.units) == ["drive", "displacement"]
    assert set(data.records[0].signals) == {"drive", "displacement"}
    assert "velocity is the difference quotient of displacement" in " ".join(data.remarks)
    found = rtctl.simulate(written_model(tmp_path), tmp_path / "dataset.toml")
    assert set(found.records["r"].simulated) == {"displacement"}
    assert "velocity is the difference quotient of displacement" in " ".join(found.summary["remarks"])


def written_model(folder: Path) -> Path:
    parameters = {"damping": (5.0, "1/s"), "stiffness": (4e4, "1/s^2"), "drive_gain": (1e3, "mm/(s^2*V)")}
    tables = [f'[model.parameters.{k}]\nvalue = {v}\nunit = "{u}"\n' for k, (v, u) in parameters.items()]
    (folder / "model.toml").write_text('[model]\nkind = "oscillator"\n' + "".join(tables))
    return folder / "model.toml"
