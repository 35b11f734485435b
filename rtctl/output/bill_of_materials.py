"""What the program consists of, in the environment it runs in: a bill of materials in CycloneDX 1.5 JSON.

Packages are found from the program's own requirements on, through theirs, in the metadata that each has installed;
nothing is looked up elsewhere. Reference: ECMA-424 (CycloneDX), https://cyclonedx.org/docs/1.5/json.
"""

from __future__ import annotations

import re
import uuid
from collections.abc import Iterator
from importlib import metadata
from typing import Any, NamedTuple

from rtctl.output.own_files import mark_of
from rtctl.version import __version__

PROGRAM = "rtctl"
NOT_SHIPPED = frozenset({"dev", "docs", "weekly"})
"""Extras with which the program is built and tested; no user's installation needs them."""
LONGEST_NAME = 80
"""Characters; what is longer in the field of the licence is its text, not its name."""
_REQUIREMENT = re.compile(r"\s*([A-Za-z0-9][A-Za-z0-9._-]*)\s*(?:\[[^\]]*\])?[^;]*(?:;(.*))?", re.DOTALL)
_EXTRA = re.compile(r"extra\s*==\s*['\"]([^'\"]+)['\"]")


class Material(NamedTuple):
    """A package that is installed here."""

    name: str
    version: str
    licence: str
    """As its metadata state it; "": they do not."""
    is_expression: bool
    """Whether `licence` is an expression of SPDX."""
    needed: bool
    """Whether the program needs it without any extra."""
    needs: tuple[str, ...]
    """Names of the installed packages that it needs."""


def materials() -> list[Material]:
    """Return all packages that the program uses here, by name."""
    always = _reached(extras=frozenset())
    return [
        _material(name, needed=name in always) for name in sorted(_reached(extras=None)) if name != PROGRAM
    ]


def bill_of_materials(found: list[Material]) -> dict[str, Any]:
    """Return the bill as CycloneDX; two of the same packages are equal."""
    parts = [
        {
            "type": "library", "bom-ref": _reference(one.name, one.version), "name": one.name,
            "version": one.version, "purl": _reference(one.name, one.version),
            "scope": "required" if one.needed else "optional", **_licences(one),
        }
        for one in found
    ]  # fmt: skip
    shown = {"type": "library", "bom-ref": "file:uPlot", "name": "uPlot", "scope": "required",
             "description": "a copy in the program, for the charts of the live page",
             "licenses": [{"license": {"id": "MIT"}}]}  # fmt: skip
    versions = {one.name: one.version for one in found}
    depends = [
        {
            "ref": _reference(one.name, one.version),
            "dependsOn": [_reference(need, versions[need]) for need in one.needs if need in versions],
        }
        for one in found
    ]
    own = _reference(PROGRAM, __version__)
    first = sorted({name for name, _ in _requirements(PROGRAM, None)} & versions.keys())
    root = {"ref": own, "dependsOn": [*(_reference(name, versions[name]) for name in first), "file:uPlot"]}
    names = " ".join(part["bom-ref"] for part in parts)
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, f'{own} {names}')}",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application", "bom-ref": own, "name": PROGRAM, "version": __version__, "purl": own,
                "licenses": [{"license": {"id": "Apache-2.0"}}],
            },
            "properties": [{"name": "rtctl:written-by", "value": mark_of("sbom")}],
        },
        "components": [*parts, shown],
        "dependencies": [root, *depends],
    }  # fmt: skip


def _reached(extras: frozenset[str] | None) -> set[str]:
    """Return the names of the program and of all installed packages that it needs; `extras` as in `_requirements`."""
    known, waiting = {PROGRAM}, [(PROGRAM, extras)]
    while waiting:
        for name, _ in _requirements(*waiting.pop()):
            if name not in known and _is_installed(name):
                known.add(name)
                waiting.append((name, frozenset()))
    return known


def _requirements(name: str, extras: frozenset[str] | None) -> Iterator[tuple[str, str]]:
    """Yield names that a package requires, and by which extra; `extras` None: by all that are shipped."""
    for text in metadata.requires(name) or []:
        matched = _REQUIREMENT.match(text)
        asked = _EXTRA.search(matched[2] or "") if matched is not None else None
        if matched is None:
            continue
        extra = "" if asked is None else asked[1]
        if not extra or (extra not in NOT_SHIPPED if extras is None else extra in extras):
            yield _normal(matched[1]), extra


def _is_installed(name: str) -> bool:
    try:
        metadata.distribution(name)
    except metadata.PackageNotFoundError:  # of another system, or an extra that is not there
        return False
    return True


def _material(name: str, *, needed: bool) -> Material:
    """Return an installed package with its licence."""
    told = metadata.metadata(name)
    expression, written = (
        str(told[field] or "").strip() if field in told else "" for field in ("License-Expression", "License")
    )
    classes = [
        one.rpartition(" :: ")[2]
        for one in told.get_all("Classifier") or []
        if one.startswith("License ::") and not one.endswith("OSI Approved")
    ]
    named = written if 0 < len(written) <= LONGEST_NAME and written != "UNKNOWN" else " or ".join(classes)
    needs = tuple(sorted({need for need, _ in _requirements(name, frozenset())}))
    return Material(name, metadata.version(name), expression or named, bool(expression), needed, needs)


def _licences(one: Material) -> dict[str, Any]:
    if not one.licence:
        return {}
    told = {"expression": one.licence} if one.is_expression else {"license": {"name": one.licence}}
    return {"licenses": [told]}


def _normal(name: str) -> str:
    """Return a name as the index of packages compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _reference(name: str, version: str) -> str:
    return f"pkg:pypi/{name}@{version}"
