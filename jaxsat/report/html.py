"""A report as one HTML file: pictures and script inside it, no network, light and dark, from a phone's width on.

Everything but the turning of pictures is there without the script. The page's own policy forbids any other.
"""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any, Literal

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
class Live:
    """A place that the script fills, by `name` (those of page/main.js), with its picture for whoever has no script.

    Without a picture nothing is seen of it before the script runs.
    """

    name: str
    heading: str
    picture: Picture | None = None


@dataclass(frozen=True)
class Remarks:
    """A heading and sentences that the reader must not miss."""

    heading: str
    lines: Sequence[str]


Section = Facts | Table | Picture | Live | Remarks


def page(
    title: str,
    *,
    subtitle: str,
    verdict: Verdict,
    verdict_text: str,
    message: str,
    sections: Sequence[Section],
    data: Mapping[str, Any] | None = None,
    script: Literal["page", "search", "sweep"] = "page",
) -> str:
    """Returns the HTML text. Every text is escaped; an empty table or list leaves no trace.

    `data` is what the script draws `Live` sections from, JSON without numbers that are not finite; without it the page
    has no script at all. `script`: `page` is that of a fit's report, `search` that of an Earth search, `sweep`
    that of a sweep.
    """
    body = "\n".join(part for part in map(_section, sections) if part)
    style, bundle = _asset("page/page.css"), "" if data is None else _asset(f"{script}.bundle.js")
    allowed = f"script-src {_digest(bundle)}; " if bundle else ""
    policy = f"default-src 'none'; {allowed}style-src {_digest(style)}; img-src data: blob:; base-uri 'none'"
    code = f'\n<script type="application/json" id="data">{_inert(data)}</script>\n<script>{bundle}</script>'
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<link rel="icon" href="data:,">
<style>{style}</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
<p class="subtitle">{escape(subtitle)}</p>
<p class="verdict {verdict}"><strong>{escape(verdict_text)}</strong> {escape(message)}</p>
</header>
<main>
{body}
</main>{code if bundle else ""}
</body>
</html>
"""


@cache
def _asset(name: str) -> str:
    return files("jaxsat.report").joinpath(name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}'"


def _inert(data: Mapping[str, Any] | None) -> str:
    """JSON in which no text can end the block, or begin a comment, whatever it says."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _section(section: Section) -> str:
    match section:
        case Facts(lines=[]) | Table(rows=[]) | Remarks(lines=[]):
            return ""
        case Facts(heading, lines):
            items = "\n".join(f"<dt>{escape(what)}</dt><dd>{escape(value)}</dd>" for what, value in lines)
            content = f"<dl>\n{items}\n</dl>"
        case Table():
            heading, content = section.heading, _table(section)
        case Picture(heading):
            content = _figure(section)
        case Live(name, heading, picture):
            # Open until the script has put something better in its place.
            still = f"<details open><summary>PNG</summary>{_figure(picture)}</details>" if picture else ""
            hidden = "" if picture else " hidden"
            return f'<section data-live="{escape(name)}"{hidden}>\n<h2>{escape(heading)}</h2>\n{still}\n</section>'
        case Remarks(heading, lines):
            items = "\n".join(f"<li>{escape(line)}</li>" for line in lines)
            content = f'<ul class="remarks">\n{items}\n</ul>'
    return f"<section>\n<h2>{escape(heading)}</h2>\n{content}\n</section>"


def _figure(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode("ascii")
    return f'<figure><img src="data:image/png;base64,{data}" alt="{escape(picture.alt)}"></figure>'


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
