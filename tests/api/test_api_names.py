"""The public names: imported when they are used, all documented and typed."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import rtctl

HEAVY = {"numpy", "scipy", "numba", "pydantic", "pint", "matplotlib", "pyarrow", "rich"}
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text(encoding="utf-8")


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import sys, rtctl; print(*{m.partition('.')[0] for m in sys.modules})"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(ended.stdout.split()) & HEAVY == set()


def test_the_package_is_marked_as_typed() -> None:
    assert (Path(rtctl.__file__).parent / "py.typed").is_file()


@pytest.mark.parametrize("name", rtctl.__all__)
def test_every_public_name_exists_is_documented_and_stands_in_the_page(name: str) -> None:
    public = getattr(rtctl, name)
    assert name in dir(rtctl)
    assert inspect.getdoc(public)
    assert f"`{name}`" in PAGE or f"rtctl.{name}" in PAGE
    if inspect.isfunction(public):
        annotations = inspect.signature(public)
        assert annotations.return_annotation is not inspect.Signature.empty
        untyped = [
            one for one in annotations.parameters.values() if one.annotation is inspect.Parameter.empty
        ]
        assert untyped == []


def test_the_list_of_names_and_their_modules_agree() -> None:
    assert set(rtctl.__all__) == set(rtctl._MODULES)


def test_a_public_name_is_never_hidden_by_a_package_of_the_same_name() -> None:
    import rtctl.doubt.watch

    assert sys.modules["rtctl.doubt"].watch is sys.modules["rtctl.doubt.watch"]
    for name in rtctl.__all__:
        assert not inspect.ismodule(getattr(rtctl, name)), name
