"""Version, date and changelog agree; .ci/release says where they do not before it builds anything."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FILES = ("pyproject.toml", "CITATION.cff", "CHANGELOG.md", ".ci/release")


def test_version_and_date_are_the_same_everywhere():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    releases = re.findall(
        r"^## (\d\S*) \((\d{4}-\d\d-\d\d)\)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE
    )
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert releases[0][0] == version
    assert f"\nversion: {version}\ndate-released: {releases[0][1]}\n" in citation
    assert [date for _, date in releases] == sorted((date for _, date in releases), reverse=True)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("CITATION.cff", "version: 0", "version: 7", "CITATION.cff has another version"),
        ("CHANGELOG.md", "## Unreleased\n", "## Unreleased\n\n- Something.\n", "lines under Unreleased"),
        ("CHANGELOG.md", "## Unreleased\n", "## 9.9.9 (2099-01-01)\n", "the newest entry of CHANGELOG.md is '## 9.9.9"),
        ("pyproject.toml", 'version = "0.', 'version = "1.', "CITATION.cff has another version"),
        (None, "", "", "changes that are not committed"),
    ],
)
def test_a_release_that_is_not_ready_is_refused(tmp_path, file, old, new, said):
    for name in FILES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    (tmp_path / "CHANGELOG.md").write_text(without_unreleased((tmp_path / "CHANGELOG.md").read_text("utf-8")))
    if file is not None:
        text = (tmp_path / file).read_text("utf-8")
        assert old in text
        (tmp_path / file).write_text(text.replace(old, new, 1))
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(tmp_path)]
    subprocess.run([*git, "init", "-q"], check=True)
    if file is not None:
        subprocess.run([*git, "add", "."], check=True)
        subprocess.run([*git, "commit", "-qm", "all"], check=True)
    done = subprocess.run([tmp_path / ".ci" / "release"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stderr.startswith("not ready: ") and said in done.stderr


def without_unreleased(text: str) -> str:
    """A changelog with nothing under that heading."""
    head, _, rest = text.partition("## Unreleased\n")
    return f"{head}## Unreleased\n\n## {rest.partition('## ')[2]}"
