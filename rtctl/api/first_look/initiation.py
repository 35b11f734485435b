"""Data files to a manifest: `init`."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.first_look.preview import Preview, preview_with
from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, read_model
from rtctl.border.errors import InputError
from rtctl.measured.dataset import Dataset
from rtctl.measured.proposal.asking.refusal import refuse_open
from rtctl.measured.proposal.grouped import by_groups
from rtctl.measured.proposal.manifest_text import manifest_text
from rtctl.measured.proposal.own_equations.signals import read_model_signals
from rtctl.measured.proposal.proposal import Answers, ModelSignals, Proposal, SignalGuess
from rtctl.measured.proposal.propose import propose
from rtctl.measured.proposal.survey import survey_files
from rtctl.measured.reading import read_dataset
from rtctl.measured.summary import Source
from rtctl.measured.units import absolute_unit
from rtctl.output.atomic_write import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANIFEST, PICTURE, ANSWER = "dataset.toml", "preview.png", "answer"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Initiation:
    """A manifest that was written, and from what it was guessed."""

    path: Path
    """The manifest."""
    picture: Path | None
    """The picture; None where matplotlib is not installed."""
    proposal: Proposal
    """Every guess with its reason."""
    summary: Preview
    """What was read, as tables and a figure."""

    @property
    def dataset(self) -> Dataset:
        """The dataset, read."""
        return self.summary.dataset

    @property
    def guessed(self) -> Mapping[str, str]:
        """The reason of each guess by its place in the manifest, such as "signals.drive.unit"."""
        found = {"dataset.plant": self.proposal.plant_why}
        for one in self.proposal.signals:
            place = f"signals.{one.name}"
            found |= {f"{place}.column": one.why, f"{place}.unit": one.unit_source}
            found |= {f"{place}.hold": one.hold_why} if one.hold else {}
        found["records.time"] = self.proposal.time.why
        found |= {f"records.{k}.use": one.why for k, one in enumerate(self.proposal.records) if one.why}
        return found

    @property
    def unsure(self) -> tuple[str, ...]:
        """What should be looked at."""
        return self.proposal.unsure

    @property
    def next_command(self) -> tuple[str, ...]:
        """Words of the next command; () where a model must be written before."""
        if self.proposal.kind.free_signals and self.proposal.model is None:
            return ()
        if self.proposal.model is None:  # identified by the diagnosis itself
            return "rtctl", "diagnose", str(self.path), "--out", str(self.path.parent / ANSWER)
        start = ("--model", str(self.proposal.model))
        return "rtctl", "identify", str(self.path), *start, "--out", str(self._model())

    def _model(self) -> Path:
        """Return a path for the identified model that is not that of the model to start from."""
        named = self.path.parent / "model.toml"
        start = self.proposal.model
        is_start = start is not None and start.resolve() == named.resolve()
        return self.path.parent / "model-identified.toml" if is_start else named

    def plot(self) -> Figure:
        """Return the figure of the preview."""
        return self.summary.plot()

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as the command line's `--json` prints it."""
        return {
            "dataset": str(self.path),
            "picture": None if self.picture is None else str(self.picture),
            "guessed": dict(self.guessed),
            "unsure": list(self.unsure),
            "not_used": dict(self.proposal.unused),
            **self.summary.to_dict(),
            "next": shlex.join(self.next_command) or None,
        }

    def __repr__(self) -> str:
        return (
            f"<Initiation of {self.path}: {len(self.dataset.records)} records, {len(self.unsure)} to look at>"
        )

    def _repr_html_(self) -> str:
        return self.summary._repr_html_()


# 15 parameters because each is an option of the command line
def init(  # noqa: PLR0913
    files: PathText | Sequence[PathText],
    *,
    out: PathText | None = None,
    plant: str | None = None,
    model: Model | PathText | None = None,
    inputs: str | Sequence[str] = (),
    outputs: str | Sequence[str] | Mapping[str, str] = (),
    scales: str | Sequence[str] | Mapping[str, str] = (),
    time: str | None = None,
    sample_rate_hz: float | None = None,
    drive_amplitude: str | None = None,
    hold: str | None = None,
    test: str | None = None,
    name: str | None = None,
    force: bool = False,
    plot: bool = True,
) -> Initiation:
    """Write the manifest of data files, guessed from their columns, units and numbers; nothing is asked.

    Args:
        files: One or several data files of one kind; they are neither copied nor changed.
        out: Folder of `dataset.toml` and `preview.png`; None: that of the first file.
        plant: Kind of plant; None: guessed, or that of the model.
        model: A model that was saved, or its file, that the data are for; one of equations names the inputs and outputs
            that the columns are.
        inputs: `COLUMN[:UNIT]` of the drive, or `NAME=COLUMN[:UNIT]`; what is not said is guessed. Of equations
            without a model, all inputs and outputs are said.
        outputs: `NAME=COLUMN[:UNIT]` of responses, or a mapping of name to `COLUMN[:UNIT]` ("-": there is none).
        scales: `NAME=NUMBER UNIT` of transducers, or a mapping: a sensitivity (22.4 mV/N) or a scale (44.6 N/V).
        time: `COLUMN[:UNIT]` of the time ("-": none of the columns is).
        sample_rate_hz: Rate [Hz], instead of a time column.
        drive_amplitude: Of sweeps whose files do not tell it, with its unit: "20 mV", "20 mV rms".
        hold: Of the drive between its samples: "linear", "zero" or "band-limited".
        test: File whose records no fit uses; "last-third" or "none".
        name: Name of the dataset.
        force: Whether an existing manifest and picture are overwritten.
        plot: Whether `preview.png` is drawn.

    Raises:
        InputError: A file cannot be read, or something cannot be known from it; the message names what settles it.
    """
    answers = Answers(
        plant=plant, inputs=_texts(inputs), outputs=_texts(outputs), scales=_texts(scales), time=time,
        sample_rate_hz=sample_rate_hz, drive_amplitude=drive_amplitude, hold=hold, test=test, name=name,
        model=None if model is None else signals_of_model(_saved(model)),
    )  # fmt: skip
    paths = paths_of(files)
    surveys = by_groups(survey_files(paths), answers)
    folder = target_folder(paths, out, force=force)
    proposal = propose(surveys, answers)
    refuse_open(proposal, [str(path) for path in paths], answers)
    return write_proposal(proposal, folder, plot=plot)


