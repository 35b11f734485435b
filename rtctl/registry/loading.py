"""Imports on demand: parts that may be "module:attribute" strings, and plugin files of the user."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.importing import described, import_object

PLUGINS = "RTCTL_PLUGINS"
"""Environment variable with the plugin files of this program, so that its worker processes import them too."""
_MODULE_PREFIX = "rtctl_plugin_"


def resolved(part: Any, needed_for: str) -> Any:
    """Return `part`, imported where it is a text "module:attribute".

    Raises:
        InputError: the module does not import or lacks the attribute; the message begins with `needed_for`.
    """
    return import_object(part, needed_for) if isinstance(part, str) else part


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
        raise InputError(f"--plugin {path}: does not import: {described(error, path)}") from error
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
