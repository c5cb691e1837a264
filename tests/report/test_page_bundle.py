"""The bundled script is that of its sources, small, and carries its licences."""

import hashlib
import json
import re
from importlib.resources import files
from pathlib import Path

REPORT = Path(str(files("jaxsat.report")))
BUNDLE, SEARCH, SWEEP = ((REPORT / f"{name}.bundle.js").read_text("utf-8") for name in ("page", "search", "sweep"))


def test_bundle_is_as_new_as_its_sources():
    digest = hashlib.sha256()
    folder = REPORT / "page"
    names = sorted([path.name for path in folder.glob("*.js")] + ["package-lock.json"])
    for name in names:
        digest.update(f"{name}\n{(folder / name).read_text('utf-8')}".encode())
    again = f"(in {folder}: npm ci --ignore-scripts && npm run build)"
    for name, bundle in (("page", BUNDLE), ("search", SEARCH), ("sweep", SWEEP)):
        assert bundle.startswith(f"/* sources sha256 {digest.hexdigest()}\n"), (
            f"{name}.bundle.js is not that of page/ {again}"
        )


def test_bundle_is_small_inert_and_licensed():
    assert len(BUNDLE.encode()) < 1_000_000 and len(SEARCH.encode()) < 40_000 and len(SWEEP.encode()) < 40_000
    for own in (SEARCH, SWEEP):
        assert "</script" not in own.lower() and "<!--" not in own
    assert "</script" not in BUNDLE.lower() and "<!--" not in BUNDLE
    for notice in ("The MIT License", "three.js authors", "Michael Bostock", "Natural Earth"):
        assert notice in BUNDLE and notice in (REPORT / "page.LICENSES.txt").read_text("utf-8")


def test_versions_are_pinned_and_name_no_registry():
    package = json.loads((REPORT / "page" / "package.json").read_text())
    assert all(re.fullmatch(r"[0-9.]+", version) for version in package["devDependencies"].values())
    lock = json.loads((REPORT / "page" / "package-lock.json").read_text())
    assert all("resolved" not in entry for entry in lock["packages"].values())
    assert lock["packages"]["node_modules/three"]["version"] in (REPORT / "page.LICENSES.txt").read_text("utf-8")
