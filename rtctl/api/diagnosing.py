"""What a simulation gets wrong, and why: `diagnose` and its `Diagnosis`."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.datasets import dataset_of, stored_dataset_of
from rtctl.api.diagnosis_defaults import SECONDS, WORK
from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, kind_of, model_of
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError, nearest
from rtctl.border.options import check_integer
from rtctl.border.work import current_meter
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.extras import can_draw, require
from rtctl.measured.dataset import Dataset
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.notebook import html_table, number
from rtctl.output.own_files import mark_of, refuse_foreign, refuse_read
from rtctl.output.progress import Progress, Reporter, reporter

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtctl.api.identifying.fit import Fit
    from rtctl.border.simulation import Simulation
    from rtctl.diagnosis.experiment_design.next_experiment import NextExperiment
    from rtctl.diagnosis.residual.localization import Location
    from rtctl.diagnosis.result import Cause
    from rtctl.diagnosis.result import Diagnosis as Answer
    from rtctl.diagnosis.search.holdout_error import Gain

MODEL = "model.toml"
"""The nominal model in the folder of an answer, where the diagnosis identified it."""
MOST_THREADS = 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Diagnosis:
    """The answer of a diagnosis: what is wrong, how sure that is, and the model with it."""

    answer: Answer
    """All that the search found, with its own types; the properties below are what most callers need."""
    dataset: Dataset
    nominal: Model
    """The model that was diagnosed."""
    words: tuple[str, ...]
    """Options of the command line that gives the same answer."""
    fit: Fit | None = None
    """The identification of the nominal model; None where a model was given."""
    replaced: Mapping[str, Any] = field(default_factory=dict)
    """Thresholds that were replaced, by name, such as "search.rivals"; the command line has no option for them."""

    @property
    def verdict(self) -> str:
        """The verdict: "adequate", "explained", "partly_explained" or "unexplained"."""
        return self.answer.verdict

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Named effects with probability and parameters (95 % intervals, units), the most certain first."""
        return self.answer.causes

    @property
    def gain(self) -> Gain | None:
        """Error on the test records before and after, with unit and 95 % interval; None without such records."""
        return self.answer.gain

    @property
    def where(self) -> tuple[Location, ...]:
        """Coordinates along which the error lives, each with its share."""
        return self.answer.where

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know beside the verdict."""
        return self.answer.warnings

    @property
    def next_experiment(self) -> NextExperiment | None:
        """The experiment that would decide what these data leave open; None where nothing is open."""
        return self.answer.next_experiment

    @property
    def model(self) -> Model | None:
        """The model with re-fitted parameters and the causes; None where none is claimed or the gain is not certain."""
        if self.answer.withheld:
            return None
        return Model(kind=self.nominal.kind, content=self.answer.model)

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal."""
        return self.answer.units

    @property
    def stopped(self) -> bool:
        """Whether the user stopped the search; the answer is of what was done by then."""
        return self.answer.stopped

    def to_dict(self, folder: PathText = "DIR") -> dict[str, Any]:
        """Return the content of the `diagnosis.json` that `save(folder)` writes, without NaN and infinity."""
        from rtctl.evaluation.metrics import finite

        provenance = self._provenance(path_of("folder", folder))
        marked = {"program": mark_of("diagnose"), **self.answer.json, "provenance": provenance}
        content: dict[str, Any] = finite(marked)
        return content

    def figures(self) -> Mapping[str, Figure]:
        """Return all figures of the report by their name, such as "stretch", "spectrum", "plane", "candidates"."""
        require("matplotlib", "Diagnosis.figures")
        from rtctl.diagnosis.report.pictures import pictures

        named: dict[str, Figure] = {}
        for picture in pictures(self.answer):
            number_of_name = sum(name.split(".")[0] == picture.section for name in named)
            named[picture.section if not number_of_name else f"{picture.section}.{number_of_name}"] = (
                picture.figure
            )
        return named

    def plot(self, name: str = "stretch") -> Figure:
        """Return one figure; by default measured and simulated motion before and after.

        Raises:
            InputError: This answer has no such figure; the message lists those that it has.
        """
        figures = self.figures()
        if name not in figures:
            raise InputError(f'no figure "{name}"{nearest(str(name), figures)}')
        return figures[name]

    def save(self, folder: PathText) -> Path:
        """Write `diagnosis.json`, `report.html`, `model-extended.toml` and `next-experiment.toml` into a folder.

        The model is written only where `model` is not None, the next experiment only where something is open; a model
        that the diagnosis identified itself is `model.toml`. Files of an earlier answer are removed; the JSON file is
        written last, so that a folder that has it is whole.

        Raises:
            InputError: A file of another origin is in the way, or the diagnosed model itself is.
        """
        from rtctl.diagnosis.report.files import NAMES, write_diagnosis

        target = path_of("folder", folder)
        source = self.nominal.source
        refuse_read((target / name for name in NAMES), [] if source is None else [source])
        if self.fit is not None:
            refuse_read([target / MODEL], [self.dataset.path])
            refuse_foreign(target / MODEL, "identify")
            self.fit.save(target / MODEL, plot=can_draw())
        write_diagnosis(target, self.answer, self.dataset, self._provenance(target))
        return target

    def _provenance(self, folder: Path) -> dict[str, Any]:
        from rtctl.diagnosis.report.files import provenance_of

        with self.nominal.file() as file:
            given = [] if self.fit is not None else ["--model", str(file)]
            words = ["rtctl", "diagnose", str(self.dataset.path), *given, "--out", str(folder), *self.words]
            provenance = provenance_of(self.answer, self.dataset, file, shlex.join(words))
        return {**provenance, **({"thresholds": dict(self.replaced)} if self.replaced else {})}

    def __repr__(self) -> str:
        names = ", ".join(f"{cause.id} ({cause.certainty})" for cause in self.causes)
        return f"<Diagnosis of {self.dataset.name}: {self.verdict}{': ' if names else ''}{names}>"

    def _repr_html_(self) -> str:
        rows = [
            [cause.certainty, cause.id, cause.statement, ", ".join(cause.indistinguishable_from)]
            for cause in self.causes
        ]
        from rtctl.diagnosis.report.words.findings import describe_shares
        from rtctl.diagnosis.report.words.noise import describe_noise

        notes = [*filter(None, [describe_shares(self.causes)]), *self.warnings]
        if (gain := self.gain) is not None:
            after = f", {number(gain.after, gain.unit)} with the causes" if self.causes else ""
            notes.insert(0, f"error on test records: {number(gain.before, gain.unit)}{after} "
                            f"({describe_noise(self.answer)})")  # fmt: skip
        title = f"{self.dataset.name}: {self.verdict.replace('_', ' ')}"
        return html_table(title, ["probability", "cause", "statement", "not told apart from"], rows, notes)


