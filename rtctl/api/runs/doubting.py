"""Whether a run's device still is its model: `doubt`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rtctl.api.inputs import PathText, path_of
from rtctl.border.errors import InputError
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.own_files import refuse_foreign

if TYPE_CHECKING:
    from pathlib import Path

    from rtctl.doubt.policy import Policy
    from rtctl.doubt.watch import Finding
    from rtctl.session.doubting.under_way import MakePolicy


def doubt(
    run: PathText,
    *,
    live: bool = False,
    policy: str = "warn",
    reference: bool = True,
    out: PathText | None = None,
    say: Callable[[Finding, str], None] = lambda finding, done: None,
) -> dict[str, Any]:
    """Compare a run with its model window by window; say when the device changed, and what changed most likely.

    Args:
        run: Folder of a run that has ended or was killed; of one under way if `live`.
        live: Whether to follow a run under way until it ends; findings become events of the run.
        policy: Of a run under way: "warn", "derate" (half the gains), "stop", or "retune" (a model with the cause that
            was named takes over; kept if the measured error falls, else rolled back).
        reference: Whether the reference instrument is used where it was recorded.
        out: File for the result; None: `doubt.json` in the run's folder.
        say: Hears each finding and what was done about it.

    Returns:
        The content of `doubt.json`.

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
    if live:
        acting = _acting(Policy(policy), folder, reference)
        with stop_on_interrupt() as stop_requested:
            found = doubt_live(folder, acting, say, is_recording, stop_requested, use_reference=reference)
    else:
        found = recorded.doubt_run(folder, use_reference=reference)
        for finding in found.findings:
            say(finding, "")
    summary = recorded.summary_of(found)
    recorded.write_summary(target, summary)
    return summary


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
