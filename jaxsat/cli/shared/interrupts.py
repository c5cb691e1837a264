"""Ctrl-C, SIGTERM and SIGHUP as exceptions that always arrive.

Python raises where the main thread happens to be. If that is a callback of the garbage collector (JAX has one) or a
finaliser, the exception is reported as unraisable and dropped: the command would go on to its end, and exit with 0.
"""

import os
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Callable, Sequence

INTERRUPTED = 130
HEARD = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""The last one comes where the terminal is closed."""
AGAIN_S = 0.01
"""After which a signal whose exception was dropped is sent again."""


def heeded(run: Callable[[Sequence[str]], int], arguments: Sequence[str]) -> int:
    """Exit status of `run(arguments)`, in which Ctrl-C raises KeyboardInterrupt and others SystemExit, never in vain.

    For the main thread of a process that ends afterwards. After a second Ctrl-C no other thread is waited for.
    """
    heard, dropped = [], []
    report, reporting = sys.unraisablehook, False

    def hear(number, frame):
        if reporting:
            # From inside the hook it would be dropped once more.
            _send_later(number)
            return
        heard.append(number)
        # As an exception, so that unfinished results are removed on the way out.
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    def hook(lost):
        nonlocal reporting
        reporting = True
        if heard and lost.exc_type in (KeyboardInterrupt, SystemExit):
            dropped.append(heard[-1])
            _send_later(heard[-1])
        else:
            report(lost)
        # Last: Python looks for signals after each call.
        reporting = False

    # Ignored is what a shell wants of a process in the background.
    own = [number for number in HEARD if signal.getsignal(number) != signal.SIG_IGN]
    for number in own:
        signal.signal(number, hear)
    sys.unraisablehook = hook
    status = run(arguments)
    for number in own:
        signal.signal(number, signal.SIG_IGN)
    if heard and status != INTERRUPTED:
        # Dropped so late that nothing was left to be interrupted.
        print("jaxsat: error: interrupted; nothing unfinished is left", file=sys.stderr)
        status = 128 + heard[-1]
    if len(heard) - len(dropped) > 1:
        for stream in filter(None, (sys.stdout, sys.stderr)):
            stream.flush()
        os._exit(status)
    return status


def _send_later(number: signal.Signals) -> None:
    timer = threading.Timer(AGAIN_S, _send, [number])
    timer.daemon = True
    timer.start()


def _send(number: signal.Signals) -> None:
    """A signal to the main thread; a real one where there are such, which wakes it from waiting too."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        interrupt_main(number)
