"""What all cases of foreign oscillators write alike: folders, a rough model file, and what was hidden."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from foreign_common import write_truth
from foreign_oscillator_device import Effect
from foreign_oscillator_sizes import choose
from foreign_oscillator_styles import Bench


class Lab(NamedTuple):
    """What is a lab's own in its cases."""

    hide: Callable[[str, int, tuple[str, ...]], tuple[Any, tuple[Effect, ...], tuple[float, ...]]]
    records: Callable[[Any, tuple[Effect, ...], int, Path], str]  # writes the files, returns their manifest
    model: Callable[[Any, np.random.Generator], str]  # of the user, as text
    truth: Callable[[Any, tuple[Effect, ...], tuple[float, ...], int], dict[str, object]]
    stream: Callable[[str, int, str], np.random.Generator]


def write_case(
    lab: Lab, style: str, seed: int, folder: Path, names: tuple[str, ...] | None, which: str
) -> Path:
    """Write the case to `folder`; `names` are hidden, or what the seed draws if None. Returns the manifest's path."""
    bench, effects, shares = lab.hide(
        style, seed, choose(style, seed, which, lab.hide) if names is None else names
    )
    data, truth = folder / "data", folder / "truth"
    for part in (data, truth):
        part.mkdir(parents=True, exist_ok=True)
    (data / "dataset.toml").write_text(lab.records(bench, effects, seed, data), encoding="utf-8")
    if bench.user != "identify":
        model = lab.model(bench, lab.stream(style, seed, "values"))
        (data / f"{bench.user}.toml").write_text(model, encoding="utf-8")
    write_truth(truth, lab.truth(bench, effects, shares, seed))
    return data / "dataset.toml"


def model_text(values: dict[str, tuple[float, str]]) -> str:
    """Text of a model file with these parameters and units."""
    lines = ["[model]", 'kind = "oscillator"', "", "[model.parameters]"]
    lines += [
        f'{name} = {{ value = {value:.6g}, unit = "{unit}" }}' for name, (value, unit) in values.items()
    ]
    return "\n".join(lines) + "\n"


def told_effects(
    effects: tuple[Effect, ...], shares: tuple[float, ...], equations: Mapping[str, str], *, read_at_end: bool
) -> dict[str, object]:
    """What was hidden in a device, as its truth tells it."""
    ids = [effect.id for effect in effects]
    hidden = [
        {"name": e.name, "id": e.id, "equation": equations[e.name], "size": e.size, "unit": e.unit,
         "values": e.values, "share": share}
        for e, share in zip(effects, shares, strict=True)
    ]  # fmt: skip
    return {
        "effect": ids[0] if ids else None,
        "second": ids[1] if len(ids) > 1 else None,
        "name": effects[0].name if effects else None,
        "effects": hidden,
        "share": min(shares, default=0.0),
        "also_true": ["timing.skew"] if read_at_end and "timing.skew" not in ids else [],
    }


def told_case(
    bench: Bench,
    seed: int,
    effects: tuple[Effect, ...],
    shares: tuple[float, ...],
    *,
    equations: Mapping[str, str],
    over: str,
    device: dict[str, object],
) -> dict[str, object]:
    """What an oscillator's truth says; `over`: what the shares are of."""
    late = bench.device.read_at_end
    return {
        "style": bench.style,
        "seed": seed,
        "share_is": f"RMS left by a re-fit of the user's model over RMS of the {over}, start known",
        **told_effects(effects, shares, equations, read_at_end=late),
        "groups": ["read at the end" if late else "read at the start", f"user: {bench.user}"],
        "device": device,
    }
