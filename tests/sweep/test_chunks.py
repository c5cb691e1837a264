"""A chunk is the same bytes whatever the sweep around it; what is spoilt or foreign is found and run again."""

import math
import os
import struct

import pyarrow.parquet as pq
import pytest

from jaxsat.errors import InputError
from jaxsat.sweep import Source, SweepPlan, chunk_path, claim, find_missing, read_plan

PLAN_TEXT = """{"schema": "jaxsat.sweep-plan/1", "scenario": "gravity-gradient", "seed": 1,
"options": {"rate_deg_s": "0.1"}, "chunk": 1024, "cases": 2000}"""


def test_chunks_do_not_depend_on_the_number_of_cases_or_on_shards(sweep):
    long, short = sweep("long", cases=37), sweep("short", cases=20)
    assert long.run() == [0, 1, 2, 3, 4] and short.run() == [0, 1, 2]
    assert long.chunk_bytes()[:2] == short.chunk_bytes()[:2]
    # The last chunk of the short one is cut, its rows are those of the long one's.
    cut = [pq.read_table(chunk_path(s.directory, 2)).to_pydict() for s in (long, short)]
    assert len(cut[1]["case"]) == 4
    assert str({name: values[:4] for name, values in cut[0].items()}) == str(cut[1])

    parts = sweep("parts")
    assert parts.run(shard=(2, 2)) == [1, 3] and parts.run(shard=(1, 2)) == [0, 2, 4]
    assert parts.chunk_bytes() == long.chunk_bytes() and parts.merged() == long.merged()


def test_a_case_is_the_same_in_chunks_of_another_size(sweep):
    small, large = sweep("small", chunk="5"), sweep("large", chunk="16")
    small.run()
    large.run()
    assert small.merged() == large.merged()


def test_resuming_runs_what_is_missing_and_what_is_spoilt(sweep):
    one = sweep()
    one.run()
    whole, table = one.chunk_bytes(), one.merged()
    paths = [chunk_path(one.directory, number) for number in range(5)]
    paths[0].unlink()
    paths[1].write_bytes(whole[1][: len(whole[1]) // 2])
    # The last bit of a number, which only a checksum sees; and a chunk in another's place.
    number = pq.read_table(paths[2])["miss_deg"][3].as_py()
    assert whole[2].count(struct.pack("<d", number)) == 1
    paths[2].write_bytes(whole[2].replace(struct.pack("<d", number), struct.pack("<d", math.nextafter(number, 9.0))))
    paths[3].write_bytes(whole[1])
    missing, rejected = find_missing(one.scenario, one.plan, one.directory, range(5))
    assert missing == [0, 1, 2, 3]
    assert [path for path, _ in rejected] == paths[1:4]
    assert [reason.split(":")[0] for _, reason in rejected] == [
        "cannot be read",
        "cannot be read",
        "has other case numbers",
    ]
    with pytest.raises(InputError, match=f"{paths[0]}: cannot be read: No such file.*; --resume runs it again"):
        one.merged()
    # merge_cases stops at the first bad chunk, and leaves no half table: that of before is still there.
    assert (one.directory / "cases.parquet").read_bytes() == table
    assert one.run(resume=True) == [0, 1, 2, 3]
    assert one.chunk_bytes() == whole and one.merged() == table
    assert one.run(resume=True) == []


def test_a_chunk_of_another_seed_is_foreign(sweep):
    one, other = sweep("one"), sweep("other", seed=4)
    one.run()
    other.run()
    chunk_path(one.directory, 2).write_bytes(chunk_path(other.directory, 2).read_bytes())
    missing, ((_, reason),) = find_missing(one.scenario, one.plan, one.directory, range(5))
    assert missing == [2] and reason == "is of another sweep, or has other columns"


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"seed": 4}, "holds a sweep with seed 3, not 4"),
        ({"scale": "2"}, "option scale = 1, not 2"),
        ({"chunk": "4"}, "option chunk = 8, not 4"),
        ({"cases": 36}, "37 cases, not 36"),
    ],
)
def test_another_sweep_is_refused(settings, expected, sweep):
    sweep().run()
    other = sweep(**settings)
    before = other.chunk_bytes()
    with pytest.raises(InputError, match=expected):
        other.run(resume=True)
    with pytest.raises(InputError, match="holds a sweep already"):
        other.run()
    assert other.chunk_bytes() == before


