"""Optional dependencies: every module but the readers and figures imports without them, and messages name the extra."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from rtctl.border.errors import InputError
from rtctl.extras import EXTRAS, require
from rtctl.measured.readers import NEEDS, open_table

ROOT = Path(__file__).resolve().parents[2]
IMPORT_ALL = """
import importlib, pkgutil, sys
for name in ("matplotlib", "PIL", "h5py", "asammdf", "nptdms", "pyuff", "distributed", "control", "mcap", "caproto",
             "pyvisa", "qcodes", "pymeasure"):
    sys.modules[name] = None
failed = []
def walk(name):
    try:
        module = importlib.import_module(name)
    except ImportError:
        failed.append(name)
        return
    for info in pkgutil.iter_modules(getattr(module, "__path__", ()), name + "."):
        if not info.name.endswith("__main__") and info.name not in ("rtctl.plots", "rtctl.reproduce"):
            walk(info.name)
for package in ("rtctl", "plant_sim", "drivers"):
    walk(package)
print(*failed)
"""
WITHOUT = {
    "rtctl.as_instrument.pymeasure",
    "rtctl.as_instrument.qcodes",
    "rtctl.campaign.figures",
    "rtctl.diagnosis.report.pictures",
    "rtctl.live_page.streams.channels",
    "rtctl.measured.readers.tdms",
    "rtctl.measured.readers.tdms_segments",
    "rtctl.measured.readers.hdf5_storage.links",
    "rtctl.measured.readers.hdf5_storage.origins",
    "rtctl.measured.readers.hdf5_storage.presence",
    "rtctl.measured.readers.uff58",
}
"""Modules that are imported only where their extra is installed."""


def test_every_other_module_imports_without_the_extras() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == WITHOUT


@pytest.mark.parametrize("suffix", NEEDS)
def test_a_reader_without_its_package_names_the_extra(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"r{suffix}"
    path.write_bytes(b"0")
    monkeypatch.setitem(sys.modules, NEEDS[suffix], None)
    package, extra = EXTRAS[NEEDS[suffix]]
    with pytest.raises(
        ValueError, match=rf"^reading {suffix} needs {package}: pip install 'rtctl\[{extra}\]'$"
    ):
        open_table(path)


def test_a_missing_package_is_an_input_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"^--scheduler needs distributed: pip install 'rtctl\[cluster\]'$"):
        require("distributed", "--scheduler")


def test_every_extra_that_a_message_names_installs_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for distribution, extra in EXTRAS.values():
        declared = [text.split(">=")[0] for text in project["optional-dependencies"][extra]]
        assert distribution in declared
        assert not any(text.startswith(distribution) for text in project["dependencies"])
