"""Many simulations from one file, and the papers' studies: `sweep`, `reproduce_study`."""

from __future__ import annotations

import importlib
import json
import shlex
from typing import Any

from rtctl.api.inputs import PathText, path_of
from rtctl.border.errors import InputError, nearest
from rtctl.border.options import check_integer
from rtctl.extras import can_draw, require
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.progress import Progress, reporter

STUDIES: tuple[str, ...] = ("vo2", "me", "bistable")
"""Packages in `rtctl.reproduce`, each with a module `study.py` that has a `STUDY`."""
MOST_WORKERS = 4096


def sweep(
    campaign: PathText,
    out: PathText,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    plot: bool = True,
    progress: Progress = False,
) -> dict[str, Any]:
    """Simulate a model over a grid or a design of parameters; an interrupted campaign goes on where it was stopped.

    Args:
        campaign: A campaign's file or the name of a bundled one.
        out: Folder of the results.
        workers: Processes on this machine; None: its cores.
        scheduler: Address of a Dask cluster, "tcp://HOST:PORT"; None: this machine.
        plot: Whether to draw the picture that the campaign asks for.
        progress: True shows a bar, a callable hears (text, share that is done).

    Returns:
        The summary: counts of each kind of trajectory, least errors, parts, time.

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
    return summary


def reproduce_study(
    study: str, out: PathText, *, short: bool = False, progress: Progress = False
) -> dict[str, Any]:
    """Repeat a paper's study on simulated plants, its tables and figures beside ours.

    Args:
        study: "vo2", "me" or "bistable".
        out: Folder of the report; a stopped study goes on there.
        short: Whether to take fewer seeds and shorter records.
        progress: True prints a line a step, a callable hears (text, None).

    Returns:
        The content of `results.json`.

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
    return content
