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
    _tree(tmp_path)
    if file is not None:
        text = (tmp_path / file).read_text("utf-8")
        assert old in text
        (tmp_path / file).write_text(text.replace(old, new, 1))
    done = _released(tmp_path, commit=file is not None)
    assert done.returncode == 1 and done.stderr.startswith("not ready: ") and said in done.stderr


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_one_that_is_ready_leaves_files_with_checksums_and_publishes_nothing(tmp_path):
    _tree(tmp_path)
    # In place of what takes minutes, and is run by .ci/run.
    version = tomllib.loads((tmp_path / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    wheel = tmp_path / ".ci" / "wheel"
    wheel.write_text(
        f'#!/bin/sh\nmkdir "$1"; echo a >"$1/jaxsat-{version}.tar.gz"; echo b >"$1/jaxsat-{version}.whl"\n'
    )
    wheel.chmod(0o755)
    done = _released(tmp_path)
    assert done.returncode == 0, done.stderr
    head = next((tmp_path / ".git" / "refs" / "heads").iterdir()).read_text("utf-8")
    assert f"commit {head[:7]}" in done.stdout and "left to do by hand" in done.stdout
    sums = (tmp_path / "dist" / "SHA256SUMS").read_text("utf-8").splitlines()
    assert [line.split()[1] for line in sums] == [f"jaxsat-{version}.tar.gz", f"jaxsat-{version}.whl"]
    assert not any((tmp_path / ".git" / "refs" / "tags").iterdir())


def _tree(path: Path) -> None:
    for name in FILES:
        (path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, path / name)
    (path / "CHANGELOG.md").write_text(without_unreleased((path / "CHANGELOG.md").read_text("utf-8")))


def _released(path: Path, *, commit: bool = True) -> subprocess.CompletedProcess[str]:
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(path)]
    subprocess.run([*git, "init", "-q"], check=True)
    if commit:
        subprocess.run([*git, "add", "."], check=True)
        subprocess.run([*git, "commit", "-qm", "all"], check=True)
    return subprocess.run([path / ".ci" / "release"], capture_output=True, text=True, timeout=60)


def without_unreleased(text: str) -> str:
    """A changelog with nothing under that heading."""
    head, _, rest = text.partition("## Unreleased\n")
    return f"{head}## Unreleased\n\n## {rest.partition('## ')[2]}"
