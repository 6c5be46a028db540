"""When a search ends with the best so far: comes in a time limit, or Ctrl-C; goes out how much time is left."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import FrameType


@dataclass(frozen=True, slots=True)
class Deadline:
    """When to stop.

    Attributes:
        end: [s] on the monotonic clock, infinity for never.
        stop: set when the user interrupts.
    """

    end: float = float("inf")
    stop: threading.Event = field(default_factory=threading.Event)

    @property
    def left(self) -> float:
        """[s] that are left; 0 once it is over."""
        return 0.0 if self.stop.is_set() else max(0.0, self.end - time.monotonic())

    @property
    def is_over(self) -> bool:
        """Whether to stop now."""
        return self.left <= 0.0

    def within(self, seconds: float) -> Deadline:
        """The same, but not later than so many seconds from now."""
        return replace(self, end=min(self.end, time.monotonic() + seconds))


FOREVER = Deadline()


def in_seconds(time_limit: float | None) -> Deadline:
    """A deadline from now; None for never."""
    return Deadline() if time_limit is None else Deadline(time.monotonic() + time_limit)


@contextmanager
def interruptible(deadline: Deadline) -> Iterator[None]:
    """Makes the first Ctrl-C end the search instead of the program; the second one ends the program.

    SIGTERM, where the program has told what it is to do then, also ends the search first.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {signal.SIGINT: signal.getsignal(signal.SIGINT)}
    if callable(signal.getsignal(signal.SIGTERM)):
        before[signal.SIGTERM] = signal.getsignal(signal.SIGTERM)
    terminated = []

    def stop(number: int, _: FrameType | None) -> None:
        deadline.stop.set()
        signal.signal(number, before[signal.Signals(number)])
        terminated.extend([number] if number == signal.SIGTERM else [])

    for number in before:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number, action in before.items():
            signal.signal(number, action)
        if terminated:
            signal.raise_signal(signal.SIGTERM)
