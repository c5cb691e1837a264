"""What how-to pages say of exit statuses, verdicts, satellite files and options is what the program has."""

import ast
import re
import tomllib
from pathlib import Path

DOCS = Path(__file__).parent.parent / "docs"
EXITS = DOCS / "reference" / "exit-status.md"


def test_the_page_of_exit_statuses_says_what_each_help_says():
    from jaxsat.cli.main import app

    rows = re.findall(r"^\| `jaxsat (\w+)` \|([^|]*)\|([^|]*)\|([^|]*)\|$", EXITS.read_text("utf-8"), re.MULTILINE)
    assert [row[0] for row in rows] == sorted(name for name in app if not name.startswith("-"))
    for name, *cells in rows:
        told = app[name].help.partition("Exit status:")[2].partition("\n\n")[0]
        own = {number for number, cell in zip("013", cells, strict=True) if cell.strip()}
        # Some have nothing that could fail.
        assert own == (set(re.findall(r"(?<![\w.])[013](?= )", told)) or {"0"}), name


def test_every_word_of_a_verdict_has_its_section():
    from fitting.outcome import result, verdict

    text = (DOCS / "howto" / "verdicts.md").read_text("utf-8")
    words = (result.PREDICTS, result.FITS, result.FITS_ONLY, result.AMBIGUOUS_VERDICT)
    for word in (*words, result.UNDETERMINED, result.WRONG_MODEL):
        assert f"\n## `{word}`\n" in text
    for status in (result.CONVERGED, result.NOT_CONVERGED, result.AMBIGUOUS):
        assert f"| `{status}` |" in text
    for note in (verdict.HELD_BY_PRIOR, verdict.FAR_OFF, verdict.WITHOUT_LIGHT):
        assert f"| `{note}` |" in text


def test_every_reason_of_a_verdict_stands_on_its_page():
    """Words of its sentences that no number parts, as the code has them."""
    text = " ".join((DOCS / "howto" / "verdicts.md").read_text("utf-8").split()).lower()
    tree = ast.parse((DOCS.parent / "fitting" / "outcome" / "verdict.py").read_text("utf-8"))
    told = {"_wrong", "_doubts", "_remarks", "_background", "judge"}
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name in told]
    sentences = [node for each in functions for node in ast.walk(each) if isinstance(node, ast.JoinedStr)]
    missing = []
    for sentence in sentences:
        parts = [str(part.value) for part in sentence.values if isinstance(part, ast.Constant)]
        phrases = [phrase for part in parts for phrase in windows(part.split())]
        if phrases and not any(phrase.lower() in text for phrase in phrases):
            missing.append(" ... ".join(parts))
    assert missing == []


def windows(words: list[str], size: int = 3) -> list[str]:
    """Every few words in a row."""
    return [" ".join(words[k : k + size]) for k in range(len(words) - size + 1)]


def test_lines_of_satellite_files_are_such():
    """Those behind a hash are the other choices: each is taken by itself."""
    from jaxsat.satellites.sections.session import ChannelSettings, OrbitSettings, TimeSettings

    kinds = {"time": TimeSettings, "orbit": OrbitSettings, "channels": ChannelSettings}
    seen = set()
    for page in (DOCS / "howto").glob("*.md"):
        for block in re.findall(r"^```toml\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE):
            (name, table), *_ = tomllib.loads(block).items()
            others = [line[1:].strip() for line in block.splitlines() if line.startswith("#")]
            keys = set(table["mag"] if name == "channels" else table)
            for other in others:
                keys |= set(tomllib.loads(other))
                if name == "orbit":
                    OrbitSettings.model_validate(tomllib.loads(other))
            assert keys <= set(kinds[name].model_fields), block
            if name != "channels":
                kinds[name].model_validate(table)
            seen.add(name)
    assert seen == set(kinds)


def test_what_pages_say_of_changed_data_is_taken():
    from jaxsat.files.as_if import AsIf

    texts = {
        text
        for page in (DOCS / "howto").glob("*.md")
        for text in re.findall(r"--as ([\w:.,+-]*\w)", page.read_text("utf-8"))
    }
    assert len(texts) > 4 and [AsIf.of(text).text for text in texts]
