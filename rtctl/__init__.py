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
    from rtctl.api.campaigns import StudyResults, SweepSummary, reproduce_study, sweep
    from rtctl.api.comparison import Comparison, RecordScore, simulate
    from rtctl.api.datasets import read_dataset, write_dataset
    from rtctl.api.diagnosing import Diagnosis, diagnose
    from rtctl.api.exporting.c import ExportedLoop, export_c, replay_export, run_on_board
    from rtctl.api.exporting.dynamics import Linearised, ModelDynamics, dynamics
    from rtctl.api.exporting.firmware import export_firmware
    from rtctl.api.exporting.fmu import ExportedFmu, export_fmu
    from rtctl.api.exporting.matlab import read_mat, save_mat, save_matlab_function
    from rtctl.api.first_look.initiation import Initiation, init
    from rtctl.api.first_look.preview import Preview, preview
    from rtctl.api.identifying.fit import Fit
    from rtctl.api.identifying.identification import identify
    from rtctl.api.inputs import PathText, Settings
    from rtctl.api.machines import Demonstration, Latency, demonstrate, measure_latency, serve, serve_device
    from rtctl.api.materials import Materials, list_materials
    from rtctl.api.model import Model, Parameter, read_model
    from rtctl.api.parts import PartInfo, PartList, list_parts
    from rtctl.api.runs.doubting import DoubtReport, doubt
    from rtctl.api.runs.errors import ErrorFigures, OutputErrors
    from rtctl.api.runs.recordings import (
        Change,
        Recovered,
        Replayed,
        change,
        export_mcap,
        recover,
        replay,
        watch,
    )
    from rtctl.api.runs.running import Run, run
    from rtctl.border.errors import DriverError, Fault, InputError, RtctlError, RunError
    from rtctl.border.exported.dynamics import Dynamics
    from rtctl.border.records import Channel, DeviceProfile, DeviceStatus, Driver, Measurement, SwitchedOff
    from rtctl.diagnosis.experiment_design.candidate_inputs import CandidateInput
    from rtctl.diagnosis.experiment_design.design import Design, ScoredInput
    from rtctl.diagnosis.experiment_design.next_experiment import NextExperiment
    from rtctl.diagnosis.problem.estimate import Estimate as CauseParameter
    from rtctl.diagnosis.residual.localization import Location
    from rtctl.diagnosis.result import Cause
    from rtctl.diagnosis.result import Diagnosis as Answer
    from rtctl.diagnosis.search.holdout_error import Gain
    from rtctl.diagnosis.thresholds import (
        BudgetThresholds,
        ExperimentThresholds,
        NominalFitThresholds,
        ProblemThresholds,
        ReportThresholds,
        ResidualThresholds,
        ScreeningThresholds,
        SearchThresholds,
        Thresholds,
        VerificationThresholds,
    )
    from rtctl.doubt.naming import Answer as DoubtCause
    from rtctl.doubt.watch import Finding
    from rtctl.export.c.proof.comparison import Computed, Proof
    from rtctl.interfaces import ControlAction, Controller, Estimate, EstimateStatus, Estimator
    from rtctl.measured.dataset import Dataset, Record, Signal
    from rtctl.measured.proposal.proposal import Proposal
    from rtctl.measured.summary import RecordSummary, SignalSummary, Summary
    from rtctl.models.derived.quantity import Derived
    from rtctl.output.bill_of_materials import Material
    from rtctl.output.progress import Progress
    from rtctl.registry import (
        Control,
        Defaults,
        Identification,
        ModelFiles,
        PlantKind,
        SignalKind,
        load_plugin,
        register,
    )
    from rtctl.reproduce.vo2.steps.identification import FitError
    from rtctl.scenario.schema import Scenario
    from rtctl.session.latency import Ladder, Rung
    from rtctl.session.replay import Difference
    from rtctl.session.validation.model_validation import ComparedRecord, OutputScore
    from rtctl.timing.histogram import Bucket, Histogram
    from rtctl.timing.realtime import Request
    from rtctl.timing.step_timing import StepTiming

