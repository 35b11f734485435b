"""Feedback control of actuators that sense themselves.

The names of the Python interface (`__all__`) are imported when they are first used, so that `import rtctl` is fast.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rtctl.version import __version__ as __version__

if TYPE_CHECKING:
    from rtctl.api.acquisition import acquire
    from rtctl.api.campaigns import reproduce_study, sweep
    from rtctl.api.comparison import Comparison, RecordScore, simulate
    from rtctl.api.datasets import read_dataset, write_dataset
    from rtctl.api.diagnosing import Diagnosis, diagnose
    from rtctl.api.exporting.c import ExportedLoop, export_c, replay_export, run_on_board
    from rtctl.api.exporting.dynamics import Linearised, ModelDynamics, dynamics
    from rtctl.api.exporting.fmu import ExportedFmu, export_fmu
    from rtctl.api.exporting.matlab import read_mat, save_mat, save_matlab_function
    from rtctl.api.first_look.initiation import Initiation, init
    from rtctl.api.first_look.preview import Preview, preview
    from rtctl.api.identifying.fit import Fit
    from rtctl.api.identifying.identification import identify
    from rtctl.api.machines import Latency, demonstrate, measure_latency, serve, serve_device
    from rtctl.api.model import Model, Parameter, read_model
    from rtctl.api.parts import PartInfo, PartList, list_parts
    from rtctl.api.runs.doubting import doubt
    from rtctl.api.runs.recordings import Replayed, change, recover, replay, watch
    from rtctl.api.runs.running import Run, run
    from rtctl.border.errors import DriverError, Fault, InputError, RtctlError, RunError
    from rtctl.measured.dataset import Dataset, Record
    from rtctl.registry import PlantKind, load_plugin, register

_MODULES = {
    "acquire": "rtctl.api.acquisition",
    "reproduce_study": "rtctl.api.campaigns",
    "sweep": "rtctl.api.campaigns",
    "Comparison": "rtctl.api.comparison",
    "RecordScore": "rtctl.api.comparison",
    "simulate": "rtctl.api.comparison",
    "Diagnosis": "rtctl.api.diagnosing",
    "diagnose": "rtctl.api.diagnosing",
    "doubt": "rtctl.api.runs.doubting",
    "Linearised": "rtctl.api.exporting.dynamics",
    "ModelDynamics": "rtctl.api.exporting.dynamics",
    "dynamics": "rtctl.api.exporting.dynamics",
    "ExportedFmu": "rtctl.api.exporting.fmu",
    "export_fmu": "rtctl.api.exporting.fmu",
    "Initiation": "rtctl.api.first_look.initiation",
    "init": "rtctl.api.first_look.initiation",
    "Preview": "rtctl.api.first_look.preview",
    "preview": "rtctl.api.first_look.preview",
    "Fit": "rtctl.api.identifying.fit",
    "identify": "rtctl.api.identifying.identification",
    "read_dataset": "rtctl.api.datasets",
    "Latency": "rtctl.api.machines",
    "demonstrate": "rtctl.api.machines",
    "measure_latency": "rtctl.api.machines",
    "serve": "rtctl.api.machines",
    "serve_device": "rtctl.api.machines",
    "read_mat": "rtctl.api.exporting.matlab",
    "save_mat": "rtctl.api.exporting.matlab",
    "save_matlab_function": "rtctl.api.exporting.matlab",
    "Model": "rtctl.api.model",
    "Parameter": "rtctl.api.model",
    "read_model": "rtctl.api.model",
    "PartInfo": "rtctl.api.parts",
    "PartList": "rtctl.api.parts",
    "list_parts": "rtctl.api.parts",
    "Replayed": "rtctl.api.runs.recordings",
    "change": "rtctl.api.runs.recordings",
    "recover": "rtctl.api.runs.recordings",
    "export_mcap": "rtctl.api.runs.recordings",
    "ExportedLoop": "rtctl.api.exporting.c",
    "export_c": "rtctl.api.exporting.c",
    "replay_export": "rtctl.api.exporting.c",
    "run_on_board": "rtctl.api.exporting.c",
    "replay": "rtctl.api.runs.recordings",
    "watch": "rtctl.api.runs.recordings",
    "Run": "rtctl.api.runs.running",
    "run": "rtctl.api.runs.running",
    "DriverError": "rtctl.border.errors",
    "Fault": "rtctl.border.errors",
    "InputError": "rtctl.border.errors",
    "RtctlError": "rtctl.border.errors",
    "RunError": "rtctl.border.errors",
    "Dataset": "rtctl.measured.dataset",
    "Record": "rtctl.measured.dataset",
    "write_dataset": "rtctl.api.datasets",
    "PlantKind": "rtctl.registry",
    "load_plugin": "rtctl.registry",
    "register": "rtctl.registry",
}
"""Module of each public name."""

__all__ = [
    "Comparison",
    "Dataset",
    "Diagnosis",
    "DriverError",
    "ExportedFmu",
    "ExportedLoop",
    "Fault",
    "Fit",
    "Initiation",
    "InputError",
    "Latency",
    "Linearised",
    "Model",
    "ModelDynamics",
    "Parameter",
    "PartInfo",
    "PartList",
    "PlantKind",
    "Preview",
    "Record",
    "RecordScore",
    "Replayed",
    "RtctlError",
    "Run",
    "RunError",
    "acquire",
    "change",
    "demonstrate",
    "diagnose",
    "doubt",
    "dynamics",
    "export_c",
    "export_fmu",
    "export_mcap",
    "identify",
    "init",
    "list_parts",
    "load_plugin",
    "measure_latency",
    "preview",
    "read_dataset",
    "read_mat",
    "read_model",
    "recover",
    "register",
    "replay",
    "replay_export",
    "reproduce_study",
    "run",
    "run_on_board",
    "save_mat",
    "save_matlab_function",
    "serve",
    "serve_device",
    "simulate",
    "sweep",
    "watch",
    "write_dataset",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _MODULES:
        from rtctl.border.errors import nearest

        raise AttributeError(f'module "rtctl" has no attribute "{name}"{nearest(name, _MODULES)}')
    value = getattr(importlib.import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """The package: a public name stays what it is when a subpackage of that name (`rtctl.doubt`) is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _MODULES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
