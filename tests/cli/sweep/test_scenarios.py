"""Scenarios are found by their files, and told about without being imported."""

import subprocess
import sys

from jaxsat.cli.sweep.scenarios import PACKAGES, SCENARIOS, folder_of, found_in

SCENARIO = '''"""{summary}

More.
"""

from jaxsat.sweep import Factory, History, Scenario

raise ImportError("not for help")
'''


def test_a_file_is_all_that_a_scenario_takes(tmp_path):
    for name, summary in (("spin_decay", "Spin that dies away."), ("gps", "GPS lost"), ("_part", "Of another.")):
        (tmp_path / f"{name}.py").write_text(SCENARIO.format(summary=summary))
    found = found_in(tmp_path, "somewhere")
    assert {name: entry.summary for name, entry in found.items()} == {
        "gps": "GPS lost",
        "spin-decay": "spin that dies away",
    }
    assert found["spin-decay"].address == "somewhere.spin_decay:make"


def test_every_file_is_there_with_a_summary():
    files = [path for package in PACKAGES for path in folder_of(package).glob("[!_]*.py")]
    assert len(SCENARIOS) == len(files) >= 8
    assert all(entry.summary and len(entry.summary) < 100 for entry in SCENARIOS.values())


def test_help_imports_no_scenario():
    told = "print({'numpy', 'jaxsat.sweep'} & {*sys.modules})"
    script = f"import sys; from jaxsat.cli.main import run; run(['sweep', '--help']); {told}"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "set()" and "gravity-gradient:" in done.stdout
