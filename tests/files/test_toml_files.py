"""What no settings file holds is one line, and soon."""

import time

import pytest

from jaxsat.errors import InputError
from jaxsat.files.toml_files import read_toml


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a = " + "9" * 5000, "x.toml: TOML syntax: Exceeds the limit"),
        ("[b]\na = " + "9" * 400, "x.toml: b.a: expected a whole number of 64 bits, found 9"),
        ("a = [1.0, -1e300]", "x.toml: a: expected a number of at most 1e"),
        ('a = "\\u001b[31m"', r"x.toml: a: character U\+001B has no place"),
        ('"a\\u0007" = 1', r"x.toml: a\\x07: character U\+0007 has no place in a key"),
        ("a." * 400_000 + "a = 1", "x.toml: TOML syntax: nested too deeply"),
        ('"a" . ' * 100_000 + "a = 1", "x.toml: TOML syntax: nested too deeply"),
        ("a = {" + "b." * 400_000 + "c = 1}", "x.toml: TOML syntax: nested too deeply"),
        ("a = " + "[" * 100_000, "x.toml: TOML syntax: nested too deeply"),
    ],
)
def test_damage_is_one_line(text, expected, tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(text)
    begin = time.perf_counter()
    with pytest.raises(InputError, match=expected):
        read_toml(path, kind="TOML")
    assert time.perf_counter() - begin < 5.0


def test_long_but_harmless_text_is_read(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text('a."b.c".d = 1.5\nversion = "1.2.3"\ntext = """two\n\tlines"""\n# ' + "a" * 900_000)
    assert read_toml(path, kind="TOML") == {"a": {"b.c": {"d": 1.5}}, "version": "1.2.3", "text": "two\n\tlines"}
