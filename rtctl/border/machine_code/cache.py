"""numba's cache of compiled kernels on the disk, such that it can neither be stale nor stop a program.

numba keys a cache on the file of the kernel alone, and ends with a traceback where a file of the cache is damaged, the
disk is full, or no folder can be written. Here each cache has a stamp of all that is compiled into it, each file of
machine code its own checksum; what cannot be believed is compiled anew, and what cannot be written is left.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import pickle
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numba
from numba.core import caching

_Files: Any = caching.IndexDataCacheFile

_DIGEST_BYTES = 32


class CacheFile(_Files):  # type: ignore[misc]
    """Files of one kernel's cache; an index of numba's own has another stamp, and is not believed."""

    def __init__(self, made: Any, stamp: str) -> None:
        self.__dict__.update(made.__dict__)
        self._source_stamp = stamp

    def load(self, key: Any) -> Any:
        """Return what is kept for a key, or None: nothing is, or it is damaged."""
        try:
            return super().load(key)
        except Exception:  # damaged bytes end in any error of pickle's
            return None

    def save(self, key: Any, data: Any) -> None:
        """Keep the machine code for a key, where there is room; the program has it in memory."""
        with suppress(OSError):
            super().save(key, data)

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except Exception:
            return {}

    def _load_data(self, name: str) -> Any:
        with open(self._data_path(name), "rb") as file:
            digest, content = file.read(_DIGEST_BYTES), file.read()
        if digest != self._digest(content):  # damaged, or of an older index
            raise ValueError(name)
        return pickle.loads(content)

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(self._digest(content) + content)

    def _digest(self, content: bytes) -> bytes:
        return hashlib.sha256(self._source_stamp.encode() + content).digest()


def jit(function: Callable[..., Any], **options: Any) -> Any:
    """Return `function`, compiled at its first call with these options of numba's, cached where there is a place."""
    of_numba: Any = numba
    try:
        return of_numba.njit(cache=True, **options)(function)
    except RuntimeError as error:
        if "cannot cache" not in str(error):
            raise
        _warn_once()
        return of_numba.njit(**options)(function)


def stamp(compiled: Any, text: str) -> None:
    """Give the cache of a compiled function, if it has one, a stamp of all that is compiled into it."""
    cache: Any = getattr(compiled, "_cache", None)
    if not hasattr(cache, "_cache_file"):  # NUMBA_DISABLE_JIT=1, or no place
        return
    digest = hashlib.sha256(text.encode()).hexdigest()  # of one length, since other stamps contain it
    cache._cache_file = CacheFile(cache._cache_file, digest)
    save = cache.save_overload

    def save_where_there_is_room(*arguments: Any) -> None:
        with suppress(OSError):  # its folder is gone, or may not be written any more
            save(*arguments)

    cache.save_overload = save_where_there_is_room


def stamp_of(compiled: Any) -> str | None:
    """Return the stamp of a compiled function's cache; None: it has no cache."""
    file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if file is None:
        return None
    found = file._source_stamp
    return found.hex() if isinstance(found, bytes) else str(found)


@functools.cache
def _warn_once() -> None:
    logging.getLogger("rtctl").warning(
        "compiled kernels cannot be kept, as no folder for them can be written: each start compiles them anew, which "
        "takes up to minutes; set NUMBA_CACHE_DIR to a folder that can be written"
    )
