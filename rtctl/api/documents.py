"""What a call wrote into a JSON file, as a dict with its main figures as attributes: `Document`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.output.notebook import html_table


class Document(dict[str, Any]):
    """The content of a JSON file, by its keys; subclasses name what most callers need."""

    path: Path
    """The file, or the folder that holds it."""

    def __init__(self, content: Mapping[str, Any], path: Path) -> None:
        super().__init__(content)
        self.path = path

    def figures(self) -> Mapping[str, str]:
        """Return the main figures in words, by their names."""
        return {}

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {text}" for name, text in self.figures().items())
        return f"<{type(self).__name__} in {self.path}{': ' if told else ''}{told}>"

    def _repr_html_(self) -> str:
        rows = [[name, text] for name, text in self.figures().items()]
        return html_table(type(self).__name__, ["", str(self.path)], rows)
