"""People who walk through a film, and a start without marks."""

from collections.abc import Sequence
from dataclasses import replace

from tracker.clip.job import Following, Found, towards
from tracker.clip.naming import borne_out, marked, marks_of, nearer, start_from, sure_of_leg
from tracker.clip.staged import Surveyed, every, fewest, surveyed
from tracker.clip.start import FoundError, objections
from tracker.compiled import tell_unkept
from tracker.outline.bodies import paths
from tracker.outline.cycles import Cycles
from tracker.outline.occluders import forget_occluders
from tracker.outline.others import forget_others
from tracker.outline.person import Person, person, seen_figure
from tracker.outline.pieces import joined
from tracker.outline.shape import Shape
from tracker.outline.spot import Spot, spot
from tracker.outline.stage import Stage
from tracker.progress import Progress
from tracker.survey.evidence import AS_THE_SCENE, FULL_OF_SHADOWS, GREY_CLOTHES, HARDLY_SHADOWS, SOMEBODY
from tracker.tables.keypoints import points
from videos.frames import Video

WINDOW = 600  # surveyed frames that are searched together, which bounds memory
TURNED = 0.07  # least advantage of the better facing, nats times square leg lengths a frame
DOUBTED = 0.08  # spread of joints, leg lengths; no correct start on 200 rendered films had a larger one
NOBODY = 0.5  # spread of joints above which a path shows no person, leg lengths
CLEARLY = 0.2  # advantage of the better facing above which a person is not searched for again
NARROW = 0.05  # spread of joints below which that is so, leg lengths
LEAD = 1.1  # factor on the advantage of the better facing in an earlier search
AGAIN = SOMEBODY, GREY_CLOTHES, AS_THE_SCENE, HARDLY_SHADOWS
MOSTLY = 0.5  # share of frames that must show the camera's path; else it may follow a person


def people(
    video: Video, progress: Progress, first: int = 0, stop: int | None = None, facing: int | None = None
) -> list[Person]:
    """The people in the first part of a film, of one scene, in which anybody walks, the surest first.

    If a person is not seen clearly, clothes may have been taken for the scene or its shadow: the film is
    searched again with that expected.

    Args:
        first, stop: the first and last frame of the search, None for the film's last.
        facing: of the people, +1 right, -1 left, None to find it.
    """
    tell_unkept(progress)
    step = every(video, first, stop)
    while True:
        film = surveyed(video, first, _last(first, step, stop), step, 1.0, progress)
        if film is None:
            return []
        seen = _walking(film, facing)
        if seen:
            if film.cut:
                after = film.last + 1
                progress.note(
                    f"from frame {after} on another scene is shown; "
                    f"'figtrack track --from {after}' finds who walks there"
                )
            whole = [one.in_film(first, film.every) for one in seen]
            # Where the outline is not sure of the legs' names, the fit of templates tells them.
            return [one if sure_of_leg(one) or _doubted(one) else borne_out(one, video) for one in whole]
        if film.last == stop or not (film.cut or len(film.survey.places) == WINDOW):  # nothing is left
            return []
        first = film.last + 1


def _walking(film: Surveyed, facing: int | None) -> list[Person]:
    """The people who walk through a part of a film."""
    if not film.enough:
        return []
    stage = film.stage(1)
    seen = _before(stage, facing)
    grey = film.survey.scene.colourless
    for expected in (*AGAIN, *[FULL_OF_SHADOWS] * grey):
        unclear = [one for one in seen if not _clear(one)]
        if not unclear and (seen or not grey):
            break
        again = _before(film.stage(1, expected), facing, unclear or None)
        seen = _each_once([one if _clear(one) else _clearer(one, again) for one in seen]) if seen else again
    return _whole(seen, film, spot(stage))


def _each_once(seen: Sequence[Person]) -> list[Person]:
    """The people, without those who are the same as an earlier one."""
    found: list[Person] = []
    for one in seen:
        if not any(one.same(other) for other in found):
            found.append(one)
    return found


def _last(first: int, step: int, stop: int | None) -> int:
    """The last frame that is searched together with frame `first`, of every so many frames one."""
    last = first + WINDOW * step - 1
    return last if stop is None else min(last, stop)


def _before(stage: Stage, facing: int | None, those: Sequence[Person] | None = None) -> list[Person]:
    """People who walk in front of a scene, the surest first; with `those` only these are searched for."""
    figure, cycles = seen_figure(), Cycles.load()
    seen: list[Person] = []
    everybody = joined(stage, paths(stage, Shape.of(figure), cycles))
    for path in everybody:
        if those is not None and not any(one.near(path) for one in those):
            continue
        own = replace(stage, odds=stage.odds.copy())
        forget_others(own, path, everybody)
        forget_occluders(own, path)
        one = person(own, figure, path, cycles, facing, alone=len(everybody) == 1)
        if one is not None and one.spread < NOBODY:
            seen.append(one)
    return _each_once(seen)


