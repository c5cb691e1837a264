"""The README is short, its commands stand where they are looked for, and its links lead somewhere."""

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text("utf-8")
MOST_LINES = 200


def test_it_is_short():
    assert len(TEXT.splitlines()) <= MOST_LINES


def test_commands_stand_in_their_order():
    # .ci/run takes the second.
    first, second, third, *_ = re.findall(r"^```sh\n(.*?)\n^```", TEXT, flags=re.DOTALL | re.MULTILINE)
    assert first.endswith("/jaxsat fit --out munin-fit") and "'.[test]'" in first
    assert " -m pytest " in second and "'.[test]'" in second
    assert third.endswith("/mkdocs build --strict") and "'.[docs]'" in third
    assert not any("\n" in command for command in (first, second, third))
    assert "/^```sh$/ { block++; next }" in (ROOT / ".ci" / "run").read_text("utf-8")


def test_its_picture_is_small():
    (picture,) = re.findall(r"!\[[^]]+\]\(([^)]+)\)", TEXT)
    assert (ROOT / picture).stat().st_size < 300_000
