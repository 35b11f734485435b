"""Imports on demand: "module:attribute" strings, and plugin files of the user."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from rtctl.border.errors import InputError, nearest

PLUGINS = "RTCTL_PLUGINS"
"""Environment variable with the plugin files of this program, so that its worker processes import them too."""
_MODULE_PREFIX = "rtctl_plugin_"


def resolved(part: Any, needed_for: str) -> Any:
    """Return `part`, imported where it is a text "module:attribute".

    Raises:
        InputError: the module does not import or lacks the attribute; the message begins with `needed_for`.
    """
    return import_object(part, needed_for) if isinstance(part, str) else part


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
                f'{needed_for}: "{path}": there is no module "{error.name}" beside the scenario, in the working '
                "folder or among the installed ones"
            ) from None
        raise InputError(f'{needed_for}: "{path}" does not import: {_described(error)}') from error
    except Exception as error:
        raise InputError(f'{needed_for}: "{path}" does not import: {_described(error)}') from error


def import_plugin(path: Path) -> ModuleType:
    """Import the Python file `path` once and return its module. Raises InputError where it does not import."""
    if not path.is_file():
        raise InputError(f"--plugin {path}: there is no such file")
    if path.suffix != ".py":
        raise InputError(f"--plugin {path}: a Python file (.py) is needed")
    name = f"{_MODULE_PREFIX}{path.stem}"
    module = sys.modules.get(name)
    if module is not None and Path(str(module.__file__)).resolve() == path.resolve():
        return module
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise InputError(f"--plugin {path}: cannot be imported as a module")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except InputError as error:
        del sys.modules[name]
        raise InputError(f"--plugin {path}: {error}") from None
    except Exception as error:
        del sys.modules[name]
        raise InputError(f"--plugin {path}: does not import: {_described(error, path)}") from error
    return module


def forget_plugin(path: Path) -> None:
    """Drop the module of a plugin file, so that it is imported anew."""
    sys.modules.pop(f"{_MODULE_PREFIX}{path.stem}", None)


def announce_plugin(path: Path) -> None:
    """Add `path` to the plugins that worker processes of this program import."""
    known = os.environ.get(PLUGINS, "").split(os.pathsep)
    if str(path.resolve()) not in known:
        os.environ[PLUGINS] = os.pathsep.join([*filter(None, known), str(path.resolve())])


def announced_plugins() -> list[Path]:
    """Return the plugin files that the environment names."""
    return [Path(name) for name in os.environ.get(PLUGINS, "").split(os.pathsep) if name]


def look_beside(folder: Path) -> None:
    """Let "module:Class" find modules in `folder` and in the working folder, after all installed ones."""
    for place in (str(folder.resolve()), str(Path.cwd())):
        if place not in sys.path:
            sys.path.append(place)


def _described(error: Exception, file: Path | None = None) -> str:
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
