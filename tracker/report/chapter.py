"""The content of a report on one run: facts, curves, intervals, and its gait in a sentence."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from kinematics.sides import SIDES, Side
from tracker.clip.follow import Run
from tracker.gait.curves import legs_of, norm_of
from tracker.gait.figures import LEG_JOINTS, Gait, gait_of
from tracker.gait.lengths import Known
from tracker.gait.times import STANCE, SWING
from tracker.gait.values import Measure, Value
from tracker.loop.outcome import Outcome
from tracker.progress import counted
from tracker.report.drawing import figure_numbers
from tracker.report.html_tables import SIGMAS
from tracker.run.track import Track
from tracker.tables.poses import stretches

OWN_SPEED = (0.8, 1.25)  # measured playback speeds that count as real time
DISCORD = 0.1  # relative difference of the legs' stride times above which the track is unreliable
WORDS = {
    Outcome.OK: "all in view",
    Outcome.HIDDEN: "a limb is not seen",
    Outcome.LOST: "lost: nothing matched",
    Outcome.FOUND: "found again",
    Outcome.OUTSIDE: "out of the picture",
}
NOTED = 10.0  # least difference of the legs that is mentioned, per cent of their mean
SECOND = {"m/s": "m a second", "leg lengths/s": "leg lengths a second"}


@dataclass(frozen=True)
class Chapter:
    """One run in a report.

    name     : of the model
    gait     : None for a figure without legs
    warnings : of the run, and of its gait figures
    """

    name: str
    run: Run
    gait: Gait | None
    warnings: Sequence[str]

    @classmethod
    def of(cls, finished: Run) -> Self:
        job = finished.job
        # A measured speed would pull every walker towards the model's mean pace.
        rate = 1.0 if job.rate is None else job.rate
        gait = gait_of(finished.track, rate, Known(job.height, job.scale))
        warnings = [*finished.warnings, *(gait.warnings if gait else ())]
        if gait and gait.measures and _looks_altered(finished):
            warnings.append(
                f"the motion looks like {finished.rate:.3g} times real speed, but times are the film's own: "
                f"if it is slow or quick motion, track again with --rate {finished.rate:.3g}"
            )
        return cls(job.model, finished, gait, warnings)

    @property
    def track(self) -> Track:
        return self.run.track

    @property
    def camera(self) -> float:
        """Largest shift of the background by the camera since the start, pixels."""
        return float(np.hypot(*self.track.moved[:, :2].T).max())

    def facts(self) -> list[tuple[str, str]]:
        counts = Counter(self.track.outcome)
        outcomes = ", ".join(f"{counts[name]} {word}" for name, word in WORDS.items() if counts[name])
        seconds = self.track.times[-1] - self.track.times[0]
        given, side = self.run.job.rate is not None, self.track.view.side
        source = "as given" if given else "as the motion looks"
        speed = ("Playback speed", f"{self.run.rate:.3g} \N{MULTIPLICATION SIGN}, {source}")
        facts = [
            ("Model", self.track.model),
            ("Frames", f"{len(self.track)} at {self.run.fps:.4g} a second, {seconds:.1f} s"),
            *([speed] if given or _looks_altered(self.run) else []),
            ("Faces", f"{side}, so near is the {side} side"),
            ("Tracked", outcomes),
        ]
        return facts if self.gait is None else [*facts, *_walked(self.gait, self.camera)]

    def cautions(self) -> list[str]:
        """Warnings about the gait figures."""
        if self.gait is None:
            return []
        said = []
        if not self.gait.measures:
            said.append(
                "No gait figures: they want one whole stride, from a foot's strike to its next, "
                "in which the figure was not lost."
            )
        elif any(value.count == 1 for m in self.gait.measures for value in (m.near, m.far) if value):
            said.append(
                "A figure of one stride does not show how much strides differ: its \N{PLUS-MINUS SIGN} is "
                "the poses' uncertainty alone."
            )
        if self.gait.discord > DISCORD:
            said.append(
                "The legs' stride times differ, which no gait does: a leg was followed badly or the two were "
                "exchanged for a while. Look at the picture before using these figures."
            )
        if self.gait.measures and self.gait.named("stride length") is None:
            said.append(
                "No lengths and no speed: the figure stays where it is, as on a treadmill, or no two stances "
                "of a foot are in the clip."
            )
        if self.gait.left_out:
            said.append(
                f"Left out: {counted(self.gait.left_out, 'stride')} with lost frames, of an odd length, or "
                "beside a stand."
            )
        return said

    def drawn(self) -> dict[str, Any]:
        """Curves in degrees, intervals in frames and the figure, in the form of the page's data."""
        track = self.track
        return {
            "name": self.name,
            "first": track.first,
            "start": self.run.start - track.first,
            "times": np.round(track.times - track.times[0], 4),
            "began": round(float(track.times[0]), 4),
            "panels": list(self._panels()),
            "motions": [[start, end, track.motions[start]] for start, end in stretches(track.motions)],
            "outcomes": [[start, end, track.outcome[start]] for start, end in stretches(track.outcome)],
            "words": WORDS,
            "floor": {side: self._on_floor(side) for side in SIDES},
            "cycles": list(self._cycles()),
            "figure": figure_numbers(track),
        }

    def _panels(self) -> Iterable[dict[str, Any]]:
        figure = self.track.figure
        for panel in figure.panels:
            shown = {name: figure.index(freedom) for name, freedom in panel.curves.items()}
            yield {
                "title": panel.title,
                "reading": panel.reading,
                "curves": [
                    {
                        "name": name,
                        "mean": np.round(np.degrees(self.track.q[:, k]), 1),
                        "sigma": np.round(np.degrees(self.track.sigma(k)), 1),
                    }
                    for name, k in shown.items()
                ],
            }

    def _cycles(self) -> Iterable[dict[str, Any]]:
        """The angle over the stride of each joint of the legs."""
        if self.gait is not None:
            for joint in LEG_JOINTS:
                legs = legs_of(self.track, self.gait, joint)
                norm = norm_of(self.gait, joint)
                if legs:
                    yield {"title": joint.capitalize(), "legs": legs, "norm": norm}

    def _on_floor(self, side: Side) -> list[list[float]]:
        """First and last frame of the foot on the floor in each stride; none where the stance is left out."""
        told = self.gait is not None and self.gait.named(STANCE) is not None
        strides = self.gait.strides[side].sound if self.gait is not None and told else ()
        first = self.track.first
        return [[round(s.strike.at - first, 2), round(s.off.at - first, 2)] for s in strides]


