"""A report as one HTML file: pictures and script inside it, no network, light and dark, from a phone's width on.

Everything but the turning of pictures is there without the script. The page's own policy forbids any other.
"""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any, Literal

from jaxsat.report.sections import Section, sections_html

Verdict = Literal["good", "doubtful", "bad", "plain"]
"""The last is that of what is shown and not judged."""


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
    body = sections_html(sections)
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
