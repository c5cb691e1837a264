"""Ctrl-C, SIGTERM and SIGHUP while chunks run: noted when they come, and raised where the loop over the chunks asks.

Raised at once they may land in a callback of the garbage collector, as JAX has one: Python drops such an exception,
and the sweep would go on to its end.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

HEARD = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
POLL_S = 0.1
"""How often a loop that waits should ask."""


@contextmanager
def noted_signals() -> Iterator[Callable[[], None]]:
    """Gives `heed()`, which hands a signal that has come to its own handler, which raises; so does the block's end.

    A second signal goes there at once. Signals that no Python function handles are left alone, as all are outside the
    main thread.
    """
    own: dict[int, Callable] = {}
    if threading.current_thread() is threading.main_thread():
        for number in HEARD:
            handler = signal.getsignal(number)
            if callable(handler):
                own[number] = handler
    heard: list[int] = []

    def note(number, frame):
        heard.append(number)
        if len(heard) > 1:
            own[number](number, frame)

    def put_back():
        for number, handler in own.items():
            signal.signal(number, handler)

    def heed():
        if heard:
            put_back()
            signal.raise_signal(heard.pop())

    for number in own:
        signal.signal(number, note)
    try:
        yield heed
        heed()
    finally:
        put_back()


@contextmanager
def deaf_children() -> Iterator[None]:
    """Processes started inside do not hear Ctrl-C, which goes to all: they are ended in order by this one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
