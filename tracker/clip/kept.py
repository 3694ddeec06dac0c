"""What stays of a track whose marks were corrected: all but the frames between the nearest marks that stay.

Marks are passed through, so a frame beyond the next one that was not touched is followed as it was before.
Templates come from the start frame and change on the way, so following begins there again.
"""

from dataclasses import dataclass, replace

import numpy as np

from kinematics.recover import Start
from tracker.run.track import Track
from tracker.tables.keypoints import Marks


@dataclass(frozen=True)
class Kept:
    """An earlier track, and the frames of it that are followed again.

    anew  : the first and the last frame that are replaced
    span  : the first and the last that are followed for it; the start frame is among them
    """

    track: Track
    anew: tuple[int, int]
    span: tuple[int, int]

    @classmethod
    def of(cls, track: Track, before: Marks, now: Marks, start: int) -> "Kept | None":
        """What stays where marks changed; None where nothing can: none changed, or those of the start did."""
        changed = [t for t in before.keys() | now.keys() if before.get(t) != now.get(t)]
        if not changed or start in changed:
            return None
        same, first, end = sorted(before.keys() - set(changed)), track.first, track.first + len(track) - 1
        low = max((t for t in same if t < min(changed)), default=first - 1)
        high = min((t for t in same if t > max(changed)), default=end + 1)
        span = min(max(low, first), start), max(min(high, end), start)
        return cls(track, (low + 1, high - 1), span)

    def fits(self, start: Start, labels: tuple[str, ...]) -> bool:
        """Whether a start has the same figure at the same place, to rounding, and a model the same states."""
        one, other = (
            [
                *(link.length for link in each.figure.links),
                *each.view.origin,
                each.view.unit,
                each.view.facing,
            ]
            for each in (start, self.track)
        )
        return labels == self.track.labels and np.allclose(one, other, rtol=1e-6)

    def joined(self, new: Track) -> Track:
        """The earlier track with the frames that were followed again; `new` is of its span."""
        here, there = (
            slice(self.anew[0] - each.first, self.anew[1] + 1 - each.first) for each in (self.track, new)
        )
        rows = {name: getattr(self.track, name).copy() for name in ("q", "cov", "s", "shift")}
        for name, values in rows.items():
            values[here] = getattr(new, name)[there]
        outcome = list(self.track.outcome)
        outcome[here] = new.outcome[there]
        return replace(self.track, outcome=tuple(outcome), misnamed=new.misnamed, **rows)