def _saved(model: Model | PathText) -> Path:
    """Return the file of a model. Raises InputError where it has none, since the manifest's reader needs it later."""
    if not isinstance(model, Model):
        return path_of("model", model)
    if model.source is None:
        raise InputError("model: it was never written; give the path that `model.save(path)` returns")
    return model.source


def signals_of_model(path: Path) -> ModelSignals:
    """Return what a model file says of a dataset for it. Raises InputError also for an error in its equations."""
    found = read_model_signals(path)
    if found.outputs:
        read_model(path)
    return found


def paths_of(files: PathText | Sequence[PathText]) -> list[Path]:
    """Return the paths of one file or several. Raises InputError where one is neither text nor a path."""
    several = [files] if isinstance(files, str | PathLike) else list(files)
    return [path_of("files", one) for one in several]


def target_folder(files: Sequence[Path], out: PathText | None, *, force: bool) -> Path:
    """Return the folder of the manifest. Raises InputError where it holds one already."""
    if not files:
        raise InputError("no data file was given")
    folder = files[0].parent if out is None else path_of("out", out)
    for known in (MANIFEST, PICTURE):
        if not force and (folder / known).exists():
            raise InputError(
                f"{folder / known}: is there already and is not overwritten; choose another folder with --out, or say "
                "--force"
            )
    return folder


def write_proposal(proposal: Proposal, folder: Path, *, plot: bool = True) -> Initiation:
    """Write manifest and picture of a proposal; the manifest is read before, and not written if that fails.

    Raises:
        InputError: The manifest would be refused by `read_dataset`; the message is that of reading.
    """
    if proposal.model is not None and proposal.kind.free_signals:
        read_model(proposal.model)  # also of a model that a dialogue asked for: identify would refuse it
    path = folder / MANIFEST
    made = not folder.exists()
    try:
        with replacing(path) as partial:
            partial.write_text(manifest_text(proposal, folder), encoding="utf-8")
            dataset = _read(partial, path, proposal)
    except InputError:
        if made and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise
    kinds = proposal.kind.signals
    sources = {
        (kinds[one.name].stands_for if one.name in kinds else "") or one.name: Source(one.column, _short(one))
        for one in proposal.signals
    }
    summary = preview_with(dataset, sources)
    picture = summary.save(folder / PICTURE) if plot else None
    return Initiation(path=path, picture=picture, proposal=proposal, summary=summary)


def _short(signal: SignalGuess) -> str:
    """Return who states a unit, as a cell of a table."""
    source = signal.unit_source.partition(", taken as ")[0]
    source = source.replace("its name has ", "name: ").replace("the file states ", "file: ")
    held = absolute_unit(signal.unit).unit
    return source if held == signal.unit else f"{source}, moved to {held}"


def _read(partial: Path, path: Path, proposal: Proposal) -> Dataset:
    try:
        return replace(read_dataset(partial), path=path)
    except InputError as error:
        names = list(dict.fromkeys(str(one.file) for one in proposal.records))
        source = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
        lines = "\n".join(dict.fromkeys(
            _without_record(line) if len(names) == 1 else line
            for line in str(error).replace(str(partial), source).splitlines()
        ))  # fmt: skip
        raise InputError(
            f"{lines}\nno manifest is written; correct the files, or say more by options"
        ) from None


def _without_record(line: str) -> str:
    """Return a finding of reading without the place of its record: all records of a file have the same columns."""
    return re.sub(r'^(.*?: )records\.\d+ "[^"]*": ', r"\1", line)


def _texts(values: str | Sequence[str] | Mapping[str, str]) -> tuple[str, ...]:
    if isinstance(values, Mapping):
        return tuple(f"{name}={text}" for name, text in values.items())
    found = (values,) if isinstance(values, str) else tuple(values)
    if not all(isinstance(one, str) for one in found):
        raise InputError(f"columns are given as texts COLUMN[:UNIT], got {values!r:.60}")
    return found
