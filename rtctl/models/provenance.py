"""What a model file says of its origin, and writing one that says it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel

from rtctl.border.units.quantities import read_toml
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of

DOUBT = (
    'the diagnosis that wrote {} did not explain its data ("{}"): something is left that this model does not have, so '
    "compare the tracking errors of a run with it and of one with the model before it"
)
NOT_TRUSTED = "the identification of {} says that this model is not to be trusted: a loop with it may do harm"


def maker_of_model(provenance: Mapping[str, Any]) -> str:
    """Return which command writes a model file with this provenance: a diagnosis states its verdict."""
    return "diagnose" if "verdict" in provenance else "identify"


def write_model_file(path: Path, tables: Mapping[str, Any], provenance: Mapping[str, Any]) -> None:
    """Write the tables of a model file, whole or not at all.

    Raises:
        InputError: a file is there that the command which writes such a model did not write.
    """
    command = maker_of_model(provenance)
    with replacing(path, command) as partial:
        partial.write_text(f"# Written by {mark_of(command)}\n\n{tomli_w.dumps(tables)}", encoding="utf-8")


def write_checked_model(path: Path, model: BaseModel) -> None:
    """Write a checked model file with its own `provenance`; numbers that are plain in an expression stay as texts."""
    tables = model.model_dump(exclude_none=True, exclude_defaults=True)
    write_model_file(path, tables, tables.get("provenance", {}))


def doubt_of_model(path: Path) -> str:
    """Return a sentence where the model file says that it does not follow its data; "" otherwise.

    A diagnosis that did not explain its data writes its verdict, an identification whether its model is trusted.

    Raises:
        InputError: the file cannot be read.
    """
    content: Mapping[str, Any] = read_toml(path)
    tables = [content, content.get("model", {})]
    for table in tables:
        provenance = table.get("provenance", {}) if isinstance(table, Mapping) else {}
        verdict = str(provenance.get("verdict", "")) if isinstance(provenance, Mapping) else ""
        if isinstance(provenance, Mapping) and str(provenance.get("trusted", "")).lower() == "false":
            return NOT_TRUSTED.format(path.name)
        if verdict in ("partly_explained", "unexplained"):
            return DOUBT.format(path.name, verdict)
    return ""
