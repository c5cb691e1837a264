"""The README's lines of Python run as they stand, with stand-ins for the solver and, seconds saved, for the pictures.

That the same calls write what `jaxsat fit` writes is tested in `test_python_way.py`.
"""

import re
import shutil
from pathlib import Path

from jaxsat.bundled import BUNDLED

README = Path(__file__).parents[3] / "README.md"


def test_the_lines_of_python_run(fake_fit, tmp_path, monkeypatch, capsys):
    (example,) = re.findall(r"^```python\n(.*?)^```", README.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    shutil.copy(BUNDLED, tmp_path / "session.RAW_SUN")

    def write_fit(stage, result, *_, **__):
        (stage / "report.html").write_text(result.status)
        return result, []

    monkeypatch.setattr("fitting.run.look_around", lambda *_, **__: lambda: None)
    monkeypatch.setattr("fitting.run.write_fit", write_fit)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.startswith("converged best of 8 starts\nmagnet.x 0.3049 0.0012 A m2\n")
    assert (tmp_path / "session-fit" / "report.html").read_text() == "converged"
