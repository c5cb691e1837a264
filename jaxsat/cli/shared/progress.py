"""How far work in stages has come, on stderr: a moving bar on a terminal, one line a stage elsewhere."""

import sys
import threading
import time
from types import TracebackType


class Stages:
    """Called as `progress(stage, done, total)`; a context, so that the bar is gone when results are printed."""

    def __init__(self, label: str, *, quiet: bool = False, lines: bool = False, patience_s: float = 0.0):
        """`label` stands before each stage's name; `quiet` says nothing, `lines` are lines on a terminal too.

        Nothing is said before `patience_s` are over: then the stage that is under way.
        """
        self._label, self._stream, self._quiet = label, sys.stderr, quiet
        self._lines = lines or not self._stream.isatty()
        self._stage, self._done, self._total, self._begin = "", 0, 0, time.perf_counter()
        self._bar = self._task = None
        self._open = self._over = False
        self._lock = threading.Lock()
        # Work that leaves no word for long, as compilation, must not keep its beginning from being told.
        self._timer = threading.Timer(patience_s, self._speak) if patience_s > 0.0 and not quiet else None

    def __enter__(self) -> "Stages":
        if self._timer is not None:
            self._timer.daemon = True
            self._timer.start()
        elif not self._quiet:
            self._speak()
        return self

    def __call__(self, stage: str, done: int = 0, total: int = 0) -> None:
        """`stage` is at `done` of `total` steps; a total of 0 means that the number of steps is not known."""
        with self._lock:
            another = stage != self._stage
            self._stage, self._done, self._total = stage, done, total
            self._tell(another)

    def _speak(self) -> None:
        with self._lock:
            # The timer may come through that was cancelled too late.
            self._open = not self._over
            if self._open and not self._lines:
                from rich.console import Console
                from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

                columns = (TextColumn("{task.description}"), BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn())
                self._bar = Progress(*columns, console=Console(file=self._stream), transient=True)
                self._bar.start()
                self._task = self._bar.add_task(self._label, total=None)
            self._tell(bool(self._stage))

    def _tell(self, another: bool) -> None:
        if self._bar is not None and self._task is not None:
            text = f"{self._label}: {self._stage}" if self._stage else self._label
            self._bar.update(self._task, description=text, completed=self._done, total=self._total or None)
        elif self._open and another:
            elapsed = time.perf_counter() - self._begin
            print(f"{self._label}: {self._stage} ({elapsed:.1f} s)", file=self._stream, flush=True)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._timer is not None:
            self._timer.cancel()
        with self._lock:
            self._open, self._over = False, True
            if self._bar is not None:
                self._bar.stop()
