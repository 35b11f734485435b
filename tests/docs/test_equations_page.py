"""The page on equations runs as it stands, and says what the program says."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

from plant_sim.equations.language.functions import FUNCTIONS
from plant_sim.equations.mechanisms.signals import INPUTS, OUTPUTS
from plant_sim.equations.mechanisms.states import LAWS
from rtctl.border.equations.file import EquationsTable, EventTable, OutputTable, StateTable

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
TABLES = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)


def test_the_page_runs_and_names_what_the_data_do_not_tell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model, *_ = TABLES
    (tmp_path / "tanks.toml").write_text(model, encoding="utf-8")
    said = io.StringIO()
    names: dict[str, object] = {"__name__": "page"}
    with contextlib.redirect_stdout(said):
        for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
            exec(compile(block, "equations.md", "exec"), names)
    refused, errors, *warnings, verdict, cause, rate, sensing = said.getvalue().splitlines()
    assert verdict == "explained"
    assert cause.startswith("state.x1.limit - The state x1 [cm] is limited to")
    assert rate in PAGE
    assert float(re.findall(r"mean ([\d.]+) %", sensing)[0]) < 0.1
    assert refused in PAGE
    before, after = re.findall(r"[\d.]+ V", errors)
    assert float(before[:-2]) > 0.3
    assert float(after[:-2]) < 0.03
    assert any(
        "cannot tell" in line and all(name in line for name in ("k1", "k2", "k4")) for line in warnings
    )
    assert (tmp_path / "identified.toml").is_file()


@pytest.mark.parametrize(
    ("place", "file"), [(1, "models/equations/thermostat.toml"), (2, "vo2_mirror_steps.toml")]
)
def test_a_table_of_the_page_is_that_of_a_shipped_file(place: int, file: str) -> None:
    shipped = (ROOT / "scenarios" / file).read_text(encoding="utf-8").splitlines()
    lines = [re.sub(r"\s+#.*", "", line) for line in TABLES[place].splitlines()]
    assert [line for line in lines if line not in shipped] == []


def test_the_page_names_every_function_table_and_key() -> None:
    assert [name for name in FUNCTIONS if not re.search(rf"\b{name}\b", PAGE)] == []
    keys = {*StateTable.model_fields, *OutputTable.model_fields, *EventTable.model_fields}
    assert [name for name in keys if f"`{name}`" not in PAGE] == []
    tables = {*EquationsTable.model_fields} - {"kind", "python"}
    assert 'python = "module:Class"' in PAGE
    assert [name for name in tables if f"[model.{name}]" not in PAGE] == []


def test_the_page_names_every_mechanism() -> None:
    laws = [(INPUTS, "input.u"), (OUTPUTS, "output.y"), (LAWS, "state.x1")]
    table = PAGE.split("| ids, for each input")[1].split("\n\n")[0]
    for known, first in laws:
        rows = " ".join(row for row in table.splitlines() if row.startswith(f"| `{first}."))
        assert [name for name in known if f".{name}`" not in rows] == [], first


def test_the_page_names_the_shipped_models() -> None:
    folder = ROOT / "scenarios" / "models" / "equations"
    assert str(folder.relative_to(ROOT)) in PAGE
    words = re.sub(r"\s+", "_", PAGE.lower())
    assert [
        path.stem
        for path in folder.glob("*.toml")
        if path.stem not in words and path.stem != "cascaded_tanks"
    ] == []