def _looks_altered(run: Run) -> bool:
    """Whether the film looks like slow or fast motion without a given playback speed."""
    return run.job.rate is None and not OWN_SPEED[0] <= run.rate <= OWN_SPEED[1]


def headline(chapter: Chapter) -> str:
    """Describe cadence, speed and stance in one sentence; empty without gait figures."""
    gait = chapter.gait
    cadence = None if gait is None else gait.named("cadence")
    if gait is None or cadence is None or cadence.both is None:
        return ""
    verb = {"walk": "Walks", "run": "Runs"}[gait.motion] + (" backwards" if gait.backwards else "")
    told = f"{verb} at {cadence.both.mean:.0f} steps a minute"
    speed = gait.named("speed")
    if speed is not None and speed.both is not None:
        told += f", {speed.both.mean:.2f} {SECOND[speed.unit]}"
    stance = gait.named(STANCE)
    shares = [f"{value.mean:.0f} % {side}" for side in SIDES if (value := getattr(stance, side, None))]
    return f"{told}; stance {', '.join(shares)}." if shares else f"{told}."


def unusual(chapter: Chapter) -> str:
    """Figures in which the legs differ by more than NOTED and their errors."""
    gait = chapter.gait
    if gait is None or not gait.measures:
        return ""
    compared = list(_compared(gait))
    said = [_differs(measure, by) for measure, by in compared if abs(by.mean) > max(NOTED, SIGMAS * by.error)]
    if gait.discord > DISCORD:
        said.append("the legs' stride times differ")
    if said:
        return f"Unusual: {'; '.join(said)}."
    if not compared:
        return "Too few strides to compare the legs."
    return f"Nothing unusual: the legs differ by no more than {NOTED:.0f} % or the errors of their figures."


def _walked(gait: Gait, camera: float) -> list[tuple[str, str]]:
    """The gait, the unit of its lengths, and whether camera motion was subtracted."""
    lengths = "in leg lengths (thigh + shank); follow with a height for metres"
    if gait.leg is not None:
        lengths = f"in metres; a leg length (thigh + shank) is {gait.leg:.2f} m"
    if round(camera) > 0:
        lengths += f"; against the background, which the camera moves by up to {camera:.0f} px"
    return [("Motion", gait.motion), ("Lengths", lengths)]


def _compared(gait: Gait) -> list[tuple[Measure, Value]]:
    """Figures with their symmetry, if each leg has two strides; without swing, which follows from stance."""
    found = [(measure, measure.symmetry) for measure in gait.measures if measure.name != SWING]
    return [(measure, by) for measure, by in found if by is not None and by.count > 1]


def _differs(measure: Measure, by: Value) -> str:
    leg = "near" if by.mean > 0.0 else "far"
    if measure.name.endswith("peak"):
        return f"{measure.name} {abs(by.mean):.0f} % of the stride later on the {leg} leg"
    more = "longer" if measure.unit == "s" or measure.name.endswith("length") else "greater"
    return f"{measure.name} {abs(by.mean):.0f} % {more} on the {leg} leg"
