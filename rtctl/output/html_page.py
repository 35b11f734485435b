"""A self-contained HTML page, light and dark, without network: its style and the elements of a report."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from rtctl.output.own_files import mark_of

STYLE = """
:root { color-scheme: light dark; --ink: #1a1c1f; --dim: #5c636b; --paper: #ffffff; --card: #f5f6f8; --line: #dcdfe3;
  --good: #00734f; --bad: #b04a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8eaed; --dim: #a3abb4; --paper: #15171a; --card: #1f2226;
  --line: #363b41; --good: #4fc79b; --bad: #f39b5c; } }
* { box-sizing: border-box; }
.lead { font-size: 1.15rem; }
body { margin: 0 auto; max-width: 66rem; padding: 2rem 1.5rem 4rem; background: var(--paper); color: var(--ink);
  font: 1rem/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.75rem; line-height: 1.25; margin: .2rem 0 .6rem; }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .4rem; padding-top: .8rem; border-top: 1px solid var(--line); }
h2.part { font-size: 1.4rem; border-top: 2px solid var(--ink); } h3 { font-size: 1.05rem; margin: 1.8rem 0 .4rem; }
ul { margin: .4rem 0; padding-left: 1.3rem; } li { margin: .25rem 0; max-width: 50rem; }
p { margin: .4rem 0; max-width: 50rem; }
.dim, figcaption { color: var(--dim); } .small, figcaption { font-size: .9rem; }
.explained, .adequate { color: var(--good); } .unexplained, .partly_explained { color: var(--bad); }
.tiles { display: flex; flex-wrap: wrap; gap: .8rem; margin: 1.2rem 0; }
.tile { background: var(--card); border-radius: 10px; padding: .7rem 1rem; min-width: 9rem; flex: 1; }
.tile b { display: block; font-size: 1.45rem; line-height: 1.3; } .tile span { color: var(--dim); font-size: .85rem; }
table { border-collapse: collapse; margin: .8rem 0; width: 100%; font-size: .93rem; }
th, td { text-align: left; padding: .35rem .7rem .35rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
figure { margin: 1rem 0; } figure img { display: block; max-width: 100%; background: #fff; border-radius: 10px;
  padding: 6px; border: 1px solid var(--line); }
code { background: var(--card); padding: .05rem .3rem; border-radius: 4px; overflow-wrap: anywhere; }
.note { border-left: 4px solid var(--bad); background: var(--card); padding: .5rem .9rem; margin: .5rem 0; }
.scroll { overflow-x: auto; }
@page { size: A4; margin: 16mm 15mm 18mm; @bottom-right { content: counter(page) " / " counter(pages);
  font: 8pt sans-serif; color: #444; } }
@media print { :root { color-scheme: light; --ink: #000; --paper: #fff; --card: #f3f3f3; --line: #bbb; --dim: #444;
  --good: #00573c; --bad: #8a3a00; } html { font-size: 10pt; } body { max-width: none; padding: 0; }
  h1, h2, h3 { break-after: avoid; } h2.part { break-before: page; margin-top: 0; }
  figure, .tile, .note, tr, li { break-inside: avoid; } thead { display: table-header-group; }
  figure img { max-height: 175mm; margin: 0 auto; border: 0; padding: 0; } .scroll { overflow: visible; }
  td.n, th.n { white-space: normal; } p, li { orphans: 3; widows: 3; max-width: none; }
  details::details-content { content-visibility: visible; display: block; } }
"""


def page(title: str, parts: Sequence[str], command: str) -> str:
    """Return the whole file, which says that `command` wrote it."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="generator" content="{mark_of(command)}">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body>\n</html>\n"
    )


def table(headers: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Return a table of cells in HTML; columns in `numbers` are aligned right."""

    def line(cells: Sequence[str], tag: str) -> str:
        return (
            "<tr>"
            + "".join(
                f"<{tag}{' class=n' if k in numbers else ''}>{cell}</{tag}>" for k, cell in enumerate(cells)
            )
            + "</tr>"
        )

    body = "".join(line(row, "td") for row in rows)
    return (
        f'<div class="scroll"><table><thead>{line(headers, "th")}</thead><tbody>{body}</tbody></table></div>'
    )


def figure(source: str, alternative: str, caption: str, number: int) -> str:
    """Return a picture inside the page with its caption.

    Args:
        source: data address of the picture.
        alternative: text for those who cannot see it.
        caption: what to see in it, in HTML.
        number: number of the figure.
    """
    return (
        f'<figure><img alt="{escape(alternative)}" src="{source}">'
        f"<figcaption><b>Figure {number}.</b> {caption}</figcaption></figure>"
    )


def tile(value: str, what: str) -> str:
    """Return a tile with one number and what it is."""
    return f'<div class="tile"><b>{value}</b><span>{what}</span></div>'
