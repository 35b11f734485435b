"""A decimation that a file states beside its sample rate: nobody tells whether the rate is that before it or after."""

from __future__ import annotations

from collections.abc import Iterator

from rtctl.measured.readers.table import Table


def decimation_remarks(table: Table) -> Iterator[str]:
    """Yield a remark for each decimation that the columns of a file have beside a rate."""
    found = [one.decimation for one in table.columns.values() if one.decimation]
    rate = _rate(table)
    if not rate:
        return
    for text in dict.fromkeys(found):
        yield (
            f"the file states {text} beside its sample rate, {rate}, and not whether that is the rate before it or "
            "after: where no time column tells, it is taken as that of the rows; if the rows are of another one, say "
            "--sample-rate HZ --time - (sample_rate_hz in a manifest)"
        )


def _rate(table: Table) -> str:
    """Return the first rate that a file states, with its source; "": it states none."""
    stated = [(one.period_s, one.period_key) for one in table.columns.values() if one.period_s is not None]
    stated += [(one.period_s, one.key) for one in table.periods.values()]
    if table.preamble.period_s is not None:
        stated.append((table.preamble.period_s, f"by {table.preamble.source}"))
    return f"{1.0 / stated[0][0]:.6g} Hz {stated[0][1]}" if stated else ""
