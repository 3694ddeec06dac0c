"""A marking session, from the command's options to the printed result."""

from pathlib import Path
from threading import Thread

from kinematics.figure import Figure
from kinematics.figure_file import load_figure
from tracker.annotate.marks import Table
from tracker.annotate.server import Server
from tracker.annotate.session import Session
from tracker.annotate.wanted import Request
from tracker.clip.job import towards
from tracker.progress import Progress, counted
from tracker.run.folder import check_file
from videos.container import VideoError

POLL = 0.1  # seconds between looks at whether the page was closed


def mark(request: Request, progress: Progress) -> None:
    """Serve the page until it is closed or Ctrl-C is pressed, and print the result.

    VideoError, KeypointsError, ForeignError, FolderError: a file or port that cannot be used.
    KeyboardInterrupt: nothing was saved.
    """
    check_file(request.table, overwrite=True, inputs=[request.video, request.source])
    figure = load_figure(request.figure)
    table = Table(request.table, overwrite=request.overwrite, figure=figure)
    first, facing = request.frame, towards(request.facing)
    marked = 0 if request.source else min(table.marks, default=0)  # what is taken opens its own frame
    session = Session(request.video, table, marked if first is None else first, facing, request.figure)
    if request.source is not None:
        from tracker.foreign.start_marks import read_start  # slow to import

        taken = read_start(request.source, first, facing, figure=figure)
        session.start_from(taken)
        print(taken.told)
    with Server(session, request.port) as server:
        if session.taken is None and not table.marks and not request.empty and figure.outline:
            _suggest(request, session, figure, progress)
        _serve(server, "mark the joints", not request.no_browser)
    print(f"{counted(len(table.marks), 'frame')} marked in {table.path}")
    print(f"next: {session.next_command()}")


def correct(folder: Path, frame: int | None, port: int, browser: bool, progress: Progress) -> None:
    """Serve the page of a finished run, at the given frame or the start frame; `port` is 0 for any free one.

    RunError, VideoError, FolderError: a folder or file that cannot be used, or the port is taken.
    KeyboardInterrupt: nothing was saved.
    """
    from tracker.annotate.correction import Correction  # slow to import

    session = Correction(folder, frame, progress)
    with Server(session, port) as server:
        _serve(server, f"correct {folder}", browser)
    print(session.ending())


def _serve(server: Server, what: str, browser: bool) -> None:
    """Answer the page's requests until it is closed; long work runs in this thread."""
    session = server.session
    answers = Thread(target=server.serve_forever, kwargs={"poll_interval": POLL}, daemon=True)
    try:
        answers.start()  # before the address is shown, so that no interrupt comes while it starts
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


def _suggest(request: Request, session: Session, figure: Figure, progress: Progress) -> None:
    """Open the page with a suggestion, if there is one for the requested frame."""
    from tracker.annotate.suggestion import suggested

    taken = suggested(request.video, request.table, figure, towards(request.facing), progress)
    if taken is None:
        print("nobody was found who walks through the film; the page opens without marks")
    elif request.frame not in (None, taken.frame):
        print(f"frame {taken.frame} has a suggestion, frame {request.frame} has none")
    else:
        try:
            session.start_from(taken)
        except VideoError as error:  # left by another film of this name
            print(f"the page opens without a suggestion: {error}")
        else:
            print(taken.told)
