"""Published JSON Schemas are strict, and there for every JSON file; conftest.py holds all that is written to them."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest

from jaxsat.files.json_files import json_text
from jaxsat.files.schemas import schema, schema_names
from jaxsat.sweep import SweepPlan
from jaxsat.sweep.plan import PLAN, claim

ROOT = Path(__file__).parent.parent.parent
NO_FILES = {"jaxsat.page/1", "jaxsat.session/1"}
"""The data of a page, and what stands beside the columns of a Parquet file."""
NAME = re.compile(r'"(jaxsat\.[a-z-]+/[0-9]+)"')


def objects(part: Any) -> Iterator[dict[str, Any]]:
    """All parts of a schema that are about objects of named values."""
    if isinstance(part, dict):
        if part.get("type") == "object":
            yield part
        for each in part.values():
            yield from objects(each)
    elif isinstance(part, list):
        for each in part:
            yield from objects(each)


@pytest.mark.parametrize("name", schema_names())
def test_a_schema_is_one_and_takes_no_key_that_it_does_not_name(name):
    own = schema(name)
    assert own["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert own["title"] == name and own["$id"] == f"urn:{name.replace('.', ':').replace('/', ':')}"
    jsonschema_rs.meta.validate(own)
    for each in objects(own):
        if "properties" in each:
            assert each["additionalProperties"] is False
            assert set(each["required"]) <= set(each["properties"])
        else:
            # A satellite file as it was read: what it may hold is said elsewhere.
            assert "additionalProperties" in each or each["description"].startswith("the satellite file")


def test_every_file_that_is_written_has_one():
    sources = [path.read_text("utf-8") for top in ("jaxsat", "fitting") for path in (ROOT / top).rglob("*.py")]
    assert {name for text in sources for name in NAME.findall(text)} - NO_FILES == set(schema_names())
    page = (ROOT / "docs" / "formats.md").read_text("utf-8")
    assert set(re.findall(r"`(jaxsat\.[a-z-]+/[0-9]+)`", page)) == set(schema_names())


def test_a_name_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"expected one of jaxsat.almanac/1, .*, got 'jaxsat.fit/2'"):
        schema("jaxsat.fit/2")


def test_the_plan_of_a_sweep_keeps_its_own_and_a_misspelt_key_does_not(tmp_path):
    claim(tmp_path, SweepPlan("darts", seed=1, options={"spread_deg": "2"}, chunk=8, cases=20))
    plan = json.loads((tmp_path / PLAN).read_text("utf-8"))
    own = jsonschema_rs.Draft202012Validator(schema("jaxsat.sweep-plan/1"))
    assert own.is_valid(plan)
    for key in plan:
        changed = {name + "s" * (name == key): value for name, value in plan.items()}
        assert not own.is_valid(changed), key


def test_what_tests_write_is_held_to_it():
    written = {"schema": "jaxsat.fit-summary/1", "files": [], "counts": {}, "timing_s": {"total": 1.0}}
    with pytest.raises(jsonschema_rs.ValidationError, match='"converged" is a required property'):
        json_text(written)
