"""Means over strides with their standard errors, for each leg and for both.

A standard error combines in quadrature the independent errors of strides and the error that all strides of
the clip share. The former is the spread of the strides, or their measurement error if that is larger. A
figure of both legs is the mean of the two, with fully correlated errors. What is no leg's own, such as speed,
is the mean over the strides of both legs, of which each shares half of its time, and of its error, with the
next. In symmetry only independent errors count.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from kinematics.sides import SIDES, Side
from tracker.gait.strides import Stride, Strides


class Sample(NamedTuple):
    """A number of one stride, its variance, and the standard error that all strides share."""

    value: float
    variance: float
    shared: float = 0.0


Samples = Mapping[Side, Sequence[Sample]]


@dataclass(frozen=True)
class Value:
    """A mean, its standard error, the shared part of that, and the number of strides or steps."""

    mean: float
    error: float
    count: int
    shared: float = 0.0

    @property
    def own(self) -> float:
        """The part of the standard error that strides do not share."""
        return float(np.sqrt(max(self.error**2 - self.shared**2, 0.0)))

    def plain(self) -> dict[str, float | int]:
        """The value as a JSON object, as gait.json has it."""
        return {"mean": round(self.mean, 4), "error": round(self.error, 4), "count": self.count}


@dataclass(frozen=True)
class Measure:
    """One gait figure of each leg and of both; None if it was not measured.

    symmetry : 100 (near - far) / mean of the two, per cent; of moments near - far, as they are no amounts
    """

    name: str
    unit: str
    near: Value | None = None
    far: Value | None = None
    both: Value | None = None
    symmetry: Value | None = None

    @classmethod
    def of(cls, name: str, unit: str, samples: Samples) -> "Measure":
        near, far = (_mean(samples[side]) for side in SIDES)
        return cls(name, unit, near, far, _both(near, far), _symmetry(near, far))

    @classmethod
    def common(cls, name: str, unit: str, samples: Samples) -> "Measure":
        """A figure that is of no leg, from the strides of both."""
        near, far = (len(samples[side]) for side in SIDES)
        overlaps = max(min(2 * min(near, far), near + far - 1), 0)
        return cls(name, unit, both=_mean([sample for side in SIDES for sample in samples[side]], overlaps))

    @classmethod
    def of_moments(cls, name: str, samples: Samples) -> "Measure":
        """Moments in the stride, per cent of it."""
        measure = cls.of(name, "% of stride", samples)
        return replace(measure, symmetry=_difference(measure.near, measure.far))

    def plain(self) -> dict[str, object]:
        """The measure as a JSON object, as gait.json has it."""
        kinds = {"near": self.near, "far": self.far, "both": self.both, "symmetry": self.symmetry}
        return {"unit": self.unit} | {k: None if v is None else v.plain() for k, v in kinds.items()}


def each(strides: Mapping[Side, Strides], told: Callable[[Stride], Sample]) -> dict[Side, list[Sample]]:
    """A number for every measured stride."""
    return {side: [told(stride) for stride in strides[side].sound] for side in SIDES}


def _mean(samples: Sequence[Sample], overlaps: int = 0) -> Value | None:
    """The mean; in so many pairs of strides half of the variance is common."""
    if not samples:
        return None
    values, variances, shared = np.array(samples).T
    spread = float(np.var(values, ddof=1)) if len(values) > 1 else 0.0
    own = max(spread, float(variances.mean())) * (1.0 + overlaps / len(values)) / len(values)
    together = float(shared.mean())
    return Value(float(values.mean()), float(np.sqrt(own + together**2)), len(values), together)


def _both(near: Value | None, far: Value | None) -> Value | None:
    if near is None or far is None:
        return near or far
    mean, error = (near.mean + far.mean) / 2.0, (near.error + far.error) / 2.0
    return Value(mean, error, near.count + far.count, (near.shared + far.shared) / 2.0)


def _difference(near: Value | None, far: Value | None) -> Value | None:
    if near is None or far is None:
        return None
    return Value(near.mean - far.mean, float(np.hypot(near.own, far.own)), min(near.count, far.count))


def _symmetry(near: Value | None, far: Value | None) -> Value | None:
    if near is None or far is None or near.mean + far.mean <= 0.0:
        return None
    total = near.mean + far.mean
    error = 400.0 * np.hypot(far.mean * near.own, near.mean * far.own) / total**2
    return Value(200.0 * (near.mean - far.mean) / total, float(error), min(near.count, far.count))
