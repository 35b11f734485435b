"""Many simulations from one file, and the papers' studies: `sweep`, `reproduce_study`."""

from __future__ import annotations

import importlib
import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rtctl.api.documents import Document
from rtctl.api.inputs import PathText, path_of
from rtctl.border.errors import InputError, nearest
from rtctl.border.options import check_integer
from rtctl.extras import can_draw, require
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.progress import Progress, reporter

STUDIES: tuple[str, ...] = ("vo2", "me", "bistable")
"""Packages in `rtctl.reproduce`, each with a module `study.py` that has a `STUDY`."""
MOST_WORKERS = 4096


class SweepSummary(Document):
    """What came of a campaign: the content of `summary.json`, and its main figures."""

    @property
    def trajectories(self) -> int:
        """Number of simulations."""
        return int(self["trajectories"])

    @property
    def kinds(self) -> Mapping[str, int]:
        """Number of trajectories of each kind; empty where the campaign does not tell kinds apart."""
        return dict(self.get("kind", {}))

    @property
    def least(self) -> Mapping[str, float]:
        """The trajectory with the least error: its factors and that error; empty where nothing was compared."""
        return dict(self.get("least", {}))

    @property
    def wall_s(self) -> float:
        """How long this call took [s]; parts that were there before cost nothing."""
        return float(self["wall_s"])

    def figures(self) -> Mapping[str, str]:
        """Return numbers of trajectories and the least error in words."""
        least = {f"least error: {name}": f"{value:.6g}" for name, value in self.least.items()}
        counts = {name: f"{count:,}" for name, count in self.kinds.items()}
        return {"trajectories": f"{self.trajectories:,}", **counts, **least}


class StudyResults(Document):
    """What came of a paper's study: the content of `results.json`, and its main figures."""

    @property
    def sections(self) -> Sequence[Mapping[str, Any]]:
        """Sections of the report: "name", "seconds", tables with the paper's figures beside ours."""
        return tuple(self["sections"])

    @property
    def seconds(self) -> float:
        """How long all sections took [s]."""
        return sum(float(one["seconds"]) for one in self.sections)

    @property
    def report(self) -> Path:
        """The page with tables and figures."""
        return self.path / "report.html"

    def figures(self) -> Mapping[str, str]:
        """Return the sections with the time that each took."""
        return {str(one["name"]): f"{float(one['seconds']):.3g} s" for one in self.sections}


def sweep(
    campaign: PathText,
    out: PathText,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    plot: bool = True,
    progress: Progress = False,
) -> SweepSummary:
    """Simulate a model over a grid or a design of parameters; an interrupted campaign goes on where it was stopped.

    Args:
        campaign: A campaign's file or the name of a bundled one.
        out: Folder of the results.
        workers: Processes on this machine; None: its cores.
        scheduler: Address of a Dask cluster, "tcp://HOST:PORT"; None: this machine.
        plot: Whether to draw the picture that the campaign asks for.
        progress: True shows a bar, a callable hears (text, share that is done).

    Returns:
        The summary: counts of each kind of trajectory, least errors, parts, time; a dict with these as attributes.

    Raises:
        InputError: The campaign, the folder or an option is wrong.
        RunError: It was stopped, or the workers are gone.
    """
    from rtctl.campaign.file import find_campaign
    from rtctl.campaign.local import cores
    from rtctl.campaign.plan import read_plan
    from rtctl.campaign.run import run_campaign

    if workers is not None:
        check_integer("workers", workers, 1, MOST_WORKERS, "processes; at least 1 is needed")
    plan, folder = read_plan(find_campaign(str(path_of("campaign", campaign)))), path_of("out", out)
    report = reporter(progress)
    title = plan.campaign.campaign.title
    with stop_on_interrupt() as stop, report.bar(title, plan.design.samples) as advance:
        summary = run_campaign(
            plan, folder, workers=workers or cores(), scheduler=scheduler, stop=stop, advance=advance
        )  # fmt: skip
    if plan.campaign.picture is not None and plot and can_draw():
        from rtctl.campaign.figures import draw_campaign

        draw_campaign(plan, folder)
    return SweepSummary(summary, folder)


def reproduce_study(
    study: str, out: PathText, *, short: bool = False, progress: Progress = False
) -> StudyResults:
    """Repeat a paper's study on simulated plants, its tables and figures beside ours.

    Args:
        study: "vo2", "me" or "bistable".
        out: Folder of the report; a stopped study goes on there.
        short: Whether to take fewer seeds and shorter records.
        progress: True prints a line a step, a callable hears (text, None).

    Returns:
        The content of `results.json`, a dict, with its main figures as attributes.

    Raises:
        InputError: There is no such study, or a file of another origin is in the way.
    """
    from datetime import date

    from rtctl.reproduce.report import check_folder, write_report
    from rtctl.reproduce.run import run_study
    from rtctl.version import __version__

    if study not in STUDIES:
        raise InputError(f'no study "{study}"{nearest(str(study), STUDIES)}')
    require("matplotlib", "rtctl reproduce")
    folder, report = path_of("out", out), reporter(progress)
    check_folder(folder)
    plan = importlib.import_module(f"rtctl.reproduce.{study}.study").STUDY
    sections = run_study(
        plan, folder, short=short, report=lambda line: report.say(f"reproduce {study}: {line}")
    )
    words = ["rtctl", "reproduce", study, "--out", str(folder), *(["--short"] if short else [])]
    write_report(plan, sections, folder, shlex.join(words), f"{date.today():%Y-%m-%d}, rtctl {__version__}")
    content: dict[str, Any] = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    return StudyResults(content, folder)
