"""Bad input in Python is one InputError that names the argument, its limits or the nearest valid name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import rtctl

VO2 = {"kind": "vo2"}
CASES: dict[str, tuple[Callable[[], Any], list[str]]] = {
    "missing dataset": (lambda: rtctl.read_dataset("none.toml"), ["none.toml: no such file"]),
    "missing model": (lambda: rtctl.read_model(Path("none.toml")), ["none.toml: no such file"]),
    "dataset of a wrong type": (lambda: rtctl.read_dataset(5), ["dataset must be a path", "got int 5"]),  # type: ignore[arg-type]
    "model of a wrong type": (lambda: rtctl.read_model([1.0]), ["model must be a path", "got list"]),  # type: ignore[arg-type]
    "diagnose a wrong type": (lambda: rtctl.diagnose(None, "m.toml"), ["dataset must be a path", "NoneType"]),  # type: ignore[arg-type]
    "simulate a wrong type": (lambda: rtctl.simulate(1.5, "d.toml"), ["model must be a path", "float 1.5"]),  # type: ignore[arg-type]
    "unknown scenario": (lambda: rtctl.run("stepz"), ["no such scenario file", 'did you mean "steps"?']),
    "scenario of a wrong type": (lambda: rtctl.run(3), ["scenario must be a path", "int 3"]),  # type: ignore[arg-type]
    "unknown key": (
        lambda: rtctl.run("steps", settings={"scenario.perod": "1 ms"}),
        ['did you mean "period"?'],
    ),
    "wrong unit": (
        lambda: rtctl.run("steps", settings={"scenario.period": "1 V"}),
        ["not compatible with s"],
    ),
    "no unit": (lambda: rtctl.run("steps", settings={"scenario.period": 1}), ['write "1 s"']),
    "unknown driver": (lambda: rtctl.run("steps", driver="modbus-tpc"), ["modbus-tpc", "modbus-tcp"]),
    "driver of a wrong type": (lambda: rtctl.run("steps", driver=7), ["driver must be a kind", "int 7"]),  # type: ignore[arg-type]
    "unknown estimator": (lambda: rtctl.run("steps", estimator="observr"), ["observr", "observer"]),
    "unknown controller key": (
        lambda: rtctl.run("steps", controller={"kind": "pi", "kpp": 1.0}),
        ["kpp", 'did you mean "kp"?'],
    ),
    "settings of a wrong type": (lambda: rtctl.run("steps", settings=4), ["settings must be a mapping"]),  # type: ignore[arg-type]
    "a value that TOML does not have": (
        lambda: rtctl.run("steps", settings={"scenario.duration": object()}),
        ["scenario.duration"],
    ),
    "missing plant": (
        lambda: rtctl.acquire("acquire_vo2", "out", driver={"kind": "inprocess", "device": "vo2_x"}),
        ['no bundled plant "vo2_x"'],
    ),
    "plays too many": (lambda: rtctl.identify("d.toml", kind="vo2", plays=65), ["plays 65: 1 to 64"]),
    "plays no number": (
        lambda: rtctl.identify("d.toml", kind="vo2", plays=2.5),  # type: ignore[arg-type]
        ["plays must be an integer from 1 to 64", "2.5"],
    ),
    "starts true": (
        lambda: rtctl.identify("d.toml", kind="oscillator", starts=True),
        ["starts must be an integer"],
    ),
    "cells": (lambda: rtctl.identify("d.toml", kind="vo2", cells=7), ["cells 7: 8 to 80"]),
    "unknown kind": (lambda: rtctl.identify("d.toml", kind="oscilator"), ['did you mean "oscillator"?']),
    "rate": (lambda: rtctl.diagnose("d.toml", "m.toml", false_claim_rate=0.5), ["0.5", "below 0.5"]),
    "rate no number": (
        lambda: rtctl.diagnose("d.toml", "m.toml", false_claim_rate="5 %"),  # type: ignore[arg-type]
        ["false_claim_rate must be a number", "'5 %'"],
    ),
    "seconds": (lambda: rtctl.diagnose("d.toml", "m.toml", seconds=float("nan")), ["must be 0 or more"]),
    "work": (lambda: rtctl.diagnose("d.toml", "m.toml", work=-1.0), ["work -1", "simulated steps"]),
    "progress": (lambda: rtctl.simulate("m.toml", "d.toml", progress="yes"), ["progress must be"]),  # type: ignore[arg-type]
    "workers": (lambda: rtctl.sweep("basins_beam", "out", workers=0), ["workers 0", "at least 1"]),
    "unknown campaign": (lambda: rtctl.sweep("basins_beem", "out"), ['did you mean "basins_beam"?']),
    "unknown study": (lambda: rtctl.reproduce_study("vo3", "out"), ['did you mean "vo2"?']),
    "no recording": (lambda: rtctl.replay("nowhere"), ["nowhere"]),
    "no run": (lambda: rtctl.change("nowhere", "setpoint", 30.0), ["no run is under way"]),
    "latency": (lambda: rtctl.measure_latency(["modbus"]), ['"modbus" cannot be measured', "modbus-"]),
    "period": (lambda: rtctl.measure_latency(periods=["1 mm"]), ["not compatible with s"]),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_one_message_that_names_it(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call, words = CASES[name]
    with pytest.raises(rtctl.InputError) as refused:
        call()
    message = str(refused.value)
    assert [word for word in words if word not in message] == []
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_name_of_the_package_offers_the_nearest() -> None:
    with pytest.raises(AttributeError, match=r'no attribute "diagnoze"; did you mean "diagnose"\?'):
        _ = rtctl.diagnoze  # type: ignore[attr-defined]
