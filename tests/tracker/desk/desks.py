"""A desk that runs, a client that asks it, and a run's folder for it to show."""

import json
import threading
from contextlib import contextmanager

from tests.tracker.annotate.clients import Client
from tracker.desk.desk_page import Desk, Server

CLIP = bytes(range(256)) * 40


class DeskClient(Client):
    def shown(self, file, **headers):
        """Status, headers and body of a file of the film's run."""
        return self.ask("GET", f"run/walk.mp4/{file}", key=self.server.shown, **headers)


@contextmanager
def served(folder):
    """A client of a desk that runs."""
    with Server(Desk(folder, browser=False)) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield DeskClient(server)
        server.shutdown()
        server.desk.stop()


def a_run(folder, **news):
    """A run's folder as far as the desk reads it."""
    run = folder / "walk-track"
    run.mkdir()
    told = {"figtrack": "0", "video": "walk.mp4", "fps": 25, "frames": 27, "facing": "right"}
    (run / "run.json").write_text(json.dumps(told | news))
    (run / "report.html").write_text("<p>a report")
    (run / "film.mp4").write_bytes(CLIP)
    return run


def state(client):
    return client.get("state")[1]
