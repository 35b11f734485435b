"""What a model file says of its origin."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.border.units.quantities import read_toml

DOUBT = (
    'the diagnosis that wrote {} did not explain its data ("{}"): something is left that this model does not have, so '
    "compare the tracking errors of a run with it and of one with the model before it"
)
NOT_TRUSTED = "the identification of {} says that this model is not to be trusted: a loop with it may do harm"


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
