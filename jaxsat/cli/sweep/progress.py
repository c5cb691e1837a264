"""How far a sweep has come, on stderr: a bar with the rate and the time left, or a line at each tenth elsewhere."""

import sys
import time
from types import TracebackType


class SweepProgress:
    """Called as `progress(cases, failed)` with what has been added; a context, so that the bar goes before results."""

    def __init__(self, label: str, cases: int, *, quiet: bool = False):
        """`cases` is the number of cases to be run; `quiet` says nothing."""
        self._quiet = quiet
        self._label, self._cases, self._stream = label, cases, sys.stderr
        self._done = self._failed = self._tenths = 0
        self._begin = time.perf_counter()
        self._bar = self._task = None

    def __enter__(self) -> "SweepProgress":
        if self._quiet:
            return self
        if self._stream.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

            columns = (TextColumn("{task.description}"), BarColumn(16), MofNCompleteColumn())
            state = TextColumn("{task.fields[state]}")
            self._bar = Progress(*columns, state, console=Console(file=self._stream), transient=True)
            self._bar.start()
            self._task = self._bar.add_task(self._label, total=self._cases, state="compiling")
        elif self._cases:
            print(f"{self._label}: {self._cases} cases to run", file=self._stream, flush=True)
        return self

    def __call__(self, cases: int, failed: int) -> None:
        self._done += cases
        self._failed += failed
        tenths = 10 * self._done // self._cases
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self._done, state=self._state())
        elif tenths > self._tenths and not self._quiet:
            text = f"{self._label}: {self._done} of {self._cases} cases, {self._state()}, {self._failed} failed"
            print(text, file=self._stream, flush=True)
        self._tenths = tenths

    def _state(self) -> str:
        rate = self._done / max(time.perf_counter() - self._begin, 1e-9)
        return f"{rate_text(rate)}, {duration_text((self._cases - self._done) / rate)} left"

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()


def rate_text(cases_per_s: float) -> str:
    """Returns cases/s with three digits."""
    return f"{cases_per_s:.3g} cases/s" if cases_per_s < 1e3 else f"{cases_per_s:.0f} cases/s"


def duration_text(seconds: float) -> str:
    """Returns a time as `42 s`, `3 min 20 s` or `5 h 12 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
