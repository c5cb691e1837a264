"""A file is whole or absent, and what another writer holds is not taken for a leftover."""

import pytest

from jaxsat.files.whole_file import remove_leftovers, write_whole


def test_a_writer_that_fails_leaves_what_was_there(tmp_path):
    path = tmp_path / "a"
    write_whole(path, lambda stream: stream.write(b"first"))

    def fail(stream):
        stream.write(b"second")
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left on device.*/a"):
        write_whole(path, fail)
    assert path.read_bytes() == b"first" and [p.name for p in tmp_path.iterdir()] == ["a"]


def test_a_part_that_is_being_written_is_no_leftover(tmp_path):
    found = []
    write_whole(tmp_path / "a", lambda stream: found.append(remove_leftovers(tmp_path, ["a"])))
    assert found == [0]


def test_a_part_taken_away_is_written_again(tmp_path):
    """As happens to a writer that is seen before it has its lock."""
    attempts = []

    def write(stream):
        attempts.append(stream.write(b"all"))
        if len(attempts) == 1:
            next(tmp_path.glob(".*.part")).unlink()

    write_whole(tmp_path / "a", write)
    assert len(attempts) == 2 and (tmp_path / "a").read_bytes() == b"all"


def test_a_directory_taken_away_is_an_error(tmp_path):
    (tmp_path / "d").mkdir()

    def write(stream):
        next((tmp_path / "d").glob(".*")).unlink()
        (tmp_path / "d").rmdir()

    with pytest.raises(OSError, match="No such file"):
        write_whole(tmp_path / "d" / "a", write)
