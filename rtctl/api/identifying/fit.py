"""The result of an identification, the same for every kind of plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, Parameter
from rtctl.border.errors import InputError
from rtctl.extras import can_draw, require
from rtctl.output.notebook import html_table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtctl.models.derived.quantity import Derived


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Fit:
    """A model that was identified from a dataset, and how well it fits."""

    model: Model
    """With the provenance that its file will have."""
    dataset: str
    """Name of the dataset."""
    method: str
    """How it was fitted, in words."""
    residual_rms: Mapping[str, float]
    """RMS of what the model leaves of each output, on the records that were fitted."""
    units: Mapping[str, str]
    """Unit of each residual."""
    trusted: bool
    """Whether the model follows the data at all; if not, do not use it."""
    warnings: tuple[str, ...]
    """What the data do not determine, and what to do about it."""
    result: Any
    """The kind's own record of the fit."""
    derived: tuple[Derived, ...] = ()
    """What follows from the parameters in the terms of those who use the device, such as a natural frequency."""
    correction: str = ""
    """What to write in the manifest, to identify again, before the model is used; "": nothing."""
    _summary: Mapping[str, Any]
    _draw: Callable[[], Figure]

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters of the model with units and standard errors."""
        return self.model.parameters

    @property
    def path(self) -> Path | None:
        """The file of the model; None: it was not saved."""
        return self.model.source

    def __fspath__(self) -> str:
        """Return the model's file, so that a saved fit stands where a path of a model does.

        Raises:
            InputError: It was not saved.
        """
        if self.model.source is None:
            raise InputError("this fit was not saved: give its `.model`, or save it before")
        return str(self.model.source)

    def warn(self, text: str) -> Fit:
        """Return the fit with one more warning, before the others."""
        warnings = (text, *self.warnings)
        return replace(self, warnings=warnings, _summary={**self._summary, "warnings": list(warnings)})

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of the fit as the command line's `--json` prints them."""
        from rtctl.evaluation.metrics import finite

        derived = {"derived": [one.as_json() for one in self.derived]}
        content: dict[str, Any] = finite({**self._summary, **derived})
        return content

    def plot(self) -> Figure:
        """Return a figure of the model beside the data."""
        require("matplotlib", "Fit.plot")
        return self._draw()

    def save(self, path: PathText, *, plot: bool = False) -> Fit:
        """Write the model file and, with `plot`, a picture beside it.

        Returns:
            The fit whose `path` and `model.source` are the file; it stands wherever the path of a model does.
        """
        target = path_of("path", path)
        self.model.save(target)
        if plot and can_draw():
            from rtctl.plots.elements.style import save_png

            save_png(self.plot(), target.with_suffix(".png"), "identify")
        return replace(self, model=replace(self.model, source=Path(target)))

    def __repr__(self) -> str:
        rms = ", ".join(
            f"{name} {number(value, self.units[name])}" for name, value in self.residual_rms.items()
        )
        doubt = "" if self.trusted else ", NOT TRUSTED"
        return f"<Fit ({self.model.kind}) to {self.dataset}: residual RMS {rms}{doubt}>"

    def _repr_html_(self) -> str:
        rows = [
            [name, number(one.value), number(one.standard_error), one.unit]
            for name, one in self.parameters.items()
        ]
        rms = [
            f"{name}: residual {number(value, self.units[name])} RMS"
            for name, value in self.residual_rms.items()
        ]
        title = f"{self.dataset}: {self.method}"
        headers = ["parameter", "value", "standard error", "unit"]
        follows = [f"{name}: {text}" for name, text in (one.in_words() for one in self.derived)]
        return html_table(title, headers, rows, [*rms, *follows, *self.warnings])