_NAMES = {
    "rtctl.api.acquisition": "acquire",
    "rtctl.api.campaigns": "StudyResults SweepSummary reproduce_study sweep",
    "rtctl.api.comparison": "Comparison RecordScore simulate",
    "rtctl.api.datasets": "read_dataset write_dataset",
    "rtctl.api.diagnosing": "Diagnosis diagnose",
    "rtctl.api.exporting.c": "ExportedLoop export_c replay_export run_on_board",
    "rtctl.api.exporting.dynamics": "Linearised ModelDynamics dynamics",
    "rtctl.api.exporting.firmware": "export_firmware",
    "rtctl.api.exporting.fmu": "ExportedFmu export_fmu",
    "rtctl.api.exporting.matlab": "read_mat save_mat save_matlab_function",
    "rtctl.api.first_look.initiation": "Initiation init",
    "rtctl.api.first_look.preview": "Preview preview",
    "rtctl.api.identifying.fit": "Fit",
    "rtctl.api.identifying.identification": "identify",
    "rtctl.api.inputs": "PathText Settings",
    "rtctl.api.machines": "Demonstration Latency demonstrate measure_latency serve serve_device",
    "rtctl.api.materials": "Materials list_materials",
    "rtctl.api.model": "Model Parameter read_model",
    "rtctl.api.parts": "PartInfo PartList list_parts",
    "rtctl.api.runs.doubting": "DoubtReport doubt",
    "rtctl.api.runs.errors": "ErrorFigures OutputErrors",
    "rtctl.api.runs.recordings": "Change Recovered Replayed change export_mcap recover replay watch",
    "rtctl.api.runs.running": "Run run",
    "rtctl.border.errors": "DriverError Fault InputError RtctlError RunError",
    "rtctl.border.exported.dynamics": "Dynamics",
    "rtctl.border.records": "Channel DeviceProfile DeviceStatus Driver Measurement SwitchedOff",
    "rtctl.diagnosis.experiment_design.candidate_inputs": "CandidateInput",
    "rtctl.diagnosis.experiment_design.design": "Design ScoredInput",
    "rtctl.diagnosis.experiment_design.next_experiment": "NextExperiment",
    "rtctl.diagnosis.problem.estimate": "CauseParameter=Estimate",
    "rtctl.diagnosis.residual.localization": "Location",
    "rtctl.diagnosis.result": "Cause Answer=Diagnosis",
    "rtctl.diagnosis.search.holdout_error": "Gain",
    "rtctl.diagnosis.thresholds": "BudgetThresholds ExperimentThresholds NominalFitThresholds ProblemThresholds "
    "ReportThresholds ResidualThresholds ScreeningThresholds SearchThresholds Thresholds VerificationThresholds",
    "rtctl.doubt.naming": "DoubtCause=Answer",
    "rtctl.doubt.watch": "Finding",
    "rtctl.export.c.proof.comparison": "Computed Proof",
    "rtctl.interfaces": "ControlAction Controller Estimate EstimateStatus Estimator",
    "rtctl.measured.dataset": "Dataset Record Signal",
    "rtctl.measured.proposal.proposal": "Proposal",
    "rtctl.measured.summary": "RecordSummary SignalSummary Summary",
    "rtctl.models.derived.quantity": "Derived",
    "rtctl.output.bill_of_materials": "Material",
    "rtctl.output.progress": "Progress",
    "rtctl.registry": "Control Defaults Identification ModelFiles PlantKind SignalKind load_plugin register",
    "rtctl.reproduce.vo2.steps.identification": "FitError",
    "rtctl.scenario.schema": "Scenario",
    "rtctl.session.latency": "Ladder Rung",
    "rtctl.session.replay": "Difference",
    "rtctl.session.validation.model_validation": "ComparedRecord OutputScore",
    "rtctl.timing.histogram": "Bucket Histogram",
    "rtctl.timing.realtime": "Request",
    "rtctl.timing.step_timing": "StepTiming",
}
"""Public names of each module; `NAME=OTHER`: what the module calls OTHER."""
_PLACES = {
    name.partition("=")[0]: (module, name.rpartition("=")[2])
    for module, names in _NAMES.items()
    for name in names.split()
}
_MODULES = {name: module for name, (module, _) in _PLACES.items()}
"""Module of each public name."""

__all__ = [
    "Answer",
    "Bucket",
    "BudgetThresholds",
    "CandidateInput",
    "Cause",
    "CauseParameter",
    "Change",
    "Channel",
    "ComparedRecord",
    "Comparison",
    "Computed",
    "Control",
    "ControlAction",
    "Controller",
    "Dataset",
    "Defaults",
    "Demonstration",
    "Derived",
    "Design",
    "DeviceProfile",
    "DeviceStatus",
    "Diagnosis",
    "Difference",
    "DoubtCause",
    "DoubtReport",
    "Driver",
    "DriverError",
    "Dynamics",
    "ErrorFigures",
    "Estimate",
    "EstimateStatus",
    "Estimator",
    "ExperimentThresholds",
    "ExportedFmu",
    "ExportedLoop",
    "Fault",
    "Finding",
    "Fit",
    "FitError",
    "Gain",
    "Histogram",
    "Identification",
    "Initiation",
    "InputError",
    "Ladder",
    "Latency",
    "Linearised",
    "Location",
    "Material",
    "Materials",
    "Measurement",
    "Model",
    "ModelDynamics",
    "ModelFiles",
    "NextExperiment",
    "NominalFitThresholds",
    "OutputErrors",
    "OutputScore",
    "Parameter",
    "PartInfo",
    "PartList",
    "PathText",
    "PlantKind",
    "Preview",
    "ProblemThresholds",
    "Progress",
    "Proof",
    "Proposal",
    "Record",
    "RecordScore",
    "RecordSummary",
    "Recovered",
    "Replayed",
    "ReportThresholds",
    "Request",
    "ResidualThresholds",
    "RtctlError",
    "Run",
    "RunError",
    "Rung",
    "Scenario",
    "ScoredInput",
    "ScreeningThresholds",
    "SearchThresholds",
    "Settings",
    "Signal",
    "SignalKind",
    "SignalSummary",
    "StepTiming",
    "StudyResults",
    "Summary",
    "SweepSummary",
    "SwitchedOff",
    "Thresholds",
    "VerificationThresholds",
    "acquire",
    "change",
    "demonstrate",
    "diagnose",
    "doubt",
    "dynamics",
    "export_c",
    "export_firmware",
    "export_fmu",
    "export_mcap",
    "identify",
    "init",
    "list_materials",
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
    module, own_name = _PLACES[name]
    value = getattr(importlib.import_module(module), own_name)
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
