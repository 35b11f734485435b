"""What a file states of a column in attributes: texts and numbers in any form, and how its numbers are packed.

Of packed numbers p (CF conventions 1.11, sections 2.5.1 and 8.1): value = scale_factor p + add_offset, and p that is
`_FillValue` or `missing_value`, or outside `valid_range` (`valid_min`, `valid_max`), is no reading: NaN. The limits
and the missing values are in packed numbers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.measured.readers.stated.keys import (
    is_decimation_key,
    is_fill_key,
    is_offset_key,
    is_own_scale_key,
    is_scale_key,
    is_unit_key,
)

_FIRST_UNIT_KEYS = ("unit", "units", "unit_string", "unitstring", "ni_unitdescription", "einheit")
"""Keys that come before other words for a unit."""
_SCALES, _OFFSETS = ("scale_factor",), ("add_offset",)
_FILLS = ("_fillvalue", "missing_value")
"""The agreed keys of fill values, which have to be numbers; other words for them count where they are."""
_PREFIXES = frozenset("pnuµμmcdkMG") | {"micro", "milli", "centi", "kilo", "mega"}
_LEADING_NUMBER = re.compile(r"[+-]?(\d[\d.,]*|[.,]\d+)([eE][+-]?\d+)?(?=\s|$|[^\d:/-])")

LONGEST_TEXT = 500
"""Characters that are kept of a text."""


class Packing(NamedTuple):
    """How the numbers of a column are to be read."""

    scale: float = 1.0
    offset: float = 0.0
    missing: tuple[float, ...] = ()
    """Packed numbers that are no readings."""
    low: float = -np.inf
    high: float = np.inf
    """Limits of packed numbers that are readings."""
    unsigned: bool = False
    """Whether signed integers hold unsigned ones (NetCDF's attribute `_Unsigned`)."""

    @property
    def changes_numbers(self) -> bool:
        """Return whether the numbers differ from those that are stored."""
        return self != Packing()


def text_of(attribute: Any) -> str:
    """Return an attribute as text: a str, bytes (UTF-8, else Latin-1) or an array of one such; "" for others."""
    if isinstance(attribute, np.ndarray) and attribute.size == 1:
        attribute = attribute.reshape(-1)[0]
    if isinstance(attribute, list | tuple) and len(attribute) == 1:
        attribute = attribute[0]
    if isinstance(attribute, str):
        try:
            attribute.encode()
        except UnicodeEncodeError:  # bytes that h5py could not decode
            attribute = attribute.encode("utf-8", "surrogateescape")
    if isinstance(attribute, bytes):
        try:
            attribute = attribute.decode()
        except UnicodeDecodeError:
            attribute = attribute.decode("latin-1")
    return str(attribute).strip("\0 \t\r\n") if isinstance(attribute, str) else ""


def texts_of(attributes: Mapping[str, Any], name: str = "") -> dict[str, str]:
    """Return the attributes that are texts, by what a reader calls them; `name` is what has them, "": the file."""
    of = f' of "{name}"' if name else ""
    found = {f'attribute "{key}"{of}': text_of(value)[:LONGEST_TEXT] for key, value in attributes.items()}
    return {where: text for where, text in found.items() if text}


def numbers_of(attribute: Any) -> NDArray[np.float64]:
    """Return an attribute as numbers (n,). Raises ValueError where it holds none."""
    if isinstance(attribute, str | bytes) or np.asarray(attribute).dtype.kind in "OSU":
        texts = np.asarray(attribute).reshape(-1)
        attribute = [float(part) for one in texts for part in text_of(one).replace(",", " ").split()]
    return np.asarray(attribute, dtype=np.float64).reshape(-1)


def readable_attributes(item: Any) -> dict[str, Any]:
    """Return the attributes of an h5py object that can be read; one of a foreign type says nothing."""
    found: dict[str, Any] = {}
    for key in item.attrs:
        try:
            found[key] = item.attrs[key]
        except (OSError, TypeError, ValueError, RuntimeError):
            continue
    return found


def says_of_numbers(key: str) -> bool:
    """Return whether a key says how the numbers of a column are to be read: their unit, their scale, what is none."""
    agreed = key.lower() in (
        *_SCALES,
        *_OFFSETS,
        *_FILLS,
        "valid_range",
        "valid_min",
        "valid_max",
        "_unsigned",
    )
    return agreed or is_unit_key(key) or is_scale_key(key) or is_fill_key(key)


def stated_unit(attributes: Mapping[str, Any]) -> str | None:
    """Return what stands under a key for the unit of a column; None: there is none, or it is empty."""
    lower = {key.lower(): value for key, value in attributes.items()}
    first = [lower[key] for key in _FIRST_UNIT_KEYS if key in lower]
    others = [value for key, value in attributes.items() if is_unit_key(key)]
    return next((text for value in (*first, *others) if (text := unit_text(value))), None)


def unit_text(value: Any) -> str:
    """Return what states a unit as text: several units one after the other, a bare number as such; "": nothing."""
    if isinstance(value, Mapping):
        return ""
    if text := text_of(value):
        return text
    parts = np.asarray(value).reshape(-1) if not isinstance(value, str | bytes) else np.empty(0)
    if parts.dtype.kind in "biuf" and parts.size:
        return f"the number {', '.join(f'{part:g}' for part in parts[:4])}"
    return ", ".join(text for part in parts[:8] if (text := text_of(part)))


def packing_of(attributes: Mapping[str, Any]) -> Packing:
    """Return how the attributes say that the numbers are packed. Raises ValueError for one that cannot be obeyed."""
    lower = {key.lower(): (key, value) for key, value in attributes.items()}

    def filled(key: str, value: Any) -> bool:
        return key in _FILLS or (is_fill_key(key) and _is_numeric(value))

    def stated(*keys: str) -> NDArray[np.float64]:
        found = [_stated_numbers(*lower[key]) for key in keys if key in lower]
        return np.concatenate(found) if found else np.empty(0)

    def one(keys: tuple[str, ...], default: float) -> float:
        values = stated(*keys)
        if len(values) > 1 or not np.isfinite(values).all():
            raise ValueError(
                f"states {' '.join(keys)} = {values.tolist()}, one finite number is needed; save each column as one "
                "of its own, with its own attribute"
            )
        return float(values[0]) if len(values) else default

    fills = [key for key, (_, value) in lower.items() if filled(key, value)]
    scale = one(_SCALES, 1.0)
    if scale == 0.0:
        raise ValueError("states a scale_factor of 0, which leaves nothing of its numbers; correct the file")
    limits = stated("valid_range")
    if len(limits) not in (0, 2):
        raise ValueError(f"states valid_range = {limits.tolist()}, two numbers are needed")
    low, high = stated("valid_min"), stated("valid_max")
    return Packing(
        scale=scale,
        offset=one(_OFFSETS, 0.0),
        missing=tuple(value for value in stated(*fills).tolist() if not np.isnan(value)),
        low=float(max([*limits[:1], *low], default=-np.inf)),
        high=float(min([*limits[1:], *high], default=np.inf)),
        unsigned=text_of(dict(attributes).get("_Unsigned")).lower() == "true",
    )


def unpack(stored: NDArray[Any], packing: Packing) -> NDArray[Any]:
    """Return the readings of stored numbers; NaN for what is none. Text and complex numbers stay as they are."""
    if not packing.changes_numbers or stored.dtype.kind not in "biuf":
        return stored
    if packing.unsigned and stored.dtype.kind == "i":
        stored = stored.view(stored.dtype.str.replace("i", "u"))
    packed = stored.astype(np.float64)
    none = ~((packed >= packing.low) & (packed <= packing.high))
    for value in packing.missing:
        none |= (
            stored == np.float64(value).astype(stored.dtype) if stored.dtype.kind == "f" else packed == value
        )
    readings = np.asarray(packing.scale * packed + packing.offset)  # of a single number as well
    readings[none] = np.nan
    return readings


def unapplied(attributes: Mapping[str, Any]) -> str:
    """Return the attributes that may scale the numbers, in no agreed way, as `key = value`; "": there are none."""
    agreed = (*_SCALES, *_OFFSETS)
    return described_scales(
        {
            key: value
            for key, value in attributes.items()
            if key.lower() not in agreed and is_own_scale_key(key)
        }
    )


def stated_decimation(attributes: Mapping[str, Any]) -> str:
    """Return how many samples were left out, as `key = value`; "": none were, or nobody says."""
    return described_scales({key: value for key, value in attributes.items() if is_decimation_key(key)})


def described_scales(stated: Mapping[str, Any]) -> str:
    """Return scales as `key = value`, without those that change nothing: a factor of 1, an offset of 0, words."""
    shown = [f"{key} = {_short(value)}" for key, value in stated.items() if _changes_numbers(key, value)]
    return ", ".join(shown)


def _changes_numbers(key: str, value: Any) -> bool:
    if not _is_numeric(value):
        text = text_of(value)
        return (
            _LEADING_NUMBER.match(text) is not None or any(sign in text for sign in "=*") or text in _PREFIXES
        )
    numbers = numbers_of(value)
    return bool(numbers.size) and not bool(np.all(numbers == (0.0 if is_offset_key(key) else 1.0)))


def _is_numeric(value: Any) -> bool:
    try:
        numbers_of(value)
    except (ValueError, TypeError):
        return False
    return True


def _stated_numbers(key: str, value: Any) -> NDArray[np.float64]:
    try:
        return numbers_of(value)
    except (ValueError, TypeError):
        raise ValueError(f"states {key} = {_short(value)}, which is no number; correct the file") from None


def _short(value: Any) -> str:
    held = np.asarray(value)
    return (text_of(value) or str(held.item() if held.size == 1 else held.tolist()))[:40]
