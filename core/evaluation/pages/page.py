"""The one template of all pages: a heading, a few words, tables and figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from string import Template

from ...printing import in_html


def page_of(heading: str, body: str) -> str:
    """Return an HTML document.

    Parameters
    ----------
    heading : str
        As it is to be read.
    body : str
        HTML.
    """
    return TEMPLATE.substitute(heading=in_html(heading), body=body)


def figure_tags(pictures: Iterable[tuple[str, str]]) -> str:
    """Return files and their captions as figures, side by side."""
    return "\n".join(
        f'<figure><img src="{in_html(file)}" alt="{in_html(caption)}">'
        f"<figcaption>{in_html(caption)}</figcaption></figure>"
        for file, caption in pictures
    )


def rows_table(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return labels and texts as a table of two columns."""
    lines = "".join(
        f"<tr><th>{in_html(label)}</th><td>{in_html(text)}</td></tr>" for label, text in rows
    )
    return f"<table><caption>{in_html(caption)}</caption>{lines}</table>"


def columns_table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return rows below titles as a table; in a row of fewer cells the last reaches to the end."""
    head = "".join(f"<th>{in_html(title)}</th>" for title in titles)
    lines = []
    for row in rows:
        *cells, last = (in_html(text) for text in row)
        reach = len(titles) - len(cells)
        span = f" colspan={reach}" if reach > 1 else ""
        lines.append("".join(f"<td>{text}</td>" for text in cells) + f"<td{span}>{last}</td>")
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<table class="columns"><tr>{head}</tr>{body}</table>'


TEMPLATE = Template("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>AccelScope</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 110rem;
  padding: 0 1.5rem; color: #222; background: #fff; }
h1 { font-weight: 600; } h2 { margin: 2.5rem 0 0; font-weight: 600; }
h3 { margin: 1.2rem 0 0; font-weight: 600; font-size: 1rem; }
p { margin: .2rem 0 .8rem; color: #666; font-size: .85rem; } .failed { color: #b3261e; }
.row { display: flex; flex-wrap: wrap; gap: 1.2rem; align-items: flex-start; }
figure { margin: 0; max-width: 29rem; }
img { width: 29rem; max-width: 100%; border: 1px solid #ddd; display: block; }
.wide figure { max-width: 36rem; } .wide img { width: 36rem; }
.frames { display: grid; grid-template-columns: repeat(4, minmax(0, 1fr)); gap: 1.2rem; }
.frames img { width: 100%; } .two { max-width: 72rem;
  grid-template-columns: repeat(2, minmax(0, 1fr)); } .two figure { max-width: none; }
.slide { text-transform: none; font-weight: 600; } .begin { color: #222; font-size: 1rem; }
.lesson p { max-width: 60rem; } figure.lesson, figure.lesson img { width: 40rem;
  max-width: 100%; } input[type=range] { width: 24rem; vertical-align: middle; }
summary { cursor: pointer; } .contents { columns: 2; padding-left: 1.2rem; font-size: .9rem; }
small { color: #666; }
@media print { @page { size: A4; margin: 14mm; } body { margin: 0; padding: 0; font-size: 11pt; }
  .lesson { break-before: page; } figure { break-inside: avoid; }
  details::details-content { content-visibility: visible; display: block; } }
figcaption { color: #666; font-size: .85rem; margin-top: .3rem; }
.tables { display: flex; flex-wrap: wrap; gap: 1.5rem; align-items: flex-start; }
table { border-collapse: collapse; font-size: .85rem; } caption { text-align: left;
  font-weight: 600; padding-bottom: .3rem; }
th { text-align: left; font-weight: 400; padding: .1rem 1.2rem .1rem 0; color: #555; }
td { text-align: right; font-variant-numeric: tabular-nums; }
.columns { margin: 1rem 0 1.5rem; } .columns th { font-weight: 600; text-align: right; }
.columns td { padding: .15rem 1.2rem .15rem 0; }
.columns td:first-child, .columns th:first-child { text-align: left; }
</style></head><body><h1>$heading</h1>
$body
</body></html>
""")
