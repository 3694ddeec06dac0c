"""The requests of the marking page.

No answer depends on a path from the client: only the files given to the command are read and written.
"""

from http import HTTPStatus

from tracker.annotate.loopback import LoopbackHandler, LoopbackServer, RefusalError, nothing_here
from tracker.annotate.session import MarksRequest, Session
from tracker.report.document import Document

SCRIPTS = ("asking", "marks", "picture", "film", "figure", "side", "saving", "page")
PAGE = Document(
    "annotate/page.html",
    ("annotate/base.css", "annotate/style.css"),
    tuple(f"annotate/{name}.js" for name in SCRIPTS),
)


class Server(LoopbackServer):
    """Serves one session."""

    def __init__(self, session: Session, port: int = 0) -> None:
        super().__init__(Handler, port, session.command)
        self.session = session


class Handler(LoopbackHandler):
    """Answers one request."""

    server: Server

    def get(self, what: str) -> None:
        """Send the page, its frames, or the progress of following."""
        session = self.server.session
        kind, slash, index = what.partition("/")
        if what == "":
            self.answer_page(PAGE, session.opening())
        elif slash and kind in ("frame", "quick"):
            self.answer(session.frame(_index(index), quick=kind == "quick"))
        elif what == "following" and (now := session.following()):
            self.answer(now)
        else:
            raise nothing_here()

    def post(self, what: str) -> None:
        session = self.server.session
        if what == "check":
            self.answer(session.check(self.body(MarksRequest)))
        elif what == "save":
            reply = session.save(self.body(MarksRequest))
            self.answer(reply)
            if reply["closed"]:
                self.server.shutdown()
        elif what == "follow" and (begun := session.follow(self.body(MarksRequest))):
            self.answer(begun)
        else:
            raise nothing_here()


def _index(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 10):
        raise RefusalError(HTTPStatus.NOT_FOUND, f"a frame is a whole number from 0; got {text!r}")
    return int(text)