# 9 parameters because each is an option of a diagnosis
def diagnose(  # noqa: PLR0913
    dataset: Dataset | PathText,
    model: Model | PathText | None = None,
    *,
    mechanisms: Sequence[str] | str | None = None,
    false_claim_rate: float = 0.05,
    work: float = WORK,
    seconds: float = SECONDS,
    thresholds: Thresholds | None = None,
    threads: int | None = None,
    progress: Progress = False,
) -> Diagnosis:
    """Find what the model gets wrong about the data, name the causes and extend the model by them.

    Args:
        dataset: A dataset or its manifest.
        model: Today's model or its file; None: the nominal model is identified first (`Diagnosis.fit`), as the command
            does; equations need one.
        mechanisms: Ids of the mechanisms to try; None: the whole catalogue.
        false_claim_rate: How often a cause may be claimed where there is none, above 0 and below 0.5.
        work: Simulated steps after which no further fit begins, 4.8e9 unless given: a count of steps, where the
            command's `--work` counts millions of them (`work=1e9` is `--work 1000`).
        seconds: Outer guard of wall-clock time [s], 1800 unless given, as of the command; an answer that it cut
            depends on the machine and says so. `math.inf`: none.
        thresholds: Numbers that decide (docs/thresholds.md): `Thresholds()` with some replaced by
            `dataclasses.replace`; None: as they are. What was replaced stands in `diagnosis.json`.
        threads: Threads that simulate records, 1 to 64; None: 2, or 1 on a machine of one core. The answer does not
            depend on it.
        progress: True shows the fit under way, a callable hears (text, None).

    Returns:
        The answer; Ctrl-C gives the one that is known by then (`stopped`).

    Raises:
        InputError: A file or an option is wrong, or model and data do not fit.
        FitError: No model was given, and no start of its identification leads anywhere.
        RunError: Stopped before anything was known.
    """
    from rtctl.diagnosis import diagnose as internal
    from rtctl.models.temperatures import describe_celsius
    from rtctl.session.validation.model_validation import check_kind, simulation_of

    options = _options(false_claim_rate, work, seconds, thresholds, threads)
    report, fit = reporter(progress), None
    stored = stored_dataset_of(dataset)
    if model is None:
        dataset, fit = _identified(dataset, mechanisms, progress)
        model = fit.model
    source = str(model.source or "the model") if isinstance(model, Model) else str(path_of("model", model))
    check_kind(kind_of(model), stored, source)
    model = model_of(model)
    simulation_of(
        model.kind, model.content, stored, source
    )  # what does not fit is said before numbers are read
    data = dataset_of(dataset)
    simulation = simulation_of(model.kind, model.content, data, source)
    ids = _chosen(mechanisms, simulation)
    with watched_search(f"diagnose {data.name}", options.cancellation, report, options.work) as heard:
        answer = internal.diagnose(data, model.content, simulation, ids, options, heard)
    celsius = describe_celsius(model.content, data) if isinstance(model.content, EquationsFile) else ()
    answer = replace(answer, warnings=(*data.remarks, *celsius, *answer.warnings))
    return Diagnosis(
        answer=answer, dataset=data, nominal=model, words=_words(options, mechanisms), fit=fit,
        replaced=_replaced(options.thresholds),
    )  # fmt: skip


