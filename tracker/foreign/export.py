"""A run's folder as the file of another program."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from tracker.foreign import dlc, mot, myogait, openpose, trc
from tracker.foreign.points import ARMS, HALPE, JOINTS, named_points, near_far, of_people
from tracker.foreign.scale import Scale, scale_by_height, scale_by_pixels, scale_by_points
from tracker.foreign.text_files import ForeignError
from tracker.progress import Progress
from tracker.run.folder import check_file, check_folder, fresh_file, fresh_folder, swept
from tracker.run.read import RUN_FILES, Record, read_run

PIXELS = "_px"  # required by Sports2D in the name of a file in pixels


@dataclass(frozen=True)
class Wish:
    """How to export a run.

    to     : a name in FORMATS
    height : of the person, metres; or
    points : x1, y1, x2, y2 in pixels and the metres between them; without both the run's scale
    facing : +1 right, -1 left, None for that of the run
    """

    to: str
    height: float | None = None
    points: tuple[float, float, float, float, float] | None = None
    facing: int | None = None


def export_run(folder: Path, wish: Wish, out: Path, *, overwrite: bool, progress: Progress) -> str:
    """Write the run as `out`, a folder for OpenPose and a file for the others; returns a line with the file's
    name and what it lacks.

    RunError: no complete run in the folder, or one in which the figure was followed in no frame.
    ForeignError: the format needs something that run and wish lack. FolderError: a place that cannot be
    written, or one that is taken.
    """
    if not FORMATS[wish.to].scaled and (wish.height is not None or wish.points is not None):
        raise ForeignError(f"{wish.to} has no place for a height or a scale, it is in pixels; leave them out")
    if wish.to == "openpose":
        ours = openpose.holds_frames
        place = fresh_folder(out, overwrite=overwrite, inputs=[folder], replaceable=ours)
    else:
        place = fresh_file(out, overwrite=overwrite, inputs=[folder / name for name in RUN_FILES])
    with place as aside, progress.task(f"{folder.name} for {wish.to}", 2) as advance:
        record = read_run(folder)
        if FORMATS[wish.to].people and not of_people(record):
            raise ForeignError(
                f"{wish.to} has places for people's joints alone, which this run's figure has not; "
                "--to dlc takes any figure"
            )
        advance()
        said = FORMATS[wish.to].write(record, wish, wish.facing or record.facing, aside)
        advance()
    return f"wrote {out} from {folder}{f'; {said}' if said else ''}"


def export_all(folder: Path, wish: Wish, *, overwrite: bool, progress: Progress) -> list[str]:
    """Write the run in every format under its usual name; returns a line for each, also for those that are
    not possible.

    RunError, FolderError: as `export_run`, before anything is written. ForeignError: interrupted after some
    were written; names these.
    """
    places = {to: Path(export_name(folder, to)) for to in FORMATS}
    with swept(places.values()):
        for to, place in places.items():
            if to == "openpose":
                check_folder(place, overwrite, openpose.holds_frames)
            else:
                check_file(place, overwrite)
    lines, written = [], []
    for to, its in FORMATS.items():
        place = places[to]
        of = replace(wish, to=to) if its.scaled else Wish(to, facing=wish.facing)
        try:
            lines.append(export_run(folder, of, place, overwrite=overwrite, progress=progress))
            written.append(str(place))
        except ForeignError as error:
            lines.append(f"left out {place}: {error}")
        except KeyboardInterrupt as error:
            if written:
                raise ForeignError(f"interrupted; written are {', '.join(written)}") from error
            raise
    return lines


def export_name(folder: Path, to: str) -> str:
    """The default name of the file or folder."""
    return folder.resolve().name + FORMATS[to].ending


@dataclass(frozen=True)
class Format:
    """Ending and writer of a format's files; the writer returns a remark for the user, if any.

    scaled : whether it uses a scale
    people : whether it has names for people's joints only
    """

    ending: str
    write: Callable[[Record, Wish, int, Path], str | None]
    scaled: bool = False
    people: bool = True


def _dlc(record: Record, wish: Wish, facing: int, path: Path) -> None:
    names = {name: name for name in record.names}
    if of_people(record):
        known = JOINTS | ARMS
        taken = {near_far(joint, facing) for joint in known.values()}
        names = known | {name: name for name in names if name not in taken}
    dlc.write_dlc(named_points(record, names, facing), path)


def _trc(record: Record, wish: Wish, facing: int, path: Path) -> None:
    scene = record.in_scene()
    scale = _scale(scene, wish, facing)
    if scale is None:
        raise ForeignError(
            "a TRC is in metres, and the run knows no height; give --height METRES of the person, "
            "or --scale-points x1,y1,x2,y2,METRES"
        )
    trc.write_trc(named_points(scene, HALPE | ARMS, facing), record.times, record.news.fps, scale, path)


def _sports2d(record: Record, wish: Wish, facing: int, path: Path) -> None:
    if PIXELS not in path.name:
        raise ForeignError(
            f"Sports2D takes a file in pixels only with {PIXELS!r} in its name; got {path.name}"
        )
    trc.write_trc(named_points(record, HALPE | ARMS, facing), record.times, record.news.fps, None, path)


def _mot(record: Record, wish: Wish, facing: int, path: Path) -> str:
    scene = record.in_scene()
    return mot.write_mot(scene, facing, _scale(scene, wish, facing), path)


def _openpose(record: Record, wish: Wish, facing: int, path: Path) -> None:
    prefix = Path(record.news.video).stem or "frame"
    openpose.write_openpose(named_points(record, openpose.NAMES | ARMS, facing), path, prefix)


def _myogait(record: Record, wish: Wish, facing: int, path: Path) -> None:
    if record.news.size is None:
        raise ForeignError("run.json does not say how large a frame is; track the clip again")
    if wish.points is not None:
        raise ForeignError("myogait takes the person's height and no other scale; give --height METRES")
    myogait.write_myogait(record, record.news.size, facing, wish.height or record.news.height, path)


FORMATS = {
    "dlc": Format(".dlc.csv", _dlc, people=False),
    "trc": Format(".trc", _trc, scaled=True),
    "mot": Format(".mot", _mot, scaled=True),
    "sports2d": Format(f"{PIXELS}.trc", _sports2d),
    "openpose": Format("-openpose", _openpose),
    "myogait": Format(".myogait.json", _myogait, scaled=True),
}


def _scale(record: Record, wish: Wish, facing: int) -> Scale | None:
    if wish.points is not None:
        return scale_by_points(record, wish.points, facing)
    if wish.height is None and record.news.scale is not None:
        return scale_by_pixels(record, record.news.scale, facing)
    tall = wish.height or record.news.height
    return None if tall is None else scale_by_height(record, tall, facing)