def test_a_sweep_may_grow(sweep):
    short, long, whole = sweep(cases=20), sweep(cases=37), sweep("whole", cases=37)
    short.run()
    short.merged()
    # The chunk that was cut, and those that are new.
    assert long.run(resume=True) == [2, 3, 4]
    assert not (long.directory / "cases.parquet").exists()
    whole.run()
    assert long.merged() == whole.merged()


def test_shards_join_the_sweep_but_do_not_run_twice(sweep):
    one = sweep()
    one.run(shard=(1, 2))
    with pytest.raises(InputError, match="holds a sweep already"):
        one.run(shard=(1, 2))
    with pytest.raises(InputError, match="seed 3, not 4"):
        sweep(seed=4).run(shard=(2, 2))
    with pytest.raises(InputError, match="37 cases, not 99"):
        sweep(cases=99).run(shard=(2, 2))
    assert one.run(shard=(2, 2)) == [1, 3]


def test_leftovers_of_killed_writers_are_removed(sweep):
    one = sweep()
    one.run()
    left = one.directory / "chunks" / ".chunk-00000001.parquet.0123.part"
    foreign = one.directory / "chunks" / ".notes.part"
    merging = one.directory / ".cases.parquet.4567.part"
    for path in (left, foreign, merging):
        path.write_bytes(b"half")
    claim(one.directory, one.plan, resume=True, shard=(1, 2))
    assert left.exists() and not merging.exists()
    claim(one.directory, one.plan, resume=True)
    assert not left.exists() and foreign.exists()


def test_a_directory_that_cannot_be_one(sweep, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="is a file; expected a directory"):
        sweep("file").run()
    with pytest.raises(InputError, match="cannot write results here"):
        sweep("file/below").run()
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "sweep.json").mkdir()
    with pytest.raises(InputError, match=r"sweep.json: is a directory, and the results have a file of this name"):
        sweep("odd").run()


@pytest.mark.parametrize(
    "text",
    [
        "[1]",
        "{" * 100000,
        '{"a": ' * 100000,
        PLAN_TEXT.replace("2000", "2e99"),
        PLAN_TEXT.replace("2000", "9" * 5000),
        PLAN_TEXT.replace("2000", "null"),
        PLAN_TEXT.replace("1024", "0"),
        PLAN_TEXT.replace("1024", "NaN"),
        PLAN_TEXT.replace("gravity", "\\ud800"),
        PLAN_TEXT.replace('"0.1"', "0.1"),
        PLAN_TEXT.replace("plan/1", "plan/2"),
        PLAN_TEXT.replace("options", "option"),
        PLAN_TEXT.replace('"seed": 1,', '"seed": 1, "seed": 2,'),
    ],
)
def test_a_damaged_plan_is_one_line(text, tmp_path):
    (tmp_path / "sweep.json").write_text(PLAN_TEXT)
    assert read_plan(tmp_path) == SweepPlan("gravity-gradient", 1, {"rate_deg_s": "0.1"}, 1024, 2000)
    (tmp_path / "sweep.json").write_text(text)
    with pytest.raises(InputError, match=r"sweep.json: is no plan of a sweep \(jaxsat.sweep-plan/1\)"):
        read_plan(tmp_path)


def test_a_pipe_or_a_folder_as_a_chunk_is_not_waited_for(sweep):
    one = sweep("a")
    one.run()
    path = chunk_path(one.directory, 1)
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match="is no file"):
        find_missing(one.scenario, one.plan, one.directory, [1])
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match="is a directory"):
        find_missing(one.scenario, one.plan, one.directory, [1])


@pytest.mark.parametrize(
    "address", ["os:getcwd", "builtins:eval", "builtins:int", "..:x", ":x", "json:loads", "json:x"]
)
def test_what_makes_no_scenario_is_one_line(address):
    with pytest.raises(InputError, match="cannot be imported|neither a Factory nor|makes no scenario"):
        Source.of(address, {}).scenario()
