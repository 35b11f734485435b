"""What the program consists of here: `list_materials` and its `Materials`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rtctl.api.inputs import PathText, path_of
from rtctl.output.atomic_write import replacing
from rtctl.output.bill_of_materials import Material, bill_of_materials, materials
from rtctl.output.notebook import html_table

COMMAND = "sbom"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Materials:
    """Packages that the program uses here, with versions and licences."""

    packages: tuple[Material, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the bill of materials as CycloneDX 1.5 has it."""
        return bill_of_materials(list(self.packages))

    def save(self, path: PathText) -> Path:
        """Write the bill of materials (JSON), whole or not at all. Raises InputError where another file is there."""
        target = path_of("path", path)
        with replacing(target, COMMAND) as partial:
            partial.write_text(json.dumps(self.to_dict(), indent=1), encoding="utf-8")
        return target

    def __repr__(self) -> str:
        silent = sum(not one.licence for one in self.packages)
        return f"<Materials: {len(self.packages)} packages, {silent} whose metadata state no licence>"

    def _repr_html_(self) -> str:
        rows = [[one.name, one.version, one.licence or "not stated"] for one in self.packages]
        return html_table("Packages", ["name", "version", "licence"], rows, most_rows=len(rows))


def list_materials() -> Materials:
    """List the packages that the program uses here, those of its extras included where they are installed."""
    return Materials(packages=tuple(materials()))
