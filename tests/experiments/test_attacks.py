"""A small part of the attacks: damage to files that are read without JAX is refused in one line, or does no harm."""

import random
import signal

import pytest

from experiments.attacks.attack import BAD, Late, tried
from experiments.attacks.mutate import mutated
from experiments.attacks.readers import readers
from experiments.attacks.sources import written

CONTENTS = {kind: contents for kind, contents in written().items() if kind not in ("satellite", "table")}
INPUTS = 60


@pytest.mark.parametrize("kind", CONTENTS)
def test_damage_is_refused_or_harmless(kind, tmp_path):
    ending, _, read = readers(tmp_path / "no-run")[kind]
    path = tmp_path / f"input{ending}"

    def late(*_):
        raise Late

    before = signal.signal(signal.SIGALRM, late)
    try:
        for content in CONTENTS[kind]:
            path.write_bytes(content)
            assert tried(read, path) == ("taken", "")
        outcomes = []
        for number in range(INPUTS):
            rng = random.Random(f"test {kind} {number}")
            path.write_bytes(mutated(rng.choice(CONTENTS[kind]), rng))
            outcomes.append(tried(read, path))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert [found for found in outcomes if found[0] in BAD] == []
    assert sum(found[0] == "refused" for found in outcomes) > INPUTS // 4


def test_the_checks_see_an_orbit_that_no_line_tells(tmp_path, monkeypatch):
    """A reader that took a blank for a zero: the eccentricity of the satellite is not that of its line."""
    from experiments.attacks import readers as checked

    path = tmp_path / "input.tle"
    path.write_bytes(CONTENTS["tle"][1])
    sets = checked.read_element_sets(path)
    path.write_bytes(CONTENTS["tle"][1].replace(b"0001027", b"0009027"))
    monkeypatch.setattr(checked, "read_element_sets", lambda _: sets)
    assert tried(checked.elements, path) == ("silent", "another eccentricity than the line says")
