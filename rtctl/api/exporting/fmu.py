"""Models for other programs: `export_fmu`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rtctl.api.datasets import stored_dataset_of
from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, model_of
from rtctl.border.errors import InputError, nearest
from rtctl.border.exported.c_plant import CRequest
from rtctl.measured.dataset import Dataset
from rtctl.output.progress import Progress, reporter

VERSIONS = ("3.0", "2.0")


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedFmu:
    """A functional mock-up unit that was written."""

    path: Path
    version: str
    """Of FMI."""
    step_s: float
    """Communication step that it proposes [s]."""
    longest_step_s: float
    """Longest step of its integrator [s], the start value of its parameter `longest_step`."""
    method: str
    """Method of its integrator."""
    has_binary: bool
    """Whether it has a binary for this machine beside its sources."""
    variables: tuple[str, ...]
    """Names of its variables."""

    def to_dict(self) -> dict[str, Any]:
        """Return the same as plain values."""
        return {
            "file": str(self.path), "fmi": self.version, "step_s": self.step_s,
            "longest_step_s": self.longest_step_s, "method": self.method, "binary": self.has_binary,
            "variables": list(self.variables),
        }  # fmt: skip


# 7 parameters because each is an option of `rtctl export fmu`
def export_fmu(  # noqa: PLR0913
    model: Model | PathText,
    out: PathText,
    *,
    version: str = "3.0",
    dataset: Dataset | PathText | None = None,
    step_s: float | None = None,
    sources_only: bool = False,
    progress: Progress = False,
) -> ExportedFmu:
    """Write a model as a functional mock-up unit for co-simulation, with its sources and a binary for this machine.

    Args:
        model: A model or its file.
        out: The file, such as "model.fmu".
        version: Of FMI: "3.0" or "2.0".
        dataset: Records that the unit shall integrate as `simulate` does; it also tells the units of the signals of
            an oscillator. None: the integrator's step follows from the rates at the start.
        step_s: Communication step that the unit proposes [s]; None: the sample period of the dataset, or what follows
            from the rates at the start.
        sources_only: Whether no binary is compiled.
        progress: True prints what is under way, a callable hears (text, None).

    Raises:
        InputError: The model, or a part of it, cannot be exported; there is no C compiler; an argument is wrong.
        RunError: The compiler fails.
    """
    from rtctl.export.fmu.archive import write_unit
    from rtctl.export.fmu.binary import can_compile_for, find_compiler
    from rtctl.export.of_models import build_c_plant

    target = path_of("out", out)
    if version not in VERSIONS:
        raise InputError(
            f'version = "{version}" of FMI: it must be one of {", ".join(VERSIONS)}{nearest(version, VERSIONS)}'
        )
    if step_s is not None and not step_s > 0.0:
        raise InputError(f"step_s must be above 0 s, got {step_s!r}")
    if target.suffix.lower() != ".fmu":
        raise InputError(f'{target}: a functional mock-up unit is a file "*.fmu": simulators go by its name')
    compiler = None if sources_only else find_compiler()
    if not sources_only and can_compile_for(version) and compiler is None:
        raise InputError(
            "no C compiler: gcc, cc or clang is needed for the binary; install one (apt-get install gcc), or export "
            "the sources alone (--sources-only, sources_only=True)"
        )
    content = model_of(model)
    source = str(content.source or "the model")
    plant = build_c_plant(content.content, source, content.kind, _request(dataset, step_s))
    reporter(progress).say(f"writing {target}{'' if compiler is None else ', and compiling its binary'}")
    unit = write_unit(
        plant, target, version=version, name=target.stem, step_s=plant.step_s, compiler=compiler
    )
    return ExportedFmu(
        path=target, version=version, step_s=plant.step_s, longest_step_s=plant.longest_step_s,
        method=plant.method, has_binary=compiler is not None and can_compile_for(version) is not None,
        variables=tuple(one.name for one in unit.variables),
    )  # fmt: skip


def _request(dataset: Dataset | PathText | None, step_s: float | None) -> CRequest:
    """Return what is asked of the plant, with the records of a dataset."""
    from rtctl.measured.stimulus import make_stimulus

    if dataset is None:
        return CRequest(step_s=step_s)
    stored = stored_dataset_of(dataset)
    stimuli = tuple(make_stimulus(record, stored.holds) for record in stored)
    return CRequest(step_s=step_s, stimuli=stimuli, units=dict(stored.units))
