"""Pictures of several fits, by a process of their own: Python draws one thing at a time, and the next fit needs it."""

import gc
import multiprocessing
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.outcome.result import FitResult
    from fitting.profile.profile import Profile

Draw = Callable[["FitResult", str, Mapping[str, Any] | None, Sequence["Profile"]], dict[str, bytes]]
"""As `draw_all`."""


def draw_all(
    result: "FitResult", label: str, scene: Mapping[str, Any] | None, profiles: Sequence["Profile"]
) -> dict[str, bytes]:
    """Returns all pictures of a fit as PNG by file name."""
    # Matplotlib is wanted here for the first time.
    from fitting.report.fit.pictures import draw_fit
    from fitting.report.fit.profiles import draw_profiles

    return {**draw_fit(result, label, scene), **draw_profiles(profiles, label)}


class DrawingProcess:
    """Does what `draw_all` does in another process, from its beginning to its end as a context.

    For one thread. Where that process is lost, the pictures are drawn here.
    """

    def __enter__(self) -> "DrawingProcess":
        # Not forked: JAX has threads.
        processes = multiprocessing.get_context("spawn")
        self._mine, its = processes.Pipe()
        self._process = processes.Process(target=_serve, args=(its,), name="draw", daemon=True)
        with _without_interrupts():
            self._process.start()
        # Its end stands open there alone, so that each sees where the other is gone.
        its.close()
        return self

    def __exit__(self, *_: object) -> None:
        self._mine.close()
        self._process.terminate()
        self._process.join()

    def __call__(
        self, result: "FitResult", label: str, scene: Mapping[str, Any] | None, profiles: Sequence["Profile"]
    ) -> dict[str, bytes]:
        """The same as `draw_all`; an error that it raises there is raised here."""
        asked = (result, label, scene, profiles)
        try:
            self._mine.send(asked)
            found = self._mine.recv()
        except (EOFError, OSError):
            return draw_all(*asked)
        if isinstance(found, Exception):
            raise found
        return found


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Ctrl-C goes to all processes of a terminal: one that is started here never hears it, and ends with this one."""
    block = getattr(signal, "pthread_sigmask", None)
    if block is None:
        yield
        return
    # What Python starts with a first process would lift the block.
    resource_tracker.ensure_running()
    before = block(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        block(signal.SIG_SETMASK, before)


def _serve(connection: Connection) -> None:
    # Looking for garbage among all that is imported takes a quarter of the drawing's time.
    gc.set_threshold(100_000)
    import fitting.report.fit.pictures  # noqa: F401  # While the first fit goes on.

    with suppress(EOFError, OSError):
        while True:
            asked = connection.recv()
            try:
                found = draw_all(*asked)
            except Exception as error:
                found = error
            connection.send(found)
