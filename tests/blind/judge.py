"""What an answer is worth, by the truth: one word a case."""

from __future__ import annotations

from typing import Any

NO_ANSWER = ("crash", "timeout")
"""Verdicts that the campaign gives: the program gave none."""


def judged(line: dict[str, Any]) -> str:
    """right | set (right within two names) | missed | part | false | wide (more than two names) | crash | timeout.

    Of a line's `kind`, `truth`, `equivalent` (ids that describe the same outputs by construction), `verdict` and
    `causes` with `id` and `or`. Nothing hidden: right where nothing is said to be wrong but values of parameters, which
    the cases' model files do have wrong.
    """
    if line["verdict"] in NO_ANSWER:
        return str(line["verdict"])
    truth, same = set(line["truth"]), set(line["equivalent"])
    causes = [one for one in line["causes"] if not one["id"].startswith("parameter.")]
    names = {one["id"] for one in causes}
    if line["kind"] == "null":
        only_values = line["verdict"] == "explained" and bool(line["causes"])
        return "right" if not names and (line["verdict"] == "adequate" or only_values) else "false"
    if line["kind"] == "outside":
        return "right" if names <= same else "false"
    if not names:
        return "missed"
    if any(len(one["or"]) > 1 for one in causes):
        return "wide"
    if names == truth:
        return "right"
    if len(names) == len(truth) and _up_to_equivalents(causes, truth, same):
        return "set"
    return "part" if names < truth else "false"


def single_and_right(line: dict[str, Any]) -> bool:
    """Whether the truth is named with nothing beside it."""
    return judged(line) == "right" and not any(one["or"] for one in line["causes"])


def wrong_alone(line: dict[str, Any]) -> bool:
    """Whether one name is claimed, with no other beside it, and is false."""
    names = [one for one in line["causes"] if not one["id"].startswith("parameter.")]
    return judged(line) == "false" and len(names) == 1 and not names[0]["or"]


def _up_to_equivalents(causes: list[dict[str, Any]], truth: set[str], same: set[str]) -> bool:
    """Each effect is named, or stands beside a name, or is one that describes the same outputs."""
    left = set(truth)
    for one in causes:
        hit = left & {one["id"], *one["or"]}
        if hit:
            left -= {hit.pop()}
        elif one["id"] not in same:
            return False
    return not left or len(left) == sum(one["id"] in same for one in causes)
