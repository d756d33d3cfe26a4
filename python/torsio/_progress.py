"""How far long functions are: a line on standard error, or a function of the caller."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Union

from . import _core
from ._core import UsageError

#: False: nothing. True: a line on standard error. A function: called with the share that is done, 0 to 1, and what
#: is being done, at most ten times per second; what it raises stops the work.
Listener = Union[bool, Callable[[float, str], Any]]

_WIDTH = 30
_PATIENCE_s = 0.5
_BETWEEN_LINES_s = 10.0


class _Line:
    """One line that is drawn again and again; where it cannot be (a file, a pipe), a line every ten seconds."""

    def __init__(self) -> None:
        self._start_s = time.monotonic()
        self._last_s = self._start_s
        self._is_drawn = False
        self._redraws = sys.stderr.isatty() or "ipykernel" in sys.modules

    def __call__(self, fraction: float, doing: str) -> None:
        now_s = time.monotonic()
        spent_s = now_s - self._start_s
        share = min(max(fraction, 0.0), 1.0)
        if self._redraws:
            if spent_s >= _PATIENCE_s:
                self._draw(share, doing, spent_s)
        elif now_s - self._last_s >= _BETWEEN_LINES_s:
            self._last_s = now_s
            print(f"{100.0 * share:.0f} % after {spent_s:.0f} s: {doing}", file=sys.stderr, flush=True)

    def _draw(self, share: float, doing: str, spent_s: float) -> None:
        hashes = "#" * int(share * _WIDTH)
        left = f"  {spent_s * (1.0 - share) / share:.0f} s left" if share > 0.02 else ""
        print(f"\r\033[K[{hashes:.<{_WIDTH}}] {100.0 * share:3.0f} %  {doing}{left}", end="", file=sys.stderr, flush=True)
        self._is_drawn = True

    def end(self) -> None:
        if self._is_drawn:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


@contextmanager
def progress(listener: Listener = True) -> Iterator[None]:
    """Shows how far the functions of torsio are that this thread calls in the block.

        with torsio.progress():
            model = torsio.fit(data, "lstm")

    listener: True for a line on standard error, False for nothing, or a function of (fraction, text): the share that
    is done, 0 to 1, and what is being done. It is called at most ten times per second; an exception that it raises
    stops the work and is raised by the function of torsio. Ctrl-C stops the work with or without it.
    """
    if not (isinstance(listener, bool) or callable(listener)):
        raise UsageError(
            f"progress: expected True, False or a function of (fraction, text), found {type(listener).__name__}"
        )
    line = _Line() if listener is True else None
    chosen: Any = line if line is not None else (listener or None)
    before = _core.set_progress(chosen)
    try:
        yield
    finally:
        _core.set_progress(before)
        if line is not None:
            line.end()


@contextmanager
def shown(listener: Listener | None) -> Iterator[None]:
    """The argument `progress` of a function: None leaves what a block of `progress` has set."""
    if listener is None:
        yield
    else:
        with progress(listener):
            yield
