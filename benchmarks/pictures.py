"""The pictures of the documentation, from one run of the main job: `python benchmarks/pictures.py`."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

from rtctl.identification.vo2.staircase import extract_steady_states
from rtctl.measured.dataset import Dataset
from rtctl.measured.reading import read_dataset
from rtctl.plots import plot_hysteresis, plot_scenarios
from rtctl.session.demo import demonstrate

ROOT = Path(__file__).resolve().parent.parent
PICTURES, RUN = ROOT / "docs" / "pictures", ROOT / "out" / "pictures"


def main() -> None:
    """Run the demonstration (seed 2) and draw."""
    summaries = demonstrate("vo2_a", 2, RUN, lambda: False, lambda text: print(text, file=sys.stderr))
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in ("steps", "multisine_1_10hz", "random_staircase"):
        shutil.copy(RUN / name / "run.png", PICTURES / f"{name}.png")
    dataset = read_dataset(RUN / "dataset" / "dataset.toml")
    damped = Dataset(
        path=dataset.path, name=dataset.name, plant=dataset.plant, identity=dataset.identity, units=dataset.units,
        holds=dataset.holds, records=dataset.records[:1],
    )  # fmt: skip
    ends = extract_steady_states(damped)
    plot_hysteresis(
        PICTURES / "hysteresis.png",
        ends.current_mA[ends.scored],
        ends.resistance_ohm[ends.scored],
        ends.deflection_um[ends.scored],
        title="Simulated device A under the damped oscillation of the paper's figure 4",
    )
    plot_scenarios(PICTURES / "scenarios.png", [_bar(summary) for summary in summaries])
    print(
        json.dumps(
            {summary["scenario"]: _bar(summary)[1] for summary in summaries}, indent=2, ensure_ascii=False
        )
    )


def _bar(summary: dict[str, object]) -> tuple[str, float | None, float | None]:
    tracking, sensing, paper = (dict(summary[key]) for key in ("tracking", "self_sensing", "paper"))  # type: ignore[call-overload]
    kind, errors = (
        ("self_sensing", sensing) if tracking["mean_abs_percent"] is None else ("tracking", tracking)
    )
    return str(summary["scenario"]), errors["mean_abs_percent"], paper.get(f"{kind}_mean")


if __name__ == "__main__":
    main()
