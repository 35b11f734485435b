"""Steps of the screening: each adds its notes once, also one that returns what it was given."""

from __future__ import annotations

from rtctl.diagnosis.screening.screened import Screened, apply_steps


def test_a_step_that_changes_nothing_repeats_no_note() -> None:
    def adds(screened: Screened) -> Screened:
        return screened._replace(notes=("new",))

    def changes_nothing(screened: Screened) -> Screened:
        return screened

    found = apply_steps(Screened((), (), ("old",)), (changes_nothing, adds, changes_nothing))
    assert found.notes == ("old", "new")
