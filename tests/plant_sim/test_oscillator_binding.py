"""A template bound to a law: its cache on disk follows the law's source, through copies of copies."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from plant_sim.oscillator.equation.binding import bind

TEMPLATES = """
from plant_sim.oscillator.equation.binding import law

@law
def inner(x):
    return 0.0 * x

def total(x):
    return inner(x) + 1.0

def twice(x):
    return 2.0 * inner(x)
"""
LAW = """
from plant_sim.oscillator.equation.binding import law

@law
def inner(x):
    return {factor} * x
"""
WriteModule = Callable[[str, str], ModuleType]


@pytest.fixture
def write_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> WriteModule:
    """`write_module(name, source)`: imported anew, as by the next start of the program."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # its time stamps are too coarse for a test

    def write(name: str, source: str) -> ModuleType:
        (tmp_path / f"{name}.py").write_text(source)
        importlib.invalidate_caches()
        monkeypatch.delitem(sys.modules, name, raising=False)
        return importlib.import_module(name)

    return write


def hits(kernel: Any) -> int:
    return sum(kernel.stats.cache_hits.values())


def test_a_bound_template_is_loaded_from_disk_until_its_law_changes(write_module: WriteModule) -> None:
    templates = write_module("bound_templates", TEMPLATES)
    first = bind(templates.total, inner=write_module("bound_law", LAW.format(factor=2.0)).inner)
    assert (first(3.0), hits(first)) == (7.0, 0)
    again = bind(templates.total, inner=write_module("bound_law", LAW.format(factor=2.0)).inner)
    assert (again(3.0), hits(again)) == (7.0, 1)
    changed = bind(templates.total, inner=write_module("bound_law", LAW.format(factor=5.0)).inner)
    assert (changed(3.0), hits(changed)) == (16.0, 0)


def test_a_law_behind_bound_copies_of_one_template_counts_too(write_module: WriteModule) -> None:
    templates = write_module("bound_templates", TEMPLATES)

    def built(factor: float) -> Any:
        law = write_module("bound_law", LAW.format(factor=factor)).inner
        doubled = bind(templates.twice, inline=True, inner=law)
        return bind(templates.total, inner=bind(templates.twice, inline=True, inner=doubled))

    assert built(2.0)(3.0) == 25.0
    changed = built(5.0)
    assert (changed(3.0), hits(changed)) == (61.0, 0)
    again = built(5.0)
    assert (again(3.0), hits(again)) == (61.0, 1)


def test_two_laws_in_one_template_have_a_cache_entry_each(write_module: WriteModule) -> None:
    templates = write_module("bound_templates", TEMPLATES)
    laws = [write_module(f"bound_law_{factor}", LAW.format(factor=float(factor))).inner for factor in (2, 5)]
    for expected_hits in (0, 1):
        kernels = [bind(templates.total, inner=law) for law in laws]
        assert [kernel(3.0) for kernel in kernels] == [7.0, 16.0]
        assert [hits(kernel) for kernel in kernels] == [expected_hits, expected_hits]
