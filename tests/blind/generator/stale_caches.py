"""Compiled kernels of an older source are dropped: numba watches the file of a kernel alone, and these call others."""

from __future__ import annotations

from pathlib import Path


def drop_stale_caches(folder: Path) -> int:
    """Remove numba's caches in `folder` that are older than its newest source; how many."""
    newest = max(source.stat().st_mtime for source in folder.glob("*.py"))
    stale = [one for one in folder.glob("__pycache__/*.nb[ic]") if one.stat().st_mtime < newest]
    for one in stale:
        one.unlink(missing_ok=True)  # another process may have been faster
    return len(stale)
