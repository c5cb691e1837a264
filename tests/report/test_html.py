"""The report is one well-formed page that needs nothing from outside."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import pytest

from jaxsat.report import Contents, Facts, Folded, KeyNumbers, Lead, Link, Live, Picture, Remarks, Table, page

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


TABLE = Link("channel-a%20b.csv", "channel-a b.csv")
DATA = {"text": "</script><!-- & \u2028", "numbers": [1.5, None]}


def make(data=None) -> str:
    return page(
        "Fit of <a> & b",
        subtitle="epoch 2001-01-18",
        verdict="doubtful",
        verdict_text="Ambiguous.",
        message="two minima",
        sections=[
            Lead(
                [
                    KeyNumbers("Key numbers", [("rate", "0.7 deg/s", "a <few> words")]),
                    Contents("On this page", [TABLE]),
                ],
                [Remarks("Warnings", ["chi2 is <null>"])],
            ),
            Facts("Fit", [("chi2", "101.5")]),
            Picture("Profile", PNG, 'six "panels"'),
            Live("currents", "Panel currents", Picture("Panel currents", PNG, "with a picture"), [TABLE]),
            Live("motion", "Motion"),
            Table("Parameters", ("name", "value"), [("imax", "251.4")], (1,), note="in mA"),
            Folded(Table("Settings", ("key", "value"), [("starts", "8")])),
            Table("Nothing here", ("a",), []),
            Folded(Table("Nothing folded", ("a",), [])),
            Remarks("Nor here", []),
            Facts("Nor there", []),
        ],
        data=data,
    )


@pytest.fixture(params=[None, DATA], ids=["without script", "with script"])
def html(request) -> str:
    return make(request.param)


def test_page_is_well_formed_and_complete(html):
    reader = Balance()
    reader.feed(html)
    assert reader.open == []
    text = " ".join(reader.texts)
    for expected in ("Fit of <a> & b", "Ambiguous.", "two minima", "chi2 is <null>", "101.5", "251.4", "in mA"):
        assert expected in text
    for absent in ("Nothing here", "Nothing folded", "Nor here", "Nor there"):
        assert absent not in text
    assert 'class="verdict doubtful"' in html and '<td class="number">251.4</td>' in html


def test_page_needs_nothing_from_outside(html):
    # Names of XML namespaces are no addresses: nothing is fetched from them.
    outside = [url for url in re.findall(r"(?:https?:)//[^\s\"'`]+", html) if not url.startswith("http://www.w3.org/")]
    assert outside == []
    assert "@import" not in html and not re.search(r"<script[^>]* src", html)
    assert all(target.startswith("data:") for target in re.findall(r'<(?:img|link)[^>]* (?:src|href)="([^"]*)"', html))
    assert base64.b64encode(PNG).decode() in html


def test_policy_allows_the_page_itself_and_nothing_else():
    html = make(DATA)
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', html)
    policy = policy.replace("&#x27;", "'")
    assert policy.startswith("default-src 'none'; ") and "unsafe" not in policy
    for tag in ("style", "script"):
        content = re.findall(rf"<{tag}>(.*?)</{tag}>", html, re.S)
        assert len(content) == 1
        digest = base64.b64encode(hashlib.sha256(content[0].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert " style=" not in html.split("<script")[0], "forbidden by the policy"
    assert "script-src" not in make()


def test_data_cannot_end_its_block():
    (block,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', make(DATA), re.S)
    assert json.loads(block) == DATA and not set("<>&\u2028") & set(block)
    with pytest.raises(ValueError, match="JSON"):
        make({"number": float("nan")})


def test_a_place_without_a_picture_is_not_seen_without_the_script(html):
    assert '<section id="motion" data-live="motion" hidden>' in html
    assert '<section id="panel-currents" data-live="currents">' in html and "<details open>" in html


def test_the_contents_lead_to_every_part_and_to_the_files(html):
    (contents,) = re.findall(r'<nav class="contents".*?</nav>', html, re.S)
    targets = re.findall(r'href="#([^"]*)"', contents)
    assert targets == [
        "key-numbers",
        "warnings",
        "fit",
        "profile",
        "panel-currents",
        "motion",
        "parameters",
        "settings",
    ]
    assert sorted(targets) == sorted(re.findall(r'<section id="([^"]*)"', html))
    # What the script alone shows is not to be gone to without it.
    assert '<li hidden><a href="#motion">' in contents and contents.count("<li hidden>") == 1
    assert html.count('href="channel-a%20b.csv"') == 2
    assert re.search(r'<details class="folded"><summary><h2>Settings</h2></summary>\s*<div', html)
    assert "a &lt;few&gt; words" in html


def test_page_serves_dark_screens_and_phones(html):
    assert "light-dark(" in html and "color-scheme: light dark" in html
    assert 'name="viewport" content="width=device-width' in html and "max-width: 34rem" in html
