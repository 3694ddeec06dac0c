"""Reports of made-up walks whose films tell the frame shown, and what a person does with one that is open."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.kinematics.figures import WALKER
from tests.tracker.strolls import stroll
from tracker.clip.follow import Run
from tracker.clip.job import Job
from tracker.gait.figures import gait_of
from tracker.report.chapter import Chapter
from tracker.report.page import write_comparison, write_report
from tracker.run.read import FILM
from tracker.run.score import Score
from videos.playable import Playable
from videos.writer import Writer

FPS, SECONDS, SIZE = 30.0, 2.0, (320, 240)
STEP = 4  # grey levels from one frame of a clip to the next
HIP = WALKER.index("hip_near")

SCORE = Score(
    first_failure_frame=None,
    frames_followed=9,
    truth_frames=9,
    mean_error_leg=0.04567,
    median_error_leg=0.0312,
    pck_02_leg=0.987,
    swaps=0,
    angle_median_deg=1.44,
    frame_errors={1: 0.04, 2: 0.05},
    mark_errors=(0.03,),
    link_errors=(1.0,),
)

# What the first clip shows: its middle pixel, red.
SHOWN = """(() => {{
  const clip = document.querySelectorAll('video')[{clip}];
  const canvas = document.createElement('canvas');
  canvas.width = clip.videoWidth;
  canvas.height = clip.videoHeight;
  const context = canvas.getContext('2d', {{ willReadFrequently: true }});
  context.drawImage(clip, 0, 0);
  return clip.seeking ? -1 : context.getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data[0];
}})()"""


def chapter(track=None, video="walk.mp4", rate=1.0, given=False, **changes):
    track = stroll() if track is None else track
    job = Job(Path(video), {}, rate=rate if given else None)
    run = Run(job, 0, job.settings, track, 30.0, len(track), (640, 360), rate, {}, [])
    return replace(Chapter("walk-run", run, gait_of(track), []), **changes)


def write_clip(path, times, start=0.0):
    """A clip whose frames tell their number by how bright they are, the first of them shown at `start`."""
    with Writer(path, FPS, SIZE, crf=10) as writer:
        for early in np.arange(0.0, start - 1e-6, 1.0 / FPS):
            writer.write(np.full((SIZE[1], SIZE[0], 3), 255, np.uint8), float(early))
        for t, time in enumerate(times):
            writer.write(np.full((SIZE[1], SIZE[0], 3), STEP * t, np.uint8), float(start + time))
    return Playable(path, start, SIZE)


class Report:
    """A report that is open in the browser, and what a person does with it."""

    def __init__(self, browser, path, **window):
        self.browser = browser
        browser.open(path.as_uri(), **window)
        browser.wait("[...document.querySelectorAll('video')].every(clip => clip.readyState >= 2)")

    def shows(self, frame, first=0):
        """Until every clip, the figure on it, the slider, the cursor and the words are at this frame."""
        for clip in range(self.browser.value("document.querySelectorAll('video').length")):
            self.browser.wait(f"Math.abs({SHOWN.format(clip=clip)} - {STEP * (first + frame)}) < {STEP / 2}")
            self.browser.wait(f"document.querySelectorAll('.screen svg')[{clip}].dataset.frame === '{frame}'")
        self.browser.wait(f"document.querySelector('#frame').value === '{frame}'")
        self.browser.wait(f"document.querySelector('#where').innerText.startsWith('frame {first + frame} ')")

    def cursor(self):
        """Where the cursor is, as a share of a chart's width."""
        return self.browser.value(
            "(() => {const box = document.querySelector('.panel .chart').getBoundingClientRect();"
            "const line = document.querySelector('.panel .cursor').getBoundingClientRect();"
            "return (line.x - box.x - 1) / (box.width - 1)})()"
        )

    def slide(self, frame):
        self.browser.value(
            "(() => {const slider = document.querySelector('#frame');"
            f"slider.value = {frame}; slider.dispatchEvent(new Event('input'))}})()"
        )

    def span(self, seconds):
        """Choose how much of the curves is seen."""
        self.browser.value(
            "(() => {const choice = document.querySelector('.spans select');"
            f"choice.value = '{seconds}'; choice.dispatchEvent(new Event('change'))}})()"
        )

    def go(self, frame, first=0):
        self.slide(frame)
        self.shows(frame, first)

    def values(self, panel):
        return self.browser.value(
            f"[...document.querySelectorAll('article:not([hidden]) .panel')[{panel}]"
            ".querySelectorAll('.value')].map(value => value.textContent)"
        )


def made(folder, track=None, start=0.0, **changes):
    """A run's page beside its film, which shows the first frame at `start`."""
    track = stroll(SECONDS) if track is None else track
    path = folder / "report.html"
    write_report(path, chapter(track, **changes), write_clip(folder / FILM, track.times, start))
    return path


def compared(folder):
    """A comparison's page beside its film."""
    tracks = {
        name: stroll(SECONDS, swings=(swing, swing)) for name, swing in (("walk-run", 0.5), ("cv", 0.3))
    }
    chapters = [chapter(track, name=name) for name, track in tracks.items()]
    film = write_clip(folder / FILM, tracks["cv"].times[:60])
    sheet = folder / "failure.png"
    sheet.write_bytes(
        bytes.fromhex(
            "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c489"
            "0000000d49444154789c6360606060000000050001a5f645400000000049454e44ae426082"
        )
    )
    scores = {"walk-run": SCORE, "cv": replace(SCORE, first_failure_frame=2)}
    path = folder / "report.html"
    write_comparison(path, film, chapters, scores, sheet, ["A note."])
    return path
