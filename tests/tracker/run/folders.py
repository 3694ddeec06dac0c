"""A complete run as far as folders tell, and one that is written there."""

from tracker.run.folder import fresh_folder


def complete_run(path):
    path.mkdir(parents=True)
    (path / "run.json").write_text('{"figtrack": "0"}')
    (path / "pose.csv").write_text("old")


def write_run_into(path, *, overwrite=False, inputs=(), text="new", meanwhile=None, failure=None):
    with fresh_folder(path, overwrite=overwrite, inputs=inputs) as aside:
        (aside / "run.json").write_text('{"figtrack": "0"}')
        if meanwhile is not None:
            meanwhile()
        if failure is not None:
            raise failure
        (aside / "pose.csv").write_text(text)


def names(folder):
    return sorted(path.name for path in folder.iterdir())
