"""The report is one well-formed page that needs nothing from outside."""

import base64
import re
from html.parser import HTMLParser

import pytest

from jaxsat.report import Facts, Picture, Remarks, Table, page

PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(64))
VOID = {"meta", "link", "img"}


class Balance(HTMLParser):
    """Collects texts and fails on a tag that is not closed in order."""

    def __init__(self):
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture
def html() -> str:
    return page(
        "Fit of <a> & b",
        subtitle="epoch 2001-01-18",
        verdict="doubtful",
        verdict_text="Ambiguous.",
        message="two minima",
        sections=[
            Remarks("Warnings", ["chi2 is <null>"]),
            Facts("Fit", [("chi2", "101.5")]),
            Picture("Panel currents", PNG, 'six "panels"'),
            Table("Parameters", ("name", "value"), [("imax", "251.4")], (1,), note="in mA"),
            Table("Nothing here", ("a",), []),
            Remarks("Nor here", []),
            Facts("Nor there", []),
        ],
    )


def test_page_is_well_formed_and_complete(html):
    reader = Balance()
    reader.feed(html)
    assert reader.open == []
    text = " ".join(reader.texts)
    for expected in ("Fit of <a> & b", "Ambiguous.", "two minima", "chi2 is <null>", "101.5", "251.4", "in mA"):
        assert expected in text
    for absent in ("Nothing here", "Nor here", "Nor there"):
        assert absent not in text
    assert 'class="verdict doubtful"' in html and '<td class="number">251.4</td>' in html


def test_page_needs_nothing_from_outside(html):
    assert re.findall(r"(?:https?:)?//\S+", html) == []
    assert "<script" not in html and "@import" not in html
    assert all(target.startswith("data:") for target in re.findall(r'(?:src|href)="([^"]*)"', html))
    assert base64.b64encode(PNG).decode() in html


def test_page_serves_dark_screens_and_phones(html):
    assert "prefers-color-scheme: dark" in html and "color-scheme: light dark" in html
    assert 'name="viewport" content="width=device-width' in html and "max-width: 34rem" in html
