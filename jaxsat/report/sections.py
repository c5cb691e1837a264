"""The parts of a report: what each holds, and its HTML. Every text is escaped; what is empty leaves no trace."""

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

LONG = 34
"""Characters from which on a cell of words may be broken into lines."""


@dataclass(frozen=True)
class Facts:
    """A heading and (what, value) lines."""

    heading: str
    lines: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class KeyNumbers:
    """A heading and (what, value, a few words on it): the numbers that a reader looks for first."""

    heading: str
    lines: Sequence[tuple[str, str, str]]


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
class Link:
    """A file beside the page, by its address from the page, and what it holds."""

    href: str
    text: str


@dataclass(frozen=True)
class Live:
    """A place that the script fills, by `name` (those of page/main.js), with its picture for whoever has no script.

    Without a picture nothing is seen of it before the script runs. `files` hold what it shows.
    """

    name: str
    heading: str
    picture: Picture | None = None
    files: Sequence[Link] = ()


@dataclass(frozen=True)
class Remarks:
    """A heading and sentences that the reader must not miss."""

    heading: str
    lines: Sequence[str]


@dataclass(frozen=True)
class Contents:
    """Links to all other parts of the page, and to files beside it."""

    heading: str
    files: Sequence[Link] = ()


@dataclass(frozen=True)
class Folded:
    """A part that is opened by whoever wants it."""

    part: Facts | Table


@dataclass(frozen=True)
class Lead:
    """What comes first: two columns where there is room for them."""

    left: Sequence["Section"]
    right: Sequence["Section"]


Section = Facts | KeyNumbers | Table | Picture | Live | Remarks | Contents | Folded | Lead


def sentence(text: str) -> str:
    """With a capital letter, but for the name of a file, and a full stop."""
    begin = text[:1] if ":" in text.split(" ")[0] else text[:1].upper()
    return f"{begin}{text[1:]}".rstrip(".") + "."


def sections_html(sections: Sequence[Section]) -> str:
    """Returns the HTML of all parts."""
    told = [one for one in _flat(sections) if not _is_empty(one)]
    return "\n".join(part for part in (_section(one, told) for one in sections) if part)


def _flat(sections: Sequence[Section]) -> list[Section]:
    """Without the columns that they stand in."""
    return [each for one in sections for each in (_flat([*one.left, *one.right]) if isinstance(one, Lead) else [one])]


def _is_empty(section: Section) -> bool:
    match section:
        case Facts(lines=[]) | KeyNumbers(lines=[]) | Table(rows=[]) | Remarks(lines=[]):
            return True
        case Folded(part):
            return _is_empty(part)
    return False


def _anchor(heading: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", heading.lower()).strip("-")


def _section(section: Section, told: Sequence[Section]) -> str:
    if _is_empty(section):
        return ""
    match section:
        case Lead(left, right):
            columns = ("\n".join(filter(None, (_section(one, told) for one in column))) for column in (left, right))
            return '<div class="lead">\n' + "\n".join(f"<div>\n{column}\n</div>" for column in columns) + "\n</div>"
        case Facts(heading, lines):
            content = _facts(lines)
        case KeyNumbers(heading, lines):
            items = "\n".join(
                f"<div><dt>{escape(what)}</dt><dd>{escape(value)}</dd><dd class='note'>{escape(words)}</dd></div>"
                for what, value, words in lines
            )
            content = f'<dl class="key-numbers">\n{items}\n</dl>'
        case Table():
            heading, content = section.heading, _table(section)
        case Picture(heading):
            content = _figure(section)
        case Live():
            return _live(section)
        case Remarks(heading, lines):
            items = "\n".join(f"<li>{escape(line)}</li>" for line in lines)
            content = f'<ul class="remarks">\n{items}\n</ul>'
        case Contents(heading, files):
            return _contents(heading, [one for one in told if one is not section], files)
        case Folded(part):
            content = _facts(part.lines) if isinstance(part, Facts) else _table(part)
            head = f'<details class="folded"><summary><h2>{escape(part.heading)}</h2></summary>'
            return f'<section id="{_anchor(part.heading)}">\n{head}\n{content}\n</details>\n</section>'
    return f'<section id="{_anchor(heading)}">\n<h2>{escape(heading)}</h2>\n{content}\n</section>'


def _facts(lines: Sequence[tuple[str, str]]) -> str:
    items = "\n".join(f"<dt>{escape(what)}</dt><dd>{escape(value)}</dd>" for what, value in lines)
    return f"<dl>\n{items}\n</dl>"


def _live(live: Live) -> str:
    # Open until the script has put something better in its place.
    still = f"<details open><summary>PNG</summary>{_figure(live.picture)}</details>" if live.picture else ""
    hidden = "" if live.picture else " hidden"
    files = f'<p class="note files">{", ".join(map(_link, live.files))}</p>\n' if live.files else ""
    place = f'<section id="{_anchor(live.heading)}" data-live="{escape(live.name)}"{hidden}>'
    return f"{place}\n<h2>{escape(live.heading)}</h2>\n{files}{still}\n</section>"


def _link(link: Link) -> str:
    return f'<a href="{escape(link.href)}">{escape(link.text)}</a>'


def _contents(heading: str, sections: Sequence[Section], files: Sequence[Link]) -> str:
    """A part that only the script shows is listed by the script too."""
    items = []
    for one in sections:
        name = one.part.heading if isinstance(one, Folded) else getattr(one, "heading", "")
        waits = " hidden" if isinstance(one, Live) and one.picture is None else ""
        items.append(f'<li{waits}><a href="#{_anchor(name)}">{escape(name)}</a></li>')
    beside = "".join(f"<li>{_link(link)}</li>" for link in files)
    rows = f"<ul>{''.join(items)}</ul>" + (f"\n<h3>Files beside this page</h3>\n<ul>{beside}</ul>" if files else "")
    return f'<nav class="contents" aria-label="{escape(heading)}">\n<h2>{escape(heading)}</h2>\n{rows}\n</nav>'


def _figure(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode("ascii")
    return f'<figure><img src="data:image/png;base64,{data}" alt="{escape(picture.alt)}"></figure>'


def _table(table: Table) -> str:
    def cell(tag: str, column: int, text: str) -> str:
        kind = "number" if column in table.numbers else "long" if tag == "td" and len(text) > LONG else ""
        scope = ' scope="col"' if tag == "th" else ""
        return f"<{tag}{scope}" + (f' class="{kind}"' if kind else "") + f">{escape(text)}</{tag}>"

    def cells(tag: str, texts: Sequence[str]) -> str:
        return "".join(cell(tag, column, text) for column, text in enumerate(texts))

    rows = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in table.rows)
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    # The frame scrolls by itself, as a picture's does, so that a wide table never widens a phone's page.
    return (
        f'<div class="scroll"><table>\n<thead><tr>{cells("th", table.columns)}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody>\n</table></div>{note}"
    )
