"""Which program a case was run by: its commit and version for people, a hash of all that an answer depends on."""

from __future__ import annotations

import hashlib
import subprocess
from dataclasses import dataclass
from pathlib import Path

from rtctl import __version__

ROOT = Path(__file__).resolve().parents[2]
HERE = ("case.py", "further.py", "judge.py", "least_bic.py", "sindy.py")
"""Beside the program and the generator; tables and pictures are made anew from old cases."""


@dataclass(frozen=True, kw_only=True)
class Program:
    """As it is on the disk."""

    commit: str
    """With `+` where files were changed since."""
    version: str
    code: str

    @classmethod
    def now(cls) -> Program:
        """Of the repository that this file lies in."""
        return cls(commit=_commit(), version=__version__, code=_code())

    def check(self) -> None:
        """Raises RuntimeError where a file has changed since: one campaign is of one program."""
        if _code() != self.code:
            raise RuntimeError("files of the program have changed while the campaign runs; start it again")


def _commit() -> str:
    name = _git("rev-parse", "--short=9", "HEAD") or "unknown"
    return name + ("+" if _git("status", "--porcelain", "--untracked-files=no") else "")


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def _code() -> str:
    here = ROOT / "tests" / "blind"
    files = [
        *(ROOT / "rtctl").rglob("*.py"),
        *(here / "generator").rglob("*.py"),
        *(here / name for name in HERE),
    ]
    found = hashlib.sha256()
    for file in sorted(files):
        found.update(str(file.relative_to(ROOT)).encode())
        found.update(file.read_bytes())
    return found.hexdigest()[:12]
