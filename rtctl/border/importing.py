"""Objects that a file names as "module:attribute", such as a class of the user in a file beside it."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from rtctl.border.errors import InputError, nearest


def import_object(path: str, needed_for: str) -> Any:
    """Return the object that "module:attribute" names; the attribute may have dots. Raises InputError."""
    module_name, _, attribute = path.partition(":")
    if not module_name or not attribute:
        raise InputError(f'{needed_for}: "{path}" is not "module:Class", such as "my_parts:MyController"')
    found: Any = _imported(module_name, path, needed_for)
    for name in attribute.split("."):
        if not hasattr(found, name):
            public = [known for known in vars(found) if not known.startswith("_")]
            raise InputError(f'{needed_for}: "{module_name}" has no "{name}"{nearest(name, public)}')
        found = getattr(found, name)
    return found


def _imported(module_name: str, path: str, needed_for: str) -> ModuleType:
    try:
        return importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is not None and (module_name == error.name or module_name.startswith(f"{error.name}.")):
            raise InputError(
                f'{needed_for}: "{path}": there is no module "{error.name}" beside the file, in the working '
                "folder or among the installed ones"
            ) from None
        raise InputError(f'{needed_for}: "{path}" does not import: {described(error)}') from error
    except Exception as error:
        raise InputError(f'{needed_for}: "{path}" does not import: {described(error)}') from error


def look_beside(folder: Path) -> None:
    """Let "module:Class" find modules in `folder` and in the working folder, after all installed ones."""
    for place in (str(folder.resolve()), str(Path.cwd())):
        if place not in sys.path:
            sys.path.append(place)


def described(error: Exception, file: Path | None = None) -> str:
    """Return the error's type and message, and the line of `file` in which it was raised."""
    line, trace = None, error.__traceback__
    if isinstance(error, SyntaxError):
        line = error.lineno
    while trace is not None and file is not None:
        if Path(trace.tb_frame.f_code.co_filename) == file.resolve():
            line = trace.tb_lineno
        trace = trace.tb_next
    place = f" (line {line})" if line is not None else ""
    return f"{type(error).__name__}: {error}{place}"
