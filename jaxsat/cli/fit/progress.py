"""How far a fit has come, on stderr: a moving bar on a terminal, one line a stage elsewhere."""

import sys
import time
from types import TracebackType


class StageProgress:
    """Called as `progress(stage, done, total)`; a context, so that the bar is gone when results are printed."""

    def __init__(self, label: str):
        """`label` stands before each stage's name."""
        self._label, self._stream = label, sys.stderr
        self._stage, self._begin = "", time.perf_counter()
        self._bar = self._task = None

    def __enter__(self) -> "StageProgress":
        if self._stream.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (TextColumn("{task.description}"), BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn())
            self._bar = Progress(*columns, console=Console(file=self._stream), transient=True)
            self._bar.start()
            self._task = self._bar.add_task(self._label, total=None)
        return self

    def __call__(self, stage: str, done: int, total: int) -> None:
        """`stage` is at `done` of `total` steps; a total of 0 means that the number of steps is not known."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=f"{self._label}: {stage}", completed=done, total=total or None)
        elif stage != self._stage:
            elapsed = time.perf_counter() - self._begin
            print(f"{self._label}: {stage} ({elapsed:.1f} s)", file=self._stream, flush=True)
        self._stage = stage

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
