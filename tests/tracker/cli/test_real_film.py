"""The demo on a real film: what is fetched, what is kept of it, and what happens without a network."""

import hashlib
import subprocess
import webbrowser
import zipfile
from pathlib import Path

import pytest

from tests.tracker.clips import read_json, succeeds
from tracker.cli import demo
from tracker.cli.demo import FILM, LICENCE, PACKAGE, SHA256, FilmError, fetch
from tracker.clip.again import read_finished
from tracker.run.folder import fresh_folder


@pytest.fixture
def package(film, monkeypatch):
    """A package with a film of a walk in it, as pip would leave it; gives what pip was asked for."""
    asked = []

    def pip(command, **_):
        asked.append(command)
        asked.append(Path(command[command.index("--requirement") + 1]).read_text(encoding="utf-8"))
        with zipfile.ZipFile(f"{command[command.index('--dest') + 1]}/package.whl", "w") as wheel:
            wheel.write(film, FILM)
            wheel.writestr(LICENCE, "a licence")
            wheel.writestr("Sports2D/__init__.py", "raise SystemExit")
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(demo.subprocess, "run", pip)
    return asked


def test_one_package_is_fetched_by_its_checksum_and_only_its_film_and_licence_are_kept(
    film, package, tmp_path
):
    folder = tmp_path / "out"
    folder.mkdir()
    kept = fetch(folder)
    command, wanted = package
    assert wanted == f"{PACKAGE} --hash=sha256:{SHA256}\n"
    assert len(SHA256) == hashlib.sha256().digest_size * 2
    assert {"--no-deps", "--require-hashes"} <= set(command)
    assert kept.read_bytes() == film.read_bytes()
    assert {path.name for path in folder.iterdir()} == {"demo.mp4", "demo.LICENSE.txt"}


@pytest.mark.whole
def test_it_is_followed_without_a_mark_and_said_whose_it_is(package, tmp_path, monkeypatch):
    monkeypatch.setattr(webbrowser, "get", lambda: pytest.fail("a browser was opened, and nobody sits here"))
    out = tmp_path / "out"
    done = succeeds("demo", "--film", "--out", out, "--quiet")
    assert "Sports2D" in done.stdout
    assert "BSD" in done.stdout
    run = out / "demo-track"
    assert f"open {run / 'report.html'}" in done.stdout
    news = read_json(run / "run.json")
    assert news["start"]["marks"] == "found"
    assert news["video"] == str(out / "demo.mp4")
    job = read_finished(run).job  # which `correct` follows again in the run's place
    with fresh_folder(run, overwrite=True, inputs=[job.video]) as aside:
        assert aside.exists()
    succeeds("demo", "--film", "--out", out, "--quiet", "--overwrite")


@pytest.mark.parametrize(
    ("told", "why"),
    [
        ("WARNING: a retry\nERROR: No matching distribution found\n", "No matching distribution found"),
        ("/usr/bin/python: No module named pip", "no pip here"),
    ],
)
def test_without_a_network_it_says_so_and_renders(tmp_path, monkeypatch, told, why):
    failed = subprocess.CompletedProcess([], 1, "", told)
    monkeypatch.setattr(demo.subprocess, "run", lambda *_, **__: failed)
    page = tmp_path / "out" / "report.html"
    monkeypatch.setattr(demo, "run_demo", lambda *_, **__: (page, "a table"))
    done = succeeds("demo", "--film", "--out", tmp_path / "out", "--quiet")
    (warning,) = done.stderr.splitlines()
    assert warning == f"warning: {PACKAGE} cannot be fetched ({why}); a walk is rendered instead"
    assert done.stdout == f"a table\n\nopen {page}\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("package")
def test_a_package_without_the_film_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(demo, "FILM", "elsewhere.mp4")
    (out := tmp_path / "out").mkdir()
    with pytest.raises(FilmError, match="has no film where it was"):
        fetch(out)
    assert list(out.iterdir()) == []