def _options(
    false_claim_rate: float, work: float, seconds: float, thresholds: Thresholds | None, threads: int | None
) -> DiagnosisOptions:
    """Return the checked options of the search. Raises InputError."""
    if not isinstance(thresholds, Thresholds | None):
        raise InputError(f"thresholds must be rtctl.Thresholds, got {type(thresholds).__name__}")
    given: dict[str, Any] = {} if thresholds is None else {"thresholds": thresholds}
    if threads is not None:
        given["threads"] = check_integer("threads", threads, 1, MOST_THREADS)
    return DiagnosisOptions(false_claim_rate=false_claim_rate, work=work, seconds=seconds, **given)


def _replaced(thresholds: Thresholds) -> dict[str, Any]:
    """Return the thresholds that are not the program's own, by name."""
    ours = asdict(Thresholds())
    return {
        f"{group}.{name}": value
        for group, table in asdict(thresholds).items()
        for name, value in table.items()
        if value != ours[group][name]
    }


def _identified(
    dataset: Dataset | PathText, mechanisms: Sequence[str] | str | None, progress: Progress
) -> tuple[Dataset, Fit]:
    """Return the dataset, and its nominal model identified. Raises InputError also for an unknown mechanism."""
    from rtctl.api.identifying.identification import identify

    if mechanisms is not None:
        check_mechanisms(mechanisms, dataset)
    data = dataset_of(dataset)
    return data, identify(data, progress=progress)


