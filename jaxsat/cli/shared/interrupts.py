"""Ctrl-C and SIGTERM as exceptions that always arrive.

Python raises where the main thread happens to be. If that is a callback of the garbage collector (JAX has one) or a
finaliser, the exception is reported as unraisable and dropped: the command would go on to its end, and exit with 0.
"""

import os
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Callable, Sequence

INTERRUPTED, TERMINATED = 130, 143
STATUS = {signal.SIGINT: INTERRUPTED, signal.SIGTERM: TERMINATED}
AGAIN_S = 0.01
"""After which an exception that was dropped is raised again."""


def heeded(run: Callable[[Sequence[str]], int], arguments: Sequence[str]) -> int:
    """Exit status of `run(arguments)`, in which Ctrl-C raises KeyboardInterrupt and SIGTERM SystemExit, never in vain.

    For the main thread of a process that ends afterwards. A second Ctrl-C does not wait for other threads either.
    """
    heard: list[int] = []

    def hear(number, frame):
        heard.append(number)
        # As an exception, so that unfinished results are removed on the way out.
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(TERMINATED)

    for number in STATUS:
        # Ignored is what a shell wants of a process in the background.
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, hear)
    sys.unraisablehook = again(sys.unraisablehook)
    status = run(arguments)
    if heard and status != INTERRUPTED:
        # Dropped so late that nothing was left to be interrupted.
        print("jaxsat: error: interrupted; nothing unfinished is left", file=sys.stderr)
        status = STATUS[signal.Signals(heard[-1])]
    if len(heard) > 1:
        for stream in filter(None, (sys.stdout, sys.stderr)):
            stream.flush()
        os._exit(status)
    return status


def again(report: Callable[..., object]) -> Callable[..., None]:
    """A hook for exceptions that Python drops: an interrupt comes again a moment later, others go to `report`."""

    def hook(dropped):
        number = {KeyboardInterrupt: signal.SIGINT, SystemExit: signal.SIGTERM}.get(dropped.exc_type)
        if number is None:
            report(dropped)
            return
        timer = threading.Timer(AGAIN_S, interrupt_main, [number])
        timer.daemon = True
        timer.start()

    return hook
