"""`rtctl sbom`: every package that the program needs, with its licence, in a form that others read."""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path

import pytest

from rtctl.cli import main
from rtctl.output.bill_of_materials import materials


def test_the_bill_has_what_is_needed_and_no_tool_that_only_builds_or_tests(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rtctl.cdx.json"
    assert main(["sbom", "--out", str(file)]) == 0
    assert "numpy" in capsys.readouterr().out
    bill = json.loads(file.read_text(encoding="utf-8"))
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.5")
    parts = {part["name"]: part for part in bill["components"]}
    assert {"numpy", "numba", "llvmlite", "pydantic", "uPlot"} <= parts.keys()  # llvmlite: numba's
    assert not {"pytest", "ruff", "mypy", "mkdocs-material", "rtctl"} & parts.keys()
    assert parts["numpy"]["purl"] == f"pkg:pypi/numpy@{metadata.version('numpy')}"
    assert parts["llvmlite"]["scope"] == "required"
    assert all(part["licenses"] for name, part in parts.items() if part["scope"] == "required"), parts


def test_every_reference_of_the_bill_is_one_of_its_parts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sbom", "--json"]) == 0
    bill = json.loads(capsys.readouterr().out)
    known = {part["bom-ref"] for part in bill["components"]} | {bill["metadata"]["component"]["bom-ref"]}
    assert len(known) == len(bill["components"]) + 1
    named = {one["ref"] for one in bill["dependencies"]} | {
        ref for one in bill["dependencies"] for ref in one["dependsOn"]
    }
    assert named <= known
    # the schema wants each once
    assert all(len(one["dependsOn"]) == len(set(one["dependsOn"])) for one in bill["dependencies"])
    assert main(["sbom", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == bill


def test_a_package_of_an_extra_alone_is_marked() -> None:
    found = {one.name: one for one in materials()}
    assert found["numpy"].needed
    for name in ("mcap", "distributed"):
        assert name not in found or not found[name].needed


def test_a_bill_replaces_an_earlier_bill_and_no_other_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rtctl.cdx.json"
    assert main(["sbom", "--out", str(file), "--quiet"]) == 0
    assert main(["sbom", "--out", str(file), "--quiet"]) == 0
    file.write_text('{"measured": 1}', encoding="utf-8")
    assert main(["sbom", "--out", str(file), "--quiet"]) == 2
    assert "no output of rtctl sbom" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == '{"measured": 1}'
