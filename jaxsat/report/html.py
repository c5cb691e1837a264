"""A report as one HTML file: pictures inside it, no script, no network, light and dark, from a phone's width on."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal

Verdict = Literal["good", "doubtful", "bad"]


@dataclass(frozen=True)
class Facts:
    """A heading and (what, value) lines."""

    heading: str
    lines: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Table:
    """A heading, column names and rows of text; `numbers` are the columns aligned at the right."""

    heading: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A PNG with its heading; `alt` says in words what it shows."""

    heading: str
    png: bytes
    alt: str


@dataclass(frozen=True)
class Remarks:
    """A heading and sentences that the reader must not miss."""

    heading: str
    lines: Sequence[str]


Section = Facts | Table | Picture | Remarks


def page(
    title: str, *, subtitle: str, verdict: Verdict, verdict_text: str, message: str, sections: Sequence[Section]
) -> str:
    """Returns the HTML text. Every text is escaped; an empty table or list leaves no trace."""
    body = "\n".join(part for part in map(_section, sections) if part)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<link rel="icon" href="data:,">
<style>{_STYLE}</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
<p class="subtitle">{escape(subtitle)}</p>
<p class="verdict {verdict}"><strong>{escape(verdict_text)}</strong> {escape(message)}</p>
</header>
<main>
{body}
</main>
</body>
</html>
"""


def _section(section: Section) -> str:
    match section:
        case Facts(lines=[]) | Table(rows=[]) | Remarks(lines=[]):
            return ""
        case Facts(heading, lines):
            items = "\n".join(f"<dt>{escape(what)}</dt><dd>{escape(value)}</dd>" for what, value in lines)
            content = f"<dl>\n{items}\n</dl>"
        case Table():
            heading, content = section.heading, _table(section)
        case Picture(heading, png, alt):
            data = base64.b64encode(png).decode("ascii")
            content = f'<figure><img src="data:image/png;base64,{data}" alt="{escape(alt)}"></figure>'
        case Remarks(heading, lines):
            items = "\n".join(f"<li>{escape(line)}</li>" for line in lines)
            content = f'<ul class="remarks">\n{items}\n</ul>'
    return f"<section>\n<h2>{escape(heading)}</h2>\n{content}\n</section>"


def _table(table: Table) -> str:
    def cells(tag: str, texts: Sequence[str]) -> str:
        classes = (' class="number"' if column in table.numbers else "" for column in range(len(texts)))
        return "".join(f"<{tag}{kind}>{escape(text)}</{tag}>" for kind, text in zip(classes, texts, strict=True))

    rows = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in table.rows)
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    # The frame scrolls by itself, as a picture's does, so that a wide table never widens a phone's page.
    return (
        f'<div class="scroll"><table>\n<thead><tr>{cells("th", table.columns)}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody>\n</table></div>{note}"
    )


_STYLE = """
:root { color-scheme: light dark; --ink: #1d2129; --soft: #5b6270; --line: #d9dde4; --paper: #ffffff; --card: #f6f7f9;
  --good: #1f7a3a; --doubtful: #9a6700; --bad: #b42318; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8ec; --soft: #9aa3b2; --line: #363c47; --paper: #15181d;
  --card: #1e2229; --good: #5cc97f; --doubtful: #e3b341; --bad: #ff7b72; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.25rem 1rem 3rem; max-width: 72rem; color: var(--ink); background: var(--paper);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; margin: 0 0 .1rem; } h2 { font-size: 1.05rem; margin: 2rem 0 .6rem; }
.subtitle, .note, dt { color: var(--soft); } .subtitle { margin: 0 0 .9rem; } .note { margin: .4rem 0 0; }
.verdict { margin: 0; padding: .6rem .8rem; background: var(--card); border-left: 4px solid var(--soft); }
.verdict.good { border-color: var(--good); } .verdict.good strong { color: var(--good); }
.verdict.doubtful { border-color: var(--doubtful); } .verdict.doubtful strong { color: var(--doubtful); }
.verdict.bad { border-color: var(--bad); } .verdict.bad strong { color: var(--bad); }
.scroll, figure { margin: 0; overflow-x: auto; }
img { display: block; max-width: 100%; min-width: 40rem; height: auto; border-radius: 4px; background: #ffffff; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .22rem 1rem .22rem 0; text-align: left; white-space: nowrap; border-bottom: 1px solid var(--line); }
td:last-child { white-space: normal; min-width: 8rem; } th { color: var(--soft); font-weight: 600; }
.number { text-align: right; }
dl { display: grid; grid-template-columns: minmax(8rem, max-content) 1fr; gap: .2rem 1rem; margin: 0; }
dd { margin: 0; }
.remarks { margin: 0; padding-left: 1.2rem; } .remarks li::marker { color: var(--doubtful); }
@media (max-width: 34rem) { dl { grid-template-columns: 1fr; gap: 0; } dd { margin-bottom: .5rem; } }
@media print { body { max-width: none; } section { break-inside: avoid; } }
"""
