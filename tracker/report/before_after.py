"""Two runs of one person side by side: their gait figures, what changed, and angles over the stride."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from kinematics.figure_file import WALKER, load_figure
from kinematics.sides import OTHER, SIDES, Side
from tracker.gait.curves import legs_of, norm_of
from tracker.gait.figures import LEG_JOINTS, Gait, gait_of
from tracker.gait.lengths import Known
from tracker.gait.values import Value
from tracker.report.document import STYLES, Document, write_page
from tracker.report.html_tables import SIGMAS, html_table, in_columns, small_errors, spoken, unit_of
from tracker.run.read import RunError, read_gait, read_news, read_track
from tracker.run.track import Track

COLUMNS = ("", "before", "after", "change")
STARRED = "change (*: over two standard errors)"
SCRIPTS = ("plots", "saving", "before_after")
PAGE = Document("report/before_after.html", STYLES, tuple(f"report/{name}.js" for name in SCRIPTS))


@dataclass(frozen=True)
class Walked:
    """One of the two runs.

    rate     : playback speed by which its seconds were multiplied
    warnings : of the run
    """

    folder: Path
    track: Track
    rate: float
    known: Known
    warnings: Sequence[str]

    def gait(self, metres: bool) -> Gait:
        """Its gait figures, with lengths in metres or in leg lengths; RunError if there are none."""
        gait = gait_of(self.track, self.rate, self.known if metres else None)
        if gait is None or not gait.measures:
            raise RunError(
                f"{self.folder} has no whole stride, so no gait figures to compare; take a longer clip"
            )
        return gait


@dataclass(frozen=True)
class Change:
    """A figure of one leg, or of both, in two runs."""

    name: str
    unit: str
    before: Value
    after: Value

    @property
    def by(self) -> Value:
        """After minus before; the errors of two runs are independent."""
        mean, error = self.after.mean - self.before.mean, np.hypot(self.after.error, self.before.error)
        return Value(mean, float(error), min(self.before.count, self.after.count))

    @property
    def sure(self) -> bool:
        return abs(self.by.mean) > SIGMAS * self.by.error

    def cells(self) -> list[str]:
        """The change as cells of text, with a star if larger than two standard errors."""
        name, comma, side = self.name.partition(", ")
        *values, by = self._spoken()
        return [f"{name} ({self.unit}){comma}{side}", *values, f"{by} *" if self.sure else by]

    def row(self) -> list[str]:
        """The change as a row of HTML, in bold if larger than two standard errors."""
        *values, by = map(small_errors, self._spoken())
        name = Markup("{} <small>{}</small>").format(self.name, self.unit)
        return [name, *values, Markup("<b>{}</b>").format(by) if self.sure else by]

    def _spoken(self) -> list[str]:
        return [spoken(value, self.unit) for value in (self.before, self.after, self.by)]


def compare_runs(before: Path, after: Path, page: Path) -> str:
    """Write the page of two runs, and return its table and notes as text. RunError: a folder without a
    complete run, or a run without gait figures."""
    runs = [_walked(folder) for folder in (before, after)]
    metres = all(run.known != Known() for run in runs)
    gaits = [run.gait(metres) for run in runs]
    turned = runs[0].track.view.facing != runs[1].track.view.facing
    pairs: Mapping[str, Side] = OTHER if turned else {side: side for side in SIDES}
    changes = list(_changes(gaits[0], gaits[1], pairs))
    notes = list(_notes(gaits, metres, runs, turned, changes))
    warnings = [f"{run.folder.resolve().name}: {warning}" for run in runs for warning in run.warnings]
    write_page(
        page,
        PAGE,
        {"cycles": list(_cycles(runs, gaits, pairs))},
        title=f"{before.resolve().name} and {after.resolve().name}",
        notes=notes,
        warnings=warnings,
        table=html_table(COLUMNS, [change.row() for change in changes]),
    )
    table = in_columns([(*COLUMNS[:-1], STARRED), *(change.cells() for change in changes)])
    return "\n".join([table, *(f"\n{text}" for text in [*notes, *warnings])])


def _walked(folder: Path) -> Walked:
    news, gait = read_news(folder), read_gait(folder)
    if gait is None:
        raise RunError(f"{folder} has no gait.json; only runs of people have one")
    figure = load_figure(news.options.get("figure", WALKER.name))
    track = read_track(folder, mark=0.0, figure=figure)
    return Walked(folder, track, gait.rate, Known(news.height, news.scale), news.warnings)


def _changes(before: Gait, after: Gait, pairs: Mapping[str, Side]) -> Iterator[Change]:
    """Every figure that both runs have, for each leg where legs differ; `pairs` is the side in the second run
    of each leg of the first. A figure that they have of different legs only is left out."""
    for measure in before.measures:
        other, unit = after.named(measure.name), unit_of(measure)
        if other is None:
            continue
        values = {
            leg: (getattr(measure, leg), getattr(other, pairs.get(leg, leg))) for leg in (*SIDES, "both")
        }
        legs = [side for side in SIDES if all(values[side])]
        for side in legs:
            yield Change(f"{measure.name}, {side}", unit, *values[side])
        by_side = any(value for side in SIDES for value in values[side])
        if not by_side and measure.both and other.both:
            yield Change(measure.name, unit, measure.both, other.both)


def _notes(
    gaits: Sequence[Gait], metres: bool, runs: Sequence[Walked], turned: bool, changes: Sequence[Change]
) -> Iterator[str]:
    if turned:
        yield (
            "The two face opposite ways, so the leg near the camera in one is the far one in the other: near "
            "and far are those of the first, and each leg is compared with itself."
        )
    before, after = (gait.motion + " backwards" * gait.backwards for gait in gaits)
    if before != after:
        yield f"The first is a {before} and the second a {after}: most figures differ for that reason alone."
    if not metres and any(run.known != Known() for run in runs):
        yield "Lengths are in leg lengths (thigh + shank): metres are known of one of the two only."
    if any(change.by.count == 1 for change in changes):
        yield "Of a single stride the error is that of the poses alone, not of how much strides differ."


def _cycles(
    runs: Sequence[Walked], gaits: Sequence[Gait], pairs: Mapping[str, Side]
) -> Iterator[dict[str, Any]]:
    """A plot for each leg and joint that both runs have."""
    drawn = {
        joint: [legs_of(run.track, gait, joint) for run, gait in zip(runs, gaits, strict=True)]
        for joint in LEG_JOINTS
    }
    for side in SIDES:
        for joint, (before, after) in drawn.items():
            if side in before and pairs[side] in after:
                legs = {"before": before[side], "after": after[pairs[side]]}
                norm = norm_of(gaits[0], joint)
                yield {"title": f"{joint.capitalize()}, {side}", "legs": legs, "norm": norm}
