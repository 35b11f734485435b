"""A campaign's folder: campaign.json describes it, parts/part-000012.parquet are its results, whole or absent."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from rtctl.border.errors import InputError
from rtctl.campaign.plan import Plan, described
from rtctl.evaluation.metrics import write_json
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import refuse_foreign


class Store(NamedTuple):
    """Folder in which results are kept."""

    folder: Path

    def part(self, number: int) -> Path:
        """Return the file of a part."""
        return self.folder / "parts" / f"part-{number:06d}.parquet"

    def keep(self, number: int, content: bytes) -> None:
        """Write a part, whole or not at all."""
        with replacing(self.part(number)) as partial:
            partial.write_bytes(content)

    def missing(self, plan: Plan) -> list[int]:
        """Return the numbers of the parts that are not there yet."""
        kept = {path.name for path in self.folder.glob("parts/part-*.parquet")}
        return [number for number in range(plan.parts) if self.part(number).name not in kept]


def open_store(folder: Path, plan: Plan) -> Store:
    """Open the folder of this campaign, new or resumed.

    Raises InputError where it holds another campaign, or a file of another origin is in the way.
    """
    file = folder / "campaign.json"
    for name in (file.name, "summary.json", "campaign.png"):
        refuse_foreign(folder / name, "sweep")
    if file.is_file():
        found = json.loads(file.read_text(encoding="utf-8"))
        if found.get("fingerprint") != plan.fingerprint:
            raise InputError(
                f'--out {folder}: holds the results of another campaign, "{found.get("title")}" '
                f"(rtctl {found.get('version')}), or of this one before it was changed; name another folder"
            )
    elif any(folder.glob("parts/part-*.parquet")):
        raise InputError(f"--out {folder}: holds parts but no campaign.json; name another folder")
    else:
        write_json(file, described(plan), "sweep")
    return Store(folder)
