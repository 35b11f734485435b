"""Two examples of every verb, for its `--help`."""

from __future__ import annotations

import argparse

EXAMPLES: dict[str, tuple[str, ...]] = {
    "run": (
        "rtctl run steps --out out/steps",
        "rtctl run steps --model model.toml --set driver.kind=modbus-tcp --set driver.address=192.0.2.7:502",
    ),
    "set": ('rtctl set out/steps setpoint="30 um"', "rtctl set out/steps controller.kp=0.02"),
    "watch": ("rtctl watch out/steps", "rtctl watch out/steps --control --mcap steps.mcap --epics LAB:VO2:"),
    "export": (
        "rtctl export fmu --model model.toml --dataset data/dataset.toml --out model.fmu",
        "rtctl export c --scenario steps --model model.toml --out loop_c",
    ),
    "doubt": ("rtctl doubt out/steps", "rtctl doubt out/steps --live --policy retune"),
    "replay": ("rtctl replay out/steps", "rtctl replay out/steps --export loop_c"),
    "recover": ("rtctl recover out/steps", "rtctl recover out/steps --json"),
    "acquire": (
        "rtctl acquire acquire_oscillator --out data",
        "rtctl acquire acquire_vo2 --set driver.kind=modbus-tcp --set driver.address=192.0.2.7:502 --out data",
    ),
    "init": (
        "rtctl init run*.csv --yes --time t:ms --input u:V --output displacement=x:mm --out study",
        "rtctl init heater*.mat --yes --model heater.toml --out study",
    ),
    "preview": ("rtctl preview data/dataset.toml", "rtctl preview data/dataset.toml --out look.png"),
    "identify": (
        "rtctl identify data/dataset.toml --out model.toml",
        "rtctl identify data/dataset.toml --model start.toml --starts 12 --out model.toml",
    ),
    "simulate": (
        "rtctl simulate model.toml data/dataset.toml --out compared",
        "rtctl simulate model.toml data/dataset.toml --out compared --no-plot --json",
    ),
    "diagnose": (
        "rtctl diagnose data/dataset.toml --out answer",
        "rtctl diagnose data/dataset.toml --model model.toml --out answer --mechanisms friction.coulomb,drive.delay",
    ),
    "reproduce": ("rtctl reproduce vo2 --out out/vo2 --short", "rtctl reproduce bistable --out out/bistable"),
    "sweep": (
        "rtctl sweep basins_beam --out out/basins",
        "rtctl sweep campaign.toml --out out/campaign --scheduler tcp://192.0.2.7:8786",
    ),
    "latency": (
        "rtctl latency --out out/latency",
        'rtctl latency --driver modbus-tcp --set driver.address=192.0.2.7:502 --period "1 ms" --out out/latency',
    ),
    "serve": (
        "rtctl serve vo2_a --modbus-tcp 127.0.0.1:5020",
        'rtctl serve vo2_b --serial /tmp/vo2 --baud 115200 --page --faults "drop rate=0.01; stall at=5s duration=1s"',
    ),
    "firmware": ("rtctl firmware --out firmware", "rtctl firmware vo2_b --out firmware_b"),
    "list": ("rtctl list", "rtctl list mechanisms"),
    "sbom": ("rtctl sbom", "rtctl sbom --out rtctl.cdx.json"),
    "completion": (
        "rtctl completion bash >> ~/.bash_completion",
        "rtctl completion fish > ~/.config/fish/completions/rtctl.fish",
    ),
    "demo": ("rtctl demo", "rtctl demo --device vo2_b --out out/demo_b"),
}
HEADING = "examples:\n"


def epilog_of(verb: str) -> str:
    """Return the text below the options of a verb."""
    return HEADING + "\n".join(f"  {line}" for line in EXAMPLES.get(verb, ()))


class VerbHelp(argparse.HelpFormatter):
    """Help whose examples keep their lines."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        if text.startswith(HEADING):
            return text
        return super()._fill_text(text, width, indent)
