"""Increasing times of frames, even where a file's times begin anew (joined recordings) or repeat; and
pictures that repeat."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

FASTEST = 1000.0  # frames a second
PAUSE = 4.0  # median steps; a longer one is a pause of the recording, or a first picture that is held
UNLIKE = 0.1  # share by which times must differ from a known rate to count
LATE = 0.25  # nominal frames by which a frame counts as early or late
UNEVEN_FRAMES, UNEVEN_SHARE = 2, 0.02  # number, share of early or late frames without a warning
ALIKE = 5  # pictures alike in a row by a conversion
REPEATED_FRAMES, REPEATED_SHARE = 3, 0.1  # number, share of frames that repeat the one before, as above
# Ticks a second of a written film: frames at 24, 25, 30, 29.97, 50, 60 and 120 a second take whole numbers.
CLOCK = 90_000
CLOSE = 1.8 / CLOCK  # seconds; what grows by less repeats, and might be one tick there
APART = 2.0  # nominal frames; a time that goes back by more begins another recording


def rate_of(times: Iterable[float]) -> float | None:
    """Frames a second by the median step of times (seconds, in any order); None if there is no such step."""
    grown = sorted(set(times))
    step = median([after - before for before, after in pairwise(grown)] or [0.0])
    return 1.0 / step if step * FASTEST >= 1.0 - 1e-9 else None


def rate_between_pauses(times: Iterable[float], known: float | None = None) -> float | None:
    """Average frames a second of times (seconds, in any order) but for pauses; None if it is about the known
    rate, by default their average."""
    grown = sorted(set(times))
    steps = [after - before for before, after in pairwise(grown)]
    if not steps:
        return None
    longest = PAUSE * median(steps)
    going = [step for step in steps if step <= longest]
    rate, known = len(going) / sum(going), known or len(steps) / sum(steps)
    return rate if max(rate / known, known / rate) > 1.0 + UNLIKE else None


@dataclass
class Growing:
    """Increasing times from a file's times, which may repeat or go back.

    step  : nominal seconds a frame
    last  : the last time given, seconds
    added : seconds added to the file's times, since its later parts begin anew
    wrong : how many were corrected
    uneven: how many others came a quarter of a step or more early or late
    count : how many there were
    """

    step: float
    last: float = -math.inf
    added: float = 0.0
    wrong: int = 0
    uneven: int = 0
    count: int = 0

    def next(self, told: float | None) -> float:
        """The next frame's time in seconds, from the file's; None if the file gives none, which is no fault.

        A time that repeats, hardly grows or goes back a little becomes half a frame after the one before, so
        that the next can stay. A part that begins anew follows a frame after the one before and keeps its own
        intervals.
        """
        if told is None:
            told = 0.0 if math.isinf(self.last) else self.last + self.step - self.added
        time = told + self.added
        self.count += 1
        if time - self.last < CLOSE:
            self.wrong += 1
            begins_anew = self.last - time >= APART * self.step
            time = self.last + (self.step if begins_anew else 0.5 * self.step)
            if begins_anew:
                self.added = time - told
        elif self.count > 1 and abs(time - self.last - self.step) >= LATE * self.step:
            self.uneven += 1
        self.last = time
        return time

    def note(self, name: str, fps: float) -> str | None:
        """One line if times of a film of this name and nominal rate were corrected, or many are uneven."""
        if self.wrong:
            times = "one time" if self.wrong == 1 else f"{self.wrong} times"
            return (
                f"{times} of frames in {name} did not grow and were put right; figures by time may be off "
                "there"
            )
        if self.uneven <= max(UNEVEN_FRAMES, UNEVEN_SHARE * self.count):
            return None
        return (
            f"{self.uneven} of {self.count} frames of {name} come early or late for {fps:.4g} a second; "
            "motion is taken as if they were even"
        )


@dataclass
class Repeats:
    """Pictures that repeat the one before, as where a film was converted to a higher frame rate.

    More than ALIKE alike in a row, as where somebody stands still before a still camera, do not count.

    repeats : how many did
    count   : how many pictures there were
    """

    repeats: int = 0
    count: int = 0
    _last: int | None = None
    _run: int = 0

    def next(self, checksum: int) -> None:
        """The next picture, by its checksum."""
        self.count += 1
        self._run = self._run + 1 if checksum == self._last else 1
        if 1 < self._run <= ALIKE:
            self.repeats += 1
        elif self._run == ALIKE + 1:
            self.repeats -= ALIKE - 1
        self._last = checksum

    def note(self, name: str, fps: float) -> str | None:
        """One line if many frames of a film of this name and nominal rate repeat the one before."""
        if self.repeats <= max(REPEATED_FRAMES, REPEATED_SHARE * self.count):
            return None
        once = fps * (self.count - self.repeats) / self.count
        return (
            f"{self.repeats} of {self.count} frames of {name} repeat the one before, as if it was "
            f"filmed at {once:.3g} a second; convert it to that, or fast steps are followed less well"
        )