@contextmanager
def watched_search(
    title: str, cancellation: CancellationToken, report: Reporter, work: float | None = None
) -> Iterator[Callable[[str], None]]:
    """Yield what hears of each fit of a search; Ctrl-C or SIGTERM cancels it, a second Ctrl-C interrupts at once.

    Args:
        title: What is searched.
        cancellation: Is set by the first Ctrl-C.
        report: How it is shown.
        work: Simulated steps after which no further fit begins; None: no limit.
    """

    def share() -> float | None:
        meter = current_meter()  # of the search, which calls
        return None if meter is None or not work else meter.steps / work

    with stop_on_interrupt(cancellation.cancel), report.fits(title, share, stage_of_search) as show:
        yield lambda text: show("stopping: writing what is done" if cancellation.cancelled else text)


def stage_of_search(text: str) -> str:
    """Return the stage of a search that a fit of these causes belongs to; a text that names none is a stage itself."""
    names = text.split(" + ")
    if " " in text.replace(" + ", ""):
        return text
    if names[0].startswith("nonparametric."):
        return "laws without a formula, for comparison"
    return "causes one at a time" if len(names) == 1 else f"sets of {len(names)} causes"


def _chosen(asked: Sequence[str] | str | None, simulation: Simulation) -> tuple[str, ...]:
    """Return the ids to try in the catalogue's order. Raises InputError for one that is unknown or not for such data.

    A mechanism that is not for such data is left out in silence where all are tried.
    """
    from rtctl.border.simulation import HasCatalogue
    from rtctl.wiring_models import mechanism_ids

    known = simulation.catalogue if isinstance(simulation, HasCatalogue) else mechanism_ids(simulation.kind)
    if asked is None:
        return known
    wanted = _listed(asked, known)
    for name in wanted:
        _check_units(name, simulation)
    return tuple(name for name in known if name in wanted)


def check_mechanisms(asked: Sequence[str] | str, dataset: Dataset | PathText) -> None:
    """Raise InputError for a mechanism that the catalogue of a dataset's plant lacks, before anything is identified.

    A model of equations has a catalogue of its own, and is checked with it.
    """
    from rtctl.wiring_models import mechanism_ids

    if known := mechanism_ids(stored_dataset_of(dataset).plant):
        _listed(asked, known)


def _listed(asked: Sequence[str] | str, known: Sequence[str]) -> list[str]:
    """Return the ids that were asked for. Raises InputError where one is not among the `known` ones, or none is."""
    listed = asked.split(",") if isinstance(asked, str) else list(asked)
    wanted = [str(name).strip() for name in listed if str(name).strip()]
    for name in wanted:
        if name not in known:
            raise InputError(f'mechanisms: there is no mechanism "{name}"{nearest(name, known)}')
    if not wanted:
        raise InputError("mechanisms: name one at least, such as friction.coulomb")
    return wanted


def _check_units(name: str, simulation: Simulation) -> None:
    """Raise InputError where a mechanism that was asked for has no meaning in the units of the data."""
    mechanism = simulation.extended((name,)).mechanisms[-1]
    if not mechanism.suits_data:
        unit = next(one.default_unit for one in mechanism.parameters if one.default_unit)
        raise InputError(
            f'mechanisms: "{name}" is for data whose displacement is in {unit} or a multiple of it; give the signal '
            "such a unit, with a `scale` if it was read in another, or leave the mechanism out"
        )


def _words(options: DiagnosisOptions, mechanisms: Sequence[str] | str | None) -> tuple[str, ...]:
    """Return the options as the command line has them."""
    words = ["--false-claims", f"{options.false_claim_rate:g}"]
    words += ["--seconds", f"{options.seconds:g}"] if options.seconds != SECONDS else []
    words += ["--work", f"{1e-6 * options.work:g}"] if options.work != WORK else []
    if mechanisms:
        words += ["--mechanisms", mechanisms if isinstance(mechanisms, str) else ",".join(mechanisms)]
    return tuple(words)
