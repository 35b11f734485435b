"""The campaign that is reported: its size, its order, and its rows."""

from __future__ import annotations

from collections import Counter
from typing import Any

import foreign_campaign
import foreign_final


def case(
    outcome: str, effect: str | None = "drive.lag", second: str | None = None, **more: Any
) -> dict[str, Any]:
    return {
        "style": "mems", "seed": 1, "effect": effect, "second": second, "groups": ["read at the start"],
        "outcome": outcome, "probability": None, "identify_s": 1.0, "diagnose_s": 9.0, **more,
    }  # fmt: skip


def test_it_has_120_oscillators_and_60_actuators_of_styles_that_there_are() -> None:
    cases = list(foreign_final.order())
    assert Counter(part.kind for part, _ in cases) == {"oscillator": 120, "vo2": 60}
    assert len({(part.style, seed) for part, seed in cases}) == 180
    for part in foreign_final.PARTS:
        kind = foreign_campaign.KINDS[part.kind]
        assert part.style in (*kind.styles, *kind.others)


def test_a_campaign_that_is_stopped_has_done_its_share_of_every_style() -> None:
    done = Counter(part.style for part, _ in list(foreign_final.order())[:60])
    for part in foreign_final.PARTS:
        assert abs(done[part.style] - part.cases / 3) <= 1


def test_a_row_counts_nulls_singles_and_pairs_apart() -> None:
    cases = [
        case("right"), case("wrong"), case("missed"), case("right", None), case("right", second="sensor.lag"),
        case("partly", second="sensor.lag"), case("wrong", second="sensor.lag"),
    ]  # fmt: skip
    cells = foreign_final.row("x", cases)
    assert cells[:2] == ["x", "7"]
    assert cells[2].startswith("1 of 1 (")
    assert cells[3].startswith("1 of 3 (")
    assert cells[4].startswith("1 of 4 ("), "a wrong name beside a second effect is counted with the pairs"
    assert cells[5].startswith("1 of 3 (")
    assert cells[5].endswith("; 0; 1")
    assert cells[6] == "10, 10"


def test_stated_probabilities_are_held_against_what_was_true() -> None:
    told = [
        case("right", probability=0.999),
        case("wrong", probability=0.995),
        case("right", probability=0.7),
    ]
    lines = foreign_final.calibration(told)
    assert [line.split(" | ")[1] for line in lines[2:]] == ["1", "2"]
    assert "1 of 2" in lines[-1]
