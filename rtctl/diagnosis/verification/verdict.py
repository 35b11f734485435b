"""The verdict: adequate, explained, partly explained or unexplained; each check may lower it and says why."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What is claimed so far, and the notes of the checks that it went through."""

    claim: str
    """"adequate", "explained", "partly_explained" or "unexplained"."""
    notes: tuple[str, ...] = ()
    """Why a check lowered the claim, or what it could not decide."""
    stopped: bool = False
    """Whether the user stopped a check."""

    @property
    def names_causes(self) -> bool:
        """Return whether causes are claimed."""
        return self.claim in ("explained", "partly_explained")

    @property
    def leaves_gap(self) -> bool:
        """Return whether something is left that nothing explains."""
        return self.claim in ("unexplained", "partly_explained")

    def changed_to(self, claim: str, note: str) -> Verdict:
        """Return the verdict with another claim, and the note that says why."""
        return replace(self, claim=claim, notes=(*self.notes, note))

    def with_note(self, note: str) -> Verdict:
        """Return the same claim with one more note."""
        return replace(self, notes=(*self.notes, note))
