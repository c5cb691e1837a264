"""Ctrl-C, SIGTERM and SIGHUP end a command wherever they land, in a callback of the garbage collector too."""

import subprocess
import sys
import time

import pytest

SCRIPT = """
import gc, os, signal, sys, time
from jaxsat.cli.shared.interrupts import heeded

# Under nohup it is ignored, and stays so.
signal.signal(signal.SIGHUP, signal.SIG_DFL)

def run(arguments):
    def landing(phase, info):
        gc.callbacks.remove(landing)
        signal.raise_signal(signal.{signal})
    gc.callbacks.append(landing)
    gc.collect()
    # At once: the signal comes again soon, on a busy machine between a line and its end.
    os.write(1, b"went on\\n")
    try:
        time.sleep({then})
    except KeyboardInterrupt:
        return 130
    return 0

sys.exit(heeded(run, []))
"""


@pytest.mark.parametrize(("signal", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
@pytest.mark.parametrize("then", [60.0, 0.0])
def test_a_signal_in_a_collection_is_not_lost(signal, status, then):
    """While there is work to be stopped, and when there is none left."""
    begin = time.perf_counter()
    command = [sys.executable, "-c", SCRIPT.format(signal=signal, then=then)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == status and done.stdout == "went on\n" and time.perf_counter() - begin < 50.0
    assert "Traceback" not in done.stderr and done.stderr.count("\n") <= 1
