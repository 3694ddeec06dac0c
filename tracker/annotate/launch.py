"""A marking session from the command's options to its last line."""

from pathlib import Path
from threading import Thread

from kinematics.figure_file import load_figure
from tracker.annotate.correction import Correction
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import Session
from tracker.annotate.wanted import Request
from tracker.clip.asked import suggestion_path
from tracker.clip.found import TURNED, people
from tracker.clip.job import towards
from tracker.clip.naming import marks_of, nearer, sure_of_leg
from tracker.foreign.start_marks import Taken, read_start
from tracker.outline.person import Person
from tracker.progress import Progress
from tracker.run.folder import FolderError
from tracker.tables.keypoints import read_keypoints
from videos.frames import Video

POLL = 0.1  # seconds between looks at whether the page was closed
CHECK = "check every joint, and which leg is nearer"
UNSURE = " (not sure)"


def mark(request: Request, progress: Progress) -> None:
    """Serve the page until it is closed or Ctrl-C is pressed, and say what came of it.

    Raises:
        VideoError, KeypointsError, ForeignError, FolderError: a file or port that cannot be had.
        KeyboardInterrupt: nothing was saved.
    """
    for given in (request.video, request.source):
        if given is not None and given.exists() and request.table.exists() and given.samefile(request.table):
            raise FolderError(f"{given} is what the work reads; choose another --out")
    figure = load_figure(request.figure)
    table = Table(request.table, overwrite=request.overwrite, figure=figure)
    taken, facing = None, towards(request.facing)
    if request.source is not None:
        taken = read_start(request.source, request.frame, facing, figure=figure)
        print(taken.told)
    marked = min(table.marks, default=0)
    first = request.frame if request.frame is not None else taken.frame if taken else marked
    session = Session(request.video, table, first, taken, facing, request.figure)
    with Server(session, request.port) as server:
        if taken is None and not table.marks and not request.empty and figure.outline:
            _suggest(request, session, progress)
        _serve(server, "mark the joints", not request.no_browser)
    frames = "1 frame" if len(table.marks) == 1 else f"{len(table.marks)} frames"
    print(f"{frames} marked in {table.path}")
    print(f"next: {session.next_command()}")


def correct(folder: Path, frame: int | None, port: int, browser: bool, progress: Progress) -> None:
    """Serve the page of a finished run, of the frame that it started from unless told; `port` is 0 for any
    that is free.

    Raises:
        RunError, VideoError, FolderError: a folder or file that cannot be used, or the port is taken.
        KeyboardInterrupt: nothing was saved.
    """
    session = Correction(folder, frame, progress)
    with Server(session, port) as server:
        _serve(server, f"put {folder} right", browser)
    print(session.ending())


def _serve(server: Server, what: str, browser: bool) -> None:
    """Answer the page, and do in this thread what it asks for that takes a while, until it is closed."""
    session = server.session
    answers = Thread(target=server.serve_forever, kwargs={"poll_interval": POLL}, daemon=True)
    try:
        answers.start()  # before anybody knows the address, or an interrupt may come while it starts
        print(f"{what} at {server.address}")
        print("this ends with 'Save and close' on the page, or Ctrl-C here", flush=True)
        if browser:
            server.show()
        while answers.is_alive():
            session.work(POLL)
    except KeyboardInterrupt:
        if not session.saved:
            raise
        print("stopped; what was not saved is gone")
    finally:
        if answers.is_alive():
            server.shutdown()


def _suggest(request: Request, session: Session, progress: Progress) -> None:
    """Let the page open with a suggestion, if there is one of the frame that is asked for."""
    taken = suggested(request.video, session.table, progress)
    if taken is None:
        print("nobody was found who walks through the film; the page opens without marks")
    elif request.frame not in (None, taken.frame):
        print(f"frame {taken.frame} has a suggestion, frame {request.frame} has none")
    else:
        session.start_from(taken)
        print(taken.told)


def suggested(video: Path, table: Table, progress: Progress) -> Taken | None:
    """What 'figtrack track' left beside the table, else the surest person in the film; None for nobody.
    KeypointsError: what was left is no table; VideoError: the video cannot be read."""
    left = suggestion_path(table.path.parent, video)
    if left.exists():
        marks = read_keypoints(left)
        frame = min(marks)
        return Taken(frame, marks[frame], f"frame {frame} has the suggestion of {left.name}: {CHECK}")
    everybody = people(Video(video), progress)
    if not everybody:
        return None
    one = everybody[0]
    return Taken(one.frame, marks_of(one), _told(one, len(everybody)))


def _told(one: Person, people: int) -> str:
    who = "who walks" if people == 1 else f"the surest of {people} people who walk"
    way = "right" if one.facing > 0 else "left"
    return (
        f"frame {one.frame} has a suggestion, {who} through the film: "
        f"faces {way}{'' if one.turned >= TURNED else UNSURE}, "
        f"the near leg {nearer(one)}{'' if sure_of_leg(one) else UNSURE}; {CHECK}"
    )
