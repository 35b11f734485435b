"""What lies behind the figures: by effect, by noise, by size, by stated probability, by time; and every wrong case."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
from figures import as_baseline, separable
from further import resolved
from judge import NO_ANSWER
from rates import Line, Rate, markdown, rate

JUDGEMENTS = ("right", "set", "wide", "missed", "part", "false", *NO_ANSWER)
MISS_EDGES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, np.inf)
SHARE_EDGES = (0.0, 0.06, 0.1, 0.15, 0.2, 0.3, np.inf)
PROBABILITIES = (0.0, 0.5, 0.7, 0.9, 0.99, 1.01)
HIDDEN = ("single", "pair")


def details(lines: Sequence[Line], ambiguous: Sequence[Line]) -> str:
    """All tables under their headings."""
    parts = []
    for plant in ("oscillator", "vo2"):
        own = [line for line in lines if line["plant"] == plant]
        if own:
            parts += [f"## {plant}", *_of_plant(own)]
    parts += (
        ["## Baselines on the same oscillators", _baselines(lines)] if any("bic" in x for x in lines) else []
    )
    parts += ["## The next experiment", _next(ambiguous)] if any(x.get("next") for x in ambiguous) else []
    return "\n\n".join([*parts, "## Every case that is not right", _wrong(lines)])


def _of_plant(lines: Sequence[Line]) -> list[str]:
    nulls = [line for line in lines if line["kind"] == "null"]
    return [
        "### By what was hidden", _by_kind(lines),
        "### By effect (single ones)", _by_id(lines),
        "### What was answered", _confusion(lines),
        "### Nothing hidden, by noise", _by_noise(nulls),
        "### Miss of the re-fitted nominal model over the noise", _binned(lines, "miss_over_noise", MISS_EDGES),
        "### Share of the response that the effects make", _binned(lines, "share", SHARE_EDGES),
        "### Size of the set that a cause is told in (truth inside)", _sets(lines),
        "### Stated probabilities", calibration_table(lines),
        "### Processor time of the diagnosis", _times(lines),
    ]  # fmt: skip


def _counts(lines: Sequence[Line]) -> list[str]:
    counts = Counter(line["judgement"] for line in lines)
    return [str(counts[name] or "") for name in JUDGEMENTS]


def _by_kind(lines: Sequence[Line]) -> str:
    kinds = [
        (kind, [x for x in lines if x["kind"] == kind]) for kind in ("null", "single", "pair", "outside")
    ]
    return markdown(
        ("", "cases", *JUDGEMENTS), [(kind, str(len(ones)), *_counts(ones)) for kind, ones in kinds]
    )


def _by_id(lines: Sequence[Line]) -> str:
    rows = []
    for name in sorted({x["truth"][0] for x in lines if x["kind"] == "single"}):
        ones = [x for x in lines if x["kind"] == "single" and x["truth"] == [name]]
        misses = [x["miss_over_noise"] for x in ones]
        rows.append((f"`{name}`", str(len(ones)), *_counts(ones), f"{min(misses):.2g} to {max(misses):.2g}"))
    return markdown(("effect", "cases", *JUDGEMENTS, "miss over noise"), rows)


def answer(line: Line) -> str:
    """In short: names, those that could stand for them in brackets; the verdict where there are none."""
    names = [
        f"`{one['id']}`" + (f" (or {', '.join(one['or'])})" if one["or"] else "") for one in line["causes"]
    ]
    partly = " (partly)" if line["verdict"] == "partly_explained" else ""
    return " + ".join(sorted(names)) + partly if names else line["verdict"]


def _truth(line: Line) -> str:
    names = line["variant"] if line["kind"] == "outside" else line["truth"]
    return " + ".join(sorted(f"`{name}`" for name in names)) or "nothing"


def _confusion(lines: Sequence[Line]) -> str:
    found: dict[tuple[str, str], Counter[str]] = {}
    order = {"null": 0, "single": 1, "outside": 2, "pair": 3}
    for line in sorted(lines, key=lambda x: (order[x["kind"]], _truth(x))):
        found.setdefault((line["kind"], _truth(line)), Counter())[answer(line)] += 1
    rows = [
        (kind, truth, ", ".join(f"{name} {count}" for name, count in counts.most_common()))
        for (kind, truth), counts in found.items()
    ]
    return markdown(("", "truth", "answers, with how many"), rows)


def _by_noise(nulls: Sequence[Line]) -> str:
    kinds = sorted({x["noise"] for x in nulls})
    rows = [
        (kind, str(rate([x for x in nulls if x["noise"] == kind], lambda x: x["judgement"] != "right")))
        for kind in kinds
    ]
    return markdown(("noise", "something said to be wrong"), rows)


def _binned(lines: Sequence[Line], key: str, edges: Sequence[float]) -> str:
    rows = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        ones = [x for x in lines if x["kind"] in HIDDEN and low <= x[key] < high]
        if ones:
            good = rate(ones, lambda x: x["judgement"] in ("right", "set"))
            unseen = rate(ones, lambda x: x["verdict"] in ("adequate", *NO_ANSWER))
            wrong = rate(ones, lambda x: x["judgement"] == "false")
            rows.append((f"{low:g} to {high:g}", *map(str, (good, unseen, wrong)), *_counts(ones)))
    return markdown(("", "right", "nothing seen", "something false", *JUDGEMENTS), rows)


def hits(lines: Sequence[Line]) -> list[tuple[float, float, Rate]]:
    """(least, largest) miss over noise of each bin that has cases, and the rate of right answers."""
    found = []
    for low, high in zip(MISS_EDGES[:-1], MISS_EDGES[1:], strict=True):
        ones = [x for x in lines if x["kind"] in HIDDEN and low <= x["miss_over_noise"] < high]
        if ones:
            misses = [x["miss_over_noise"] for x in ones]
            good = rate(ones, lambda x: x["judgement"] in ("right", "set"))
            found.append((min(misses), max(misses), good))
    return found


def _sets(lines: Sequence[Line]) -> str:
    sizes: dict[int, list[bool]] = {}
    for line in lines:
        for one in line["causes"]:
            if not one["id"].startswith("parameter."):
                inside = bool({one["id"], *one["or"]} & {*line["truth"], *line["equivalent"]})
                sizes.setdefault(1 + len(one["or"]), []).append(inside)
    rows = [(str(size), str(Rate(sum(ones), len(ones)))) for size, ones in sorted(sizes.items())]
    return markdown(("names", "causes with the truth inside"), rows)


def calibration(lines: Sequence[Line]) -> list[tuple[float, Rate]]:
    """(mean stated probability, rate of true ones) of the causes that have one, by bins of the stated probability."""
    claims = [
        (float(one["probability"]), one["id"] in line["truth"] or one["id"] in line["equivalent"])
        for line in lines for one in line["causes"]
        if not one["id"].startswith("parameter.") and one["probability"] is not None
    ]  # fmt: skip
    found = []
    for low, high in zip(PROBABILITIES[:-1], PROBABILITIES[1:], strict=True):
        ones = [(stated, true) for stated, true in claims if low <= stated < high]
        if ones:
            stated = float(np.mean([one[0] for one in ones]))
            found.append((stated, Rate(sum(one[1] for one in ones), len(ones))))
    return found


def calibration_table(lines: Sequence[Line]) -> str:
    """Stated beside found."""
    rows = [(f"{stated:.3f}", str(true)) for stated, true in calibration(lines)]
    return markdown(("stated, mean", "true"), rows)


def _times(lines: Sequence[Line]) -> str:
    groups: list[tuple[str, Callable[[Line], bool]]] = [
        *((name, lambda x, n=name: x["judgement"] == n) for name in JUDGEMENTS),
        *((f"{k} records or more", lambda x, k=k: x["fit_records"] >= k) for k in (3, 4, 5)),
    ]
    rows = []
    for name, belongs in groups:
        times = [x["cpu_s"] for x in lines if "cpu_s" in x and belongs(x)]
        if times:
            middle, late = np.percentile(times, [50, 90])
            rows.append((name, str(len(times)), f"{middle:.1f} s", f"{late:.1f} s", f"{max(times):.1f} s"))
    return markdown(("", "cases", "median", "nine of ten", "worst"), rows)


def _baselines(lines: Sequence[Line]) -> str:
    rows = []
    for kind in ("null", "single", "pair", "outside"):
        for way in ("rtctl diagnose", "bic", "sindy"):
            ones = [
                x if way == "rtctl diagnose" else as_baseline(x, way)
                for x in lines
                if x["kind"] == kind and x["plant"] == "oscillator" and "bic" in x and "sindy" in x
            ]
            if ones:
                names = {"bic": "lowest BIC alone", "sindy": "discrepancy-SINDy"}
                rows.append((kind, names.get(way, way), str(len(ones)), *_counts(ones)))
    return markdown(("", "", "cases", *JUDGEMENTS), rows)


def _next(ambiguous: Sequence[Line]) -> str:
    rows = []
    for line in sorted(ambiguous, key=lambda x: (x["plant"], x["seed"])):
        after = line.get("next")
        if not after or "proposed" not in after:
            continue
        rows.append((
            f"{line['plant']} {line['seed']}", _truth(line), ", ".join(after["names"]),
            "yes" if separable(line) else "no", f"{after.get('separation', np.nan):.3g}",
            f"{_outcome(line, 'proposed')}: {after['proposed']['input']}", _outcome(line, "random"),
        ))  # fmt: skip
    head = (
        "case",
        "truth",
        "names left",
        "counted",
        "told separation",
        "after what was proposed",
        "after as many random records",
    )
    return markdown(head, rows)


def _outcome(line: Line, which: str) -> str:
    return "resolved" if resolved(line, which) else answer(line["next"][which])


def _wrong(lines: Sequence[Line]) -> str:
    rows = [
        (f"{x['plant']} {x['seed']}", x["judgement"], _truth(x), answer(x), f"{x['miss_over_noise']:.2g}",
         x["noise"], _last(x.get("error", "")))
        for x in sorted(lines, key=lambda x: (x["plant"], x["seed"])) if x["judgement"] not in ("right", "set")
    ]  # fmt: skip
    return markdown(("case", "", "truth", "answer", "miss over noise", "noise", "error"), rows)


def _last(text: str) -> str:
    return text.strip().splitlines()[-1].replace("|", "/")[:120] if text.strip() else ""
