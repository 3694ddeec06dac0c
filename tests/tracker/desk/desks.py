"""A run's folder for a desk to show, and what the desk tells of it."""

import json

CLIP = bytes(range(256)) * 40


def a_run(folder, **news):
    """A run's folder as far as the desk reads it."""
    run = folder / "walk-track"
    run.mkdir(exist_ok=True)
    told = {"figtrack": "0", "video": "walk.mp4", "fps": 25, "frames": 27, "facing": "right"}
    (run / "run.json").write_text(json.dumps(told | news))
    (run / "report.html").write_text("<p>a report")
    (run / "film.mp4").write_bytes(CLIP)
    return run


def state(client):
    return client.get("state")[1]


def shown(client, file, **headers):
    """Status, headers and body of a file of the film's run."""
    return client.ask("GET", f"run/walk.mp4/{file}", key=client.server.shown, **headers)
