"""What all cases of foreign oscillators say alike: a rough model file, and what was hidden."""

from __future__ import annotations

from collections.abc import Mapping

from foreign_oscillator_device import Effect


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
