"""Whether a run's device still is its model: `doubt`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rtctl.api.documents import Document
from rtctl.api.inputs import PathText, path_of
from rtctl.border.errors import InputError
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.own_files import refuse_foreign
from rtctl.output.progress import Progress, reporter

if TYPE_CHECKING:
    from pathlib import Path

    from rtctl.doubt.policy import Policy
    from rtctl.doubt.watch import Finding
    from rtctl.session.doubting.under_way import MakePolicy


class DoubtReport(Document):
    """Whether a device still is its model: the content of `doubt.json`, and its main figures."""

    findings: tuple[Finding, ...]
    """What was seen, in order: kind, sample, since which sample, message, causes that were named."""

    def __init__(self, content: Mapping[str, Any], path: Path, findings: tuple[Finding, ...]) -> None:
        super().__init__(content, path)
        self.findings = findings

    @property
    def changed(self) -> bool | None:
        """Whether a change was seen; None where the run was too short to know."""
        if any(one.kind != "learned" for one in self.findings):
            return True
        return False if self.windows_compared else None

    @property
    def windows_compared(self) -> int:
        """Number of windows that were compared with those before them."""
        return int(self["windows_compared"])

    def figures(self) -> Mapping[str, str]:
        """Return whether a change was seen, and in how many windows it was looked for."""
        words = {True: "seen", False: "not seen", None: "not known, the run is too short"}
        return {"change": words[self.changed], "windows compared": str(self.windows_compared)}


def doubt(
    run: PathText,
    *,
    live: bool = False,
    policy: str = "warn",
    reference: bool = True,
    out: PathText | None = None,
    say: Callable[[Finding, str], None] = lambda finding, done: None,
    progress: Progress = False,
) -> DoubtReport:
    """Compare a run with its model window by window; say when the device changed, and what changed most likely.

    Args:
        run: Folder of a run that has ended or was killed; of one under way if `live`.
        live: Whether to follow a run under way until it ends; findings become events of the run.
        policy: Of a run under way: "warn", "derate" (half the gains), "stop", or "retune" (a model with the cause that
            was named takes over; kept if the measured error falls, else rolled back).
        reference: Whether the reference instrument is used where it was recorded.
        out: File for the result; None: `doubt.json` in the run's folder.
        say: Hears each finding as a record, and what was done about it.
        progress: True prints each finding, a callable hears (text, None).

    Returns:
        The content of `doubt.json`, a dict, with its main figures as attributes.

    Raises:
        InputError: There is no such run, or its kind of plant cannot be doubted, or another file is at `out`.
    """
    from rtctl.doubt.policy import Policy
    from rtctl.live_page.recorded.places import is_recording
    from rtctl.session.doubting import recorded
    from rtctl.session.doubting.under_way import doubt_live

    folder = path_of("run", run)
    if policy not in tuple(Policy):
        raise InputError(f'policy = "{policy}" is unknown; known: {", ".join(Policy)}')
    if policy != Policy.WARN and not live:
        raise InputError(
            f'policy = "{policy}" is for a run under way (live); one that has ended cannot be changed'
        )
    target = folder / "doubt.json" if out is None else path_of("out", out)
    refuse_foreign(target, "doubt")
    report = reporter(progress)

    def tell(finding: Finding, done: str) -> None:
        acted = f"; {done}" if done else ""
        report.say(f"sample {finding.sample}: {finding.kind}: {finding.message}{acted}")
        say(finding, done)

    if live:
        acting = _acting(Policy(policy), folder, reference)
        with stop_on_interrupt() as stop_requested:
            found = doubt_live(folder, acting, tell, is_recording, stop_requested, use_reference=reference)
    else:
        found = recorded.doubt_run(folder, use_reference=reference)
        for finding in found.findings:
            tell(finding, "")
    summary = recorded.summary_of(found)
    recorded.write_summary(target, summary)
    return DoubtReport(summary, target, tuple(found.findings))


def _acting(policy: Policy, folder: Path, reference: bool) -> MakePolicy:
    """Return how a policy acts on the run in a folder, through its control socket."""
    from rtctl.doubt.policy import OnceActing, Policy
    from rtctl.session.doubting.retuning import Retuning
    from rtctl.session.live import control_socket

    if policy is Policy.RETUNE:
        return lambda scenario, model, memory_before: Retuning(
            folder,
            scenario,
            model,
            lambda number: control_socket.change_model(folder, number),
            memory_before,
            use_reference=reference,
        )
    return lambda *of_run: OnceActing(
        policy,
        lambda: control_socket.parameters(folder),
        lambda name, value: control_socket.send(folder, name, value),
        lambda: control_socket.stop(folder),
    )
