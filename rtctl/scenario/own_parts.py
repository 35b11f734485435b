"""Tables of parts that the user brings: any registered name or "module:Class" as `kind`, the other keys are options."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import ConfigDict, Discriminator, field_validator, model_validator

from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import Checked
from rtctl.registry import Entry, Part, find, names
from rtctl.registry.building import option_findings

OFFERED = frozenset({"setup", "profile", "folder"})
"""Arguments of a constructor that the program fills in; see `rtctl.interfaces.Setup`."""


class OwnPart(Checked):
    """A table whose `kind` is a part of the user."""

    model_config = ConfigDict(extra="allow", frozen=True)
    union_tag: ClassVar[str] = "own"
    part: ClassVar[Part]

    kind: str

    @property
    def options(self) -> dict[str, Any]:
        """All keys but `kind`."""
        return dict(self.model_extra or {})

    @property
    def entry(self) -> Entry:
        """The registered part. Raises InputError."""
        return find(self.part, self.kind, f"{self.part}.kind")

    @field_validator("kind")
    @classmethod
    def _known(cls, kind: str) -> str:
        if ":" not in kind and kind not in names(cls.part):
            raise ValueError(f'unknown kind "{kind}"{nearest(kind, names(cls.part))}')
        return kind

    @model_validator(mode="after")
    def _takes_options(self) -> OwnPart:
        try:
            findings = option_findings(self.entry, self.options, OFFERED)
        except InputError as error:
            raise ValueError(str(error)) from None
        if findings:
            raise ValueError("; ".join(findings))
        return self


class OwnDriver(OwnPart):
    """[driver] with a driver of the user."""

    part = "driver"


class OwnEstimator(OwnPart):
    """[estimator] with an estimator of the user."""

    part = "estimator"


class OwnController(OwnPart):
    """[controller] with a controller of the user."""

    part = "controller"


def chosen_by_kind(*tags: str) -> Any:
    """Return the discriminator of a union of tables: by `kind` among ours (`tags`), else the user's."""

    def tag_of(table: Any) -> str | None:
        if not isinstance(table, dict | Checked):
            return tags[0]  # no table at all: a finding of any member
        kind = table.get("kind") if isinstance(table, dict) else getattr(table, "kind", None)
        if kind is None:
            return None
        return kind if kind in tags else OwnPart.union_tag

    return Discriminator(tag_of)