def _whole(seen: list[Person], film: Surveyed, place: Spot | None) -> list[Person]:
    """The people, without those that are only limbs of a person who moves on the spot; and without that
    person where the camera may go along, for then half of the person counts as the scene.

    Beside people who go through the film, nobody who stays at one place counts: what looks so is mostly where
    somebody stood, or moving light.
    """
    told = film.survey.sure.mean() > MOSTLY

    def on_the_spot(one: Person) -> bool:
        goes = one.direction != 0
        if place is None or (told and goes) or not place.holds(one.outline.hips):
            return False
        return place.larger(one.outline.units) or not (told or goes)

    walking = [one for one in seen if not on_the_spot(one)]
    return [one for one in walking if one.direction != 0 and told] or walking


def _clear(one: Person) -> bool:
    """Whether the person is so clear that another search is unnecessary."""
    return abs(one.turned) >= CLEARLY and one.spread < NARROW and not _doubted(one)


def _clearer(one: Person, again: list[Person]) -> Person:
    """The person as the search shows it in which the facing is told best, the earlier one if about as well.

    Where legs were missed or a shadow was taken for one, a person fits either facing about as badly.
    """

    def worth(seen: Person, lead: float = 1.0) -> tuple[bool, bool, float]:
        return not _doubted(seen), seen.spread < NARROW, lead * abs(seen.turned)

    best = max(filter(one.same, again), key=worth, default=one)
    return best if worth(best) > worth(one, LEAD) else one


def start_of(
    everybody: list[Person], how: Following, video: Video, listed: list[Person] | None = None
) -> Found:
    """The start of the person asked for, or of the only one.

    Args:
        listed: those of the whole film, who are counted where `everybody` is of a part of it.

    Raises:
        FoundError: nobody, several people and none chosen, or an uncertain facing or pose.
    """
    number, near = how.person, how.near
    if not everybody:
        raise _nobody(how, video)
    if number is None and len(everybody) > 1:
        raise FoundError(
            f"{len(everybody)} people walk through the film; name one with --person N, as 'figtrack find' "
            "lists them",
            {everybody[0].frame: marks_of(everybody[0])},
        )
    one = everybody[0] if number is None else _numbered(number, everybody, listed)
    if doubted := _doubted(one):
        raise FoundError(f"{doubted}mark its joints there", {one.frame: marks_of(one)})
    if near is not None and near is not nearer(one):
        one = one.exchanged
    told = "given" if near is not None else "sure" if sure_of_leg(one) else "unsure"
    return start_from(one, told, one.turned <= -TURNED)


def _numbered(number: int, everybody: list[Person], listed: list[Person] | None) -> Person:
    """Person `number` of those listed, as the part shows them; of its own where it shows none of these."""
    own = [next(filter(one.same, everybody), None) for one in listed or ()]
    counted = own if any(own) else everybody
    if number > len(counted):
        raise FoundError(f"there is no person {number}; found are {len(counted)}")
    one = counted[number - 1]
    if one is None:
        raise FoundError(f"person {number} is not seen in that part of the film")
    return one


def _nobody(how: Following, video: Video) -> FoundError:
    """The error if nobody walks through the film, or faces as was given, with rough joints of a person who
    moves on the spot."""
    first = how.from_ or 0
    step = every(video, first, how.stop)
    film = surveyed(video, first, _last(first, step, how.stop), step, 1.0, Progress("quiet"))
    if film is None:
        return FoundError(f"{video.path.name} ends before frame {first}; choose an earlier --from")
    if not (film.enough or film.cut):
        least = fewest(video.fps / step) * step
        return FoundError(f"nobody can be found in fewer than {least} frames; mark the joints of one frame")
    if how.facing is not None and people(video, Progress("quiet"), first, how.stop):
        return FoundError(f"who walks through the film does not face {how.facing}; leave out --facing")
    place = spot(film.stage(1)) if film.enough else None
    if place is None:
        return FoundError("nobody was found who walks through the film; mark the joints of one frame")
    figure, frame = seen_figure(), first + place.frame * step
    joints = place.joints(figure, Cycles.load(), towards(how.facing) or 1)
    return FoundError(
        "nobody goes through the film, but somebody may move on the spot, as on a treadmill or before a "
        f"camera that goes along; mark the joints of frame {frame}",
        {frame: marked(figure, joints)},
    )


def _doubted(one: Person) -> str:
    """Why a person is no reliable start, and what to do besides marking; "" if the person is reliable."""
    if one.turned < TURNED and not one.given:
        return f"it is not sure which way the figure faces in frame {one.frame}; give --facing, or "
    wrong = objections(one.figure, points(marks_of(one)), one.facing)
    if one.spread > DOUBTED:
        wrong = [*wrong, "much that stands out is not covered by the figure"]
    return f"the pose found in frame {one.frame} may be wrong: {'; '.join(wrong)}; " if wrong else ""
