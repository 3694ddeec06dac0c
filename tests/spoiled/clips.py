"""Clips and the marks on them."""

import struct
import zlib

import numpy as np

from tests.spoiled.case import HUGE, Case, cases, refusals
from tests.spoiled.spoil import (
    copied,
    cut,
    edited,
    emptied,
    encoded,
    flipped,
    folder_instead,
    linked,
    removed,
    replaced,
    separated,
    written,
)
from tests.spoiled.stock import FOLLOWED
from tests.videos.clips import joined
from videos.frames import Video

JPEG = b"\xff\xd8\xff\xe0\x00\x10JFIF\x00\x01\x01\x00\x00\x01\x00\x01\x00\x00" + bytes(100)
NOISE = np.random.default_rng(1).bytes(5000)


def _chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


# A PNG whose header, which is right in itself, announces 60000 x 60000 pixels.
LARGE = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0))


def doubled(path):
    """A recording and once more the same, joined as `cat` does."""
    images = [frame.image for frame in Video(path)]
    joined(path, [images, images])


VIDEO = [
    *cases(
        "track",
        "walk.mp4",
        ("absent", removed, "no video at walk.mp4"),
        ("cut before its index", cut(0.5), "walk.mp4"),
        ("is text", written("My video\n" * 99), "walk.mp4"),
        ("is a table", copied("marks.csv"), "walk.mp4"),
        ("is zeros", written(bytes(9999)), "walk.mp4"),
        ("is noise", written(NOISE), "walk.mp4"),
        ("is a broken picture", written(LARGE[:16] + bytes(200)), "walk.mp4"),
        ("is a link to nowhere", linked("gone.mp4"), "walk.mp4"),
        ("is a folder without images", folder_instead, "no numbered images"),
        ("is a device", linked("/dev/null"), "walk.mp4"),
        ("has a header alone", cut(0.01), "walk.mp4"),
    ),
    *cases("compare", "walk.mp4", ("cut", cut(0.3), "walk.mp4")),
    *cases(
        "annotate", "walk.mp4", ("cut", cut(0.3), "walk.mp4"), ("absent", removed, "no video at walk.mp4")
    ),
    *cases("correct", "run/run.json", ("cut", cut(0.5), "is no run of figtrack")),
    *cases("correct", "run/start.keypoints.csv", ("absent", removed, "does not say how it was made")),
    *refusals(
        ("video's name has a line break", f"track 'no\nwalk.mp4' {FOLLOWED}", "no video at no"),
        ("video's name rings the bell", f"track 'no\a\x1b[2J.mp4' {FOLLOWED}", "no video at no"),
        ("video's name is too long", f"track {'w' * 300}.mp4 {FOLLOWED}", "www.mp4"),
        ("video's name is beyond ASCII", f"track 走る.mp4 {FOLLOWED}", "no video at 走る.mp4"),
    ),
    Case("joined", "track", "warning: one time of frames in walk.mp4", doubled, "walk.mp4", exit=0),
    Case("cut after its first frame", "track", "warning: walk.mp4 ends after", cut(0.75), "walk.mp4", exit=0),
    *cases(
        "track images",
        "images/1.png",
        ("empty", emptied, "images/1.png"),
        ("cut", cut(), "images/1.png"),
        ("has a flipped bit", flipped(3, 5), "images/1.png"),
        ("is a folder", folder_instead, "images/1.png"),
        ("is text", written("no picture"), "images/1.png"),
        ("is a broken JPEG", written(JPEG), "images/1.png"),
        ("is of 3600 megapixels", written(LARGE), "images/1.png"),
    ),
]

MARKS = [
    *cases(
        "track",
        "marks.csv",
        ("of other columns", replaced("keypoint", "joint"), "column 'keypoint' is missing"),
        ("with a header alone", replaced(r"(?s)\n.*", "\n"), "has no marked joints"),
        ("are a video", copied("walk.mp4"), "marks.csv as a UTF-8 CSV table"),
        ("in Latin-1", encoded("latin-1"), "marks.csv as a UTF-8"),
        ("with semicolons", separated(b";"), "semicolon"),
        ("with tabs", separated(b"\t"), "tabs"),
        ("with NUL bytes", edited(lambda data: data.replace(b"hip", b"h\0p")), "marks.csv"),
        ("cut in a row", cut(0.9), "marks.csv"),
        ("cut in the header", cut(0.02), "column"),
        ("in one endless cell", written("frame,keypoint,x,y\n" + "9" * 200_000), "marks.csv"),
        ("with a decimal comma", replaced(r"hip,(\d+)\.", r"hip,\1,"), "marks.csv line"),
        ("with a word", replaced(r"hip,[\d.]+", "hip,left"), "line 4: x must be a finite number"),
        ("with no number", replaced(r"hip,[\d.]+", "hip,nan"), "line 4: x must be a finite number"),
        ("with infinity", replaced(r"hip,[\d.]+", "hip,inf"), "line 4: x must be a finite number"),
        ("that are huge", replaced(r"hip,[\d.]+", "hip,1e308"), "marks.csv line"),
        ("of a huge frame", replaced(r"(?m)^0,", f"{HUGE},", 0), "marks.csv line"),
        ("of a frame past the end", replaced(r"(?m)^0,", "900,", 0), "frame 900 is not in walk.mp4, which"),
        ("of a frame below 0", replaced(r"0,hip", "-1,hip"), "frame must be a whole"),
        ("of half a frame", replaced(r"0,hip", "0.5,hip"), "frame must be a whole"),
        ("of an unknown joint", replaced("near_knee", "kneecap"), "line 5: unknown joint 'kneecap'"),
        (
            "of a joint twice",
            replaced("far_knee", "near_knee"),
            "line 8: near_knee of frame 0 is marked twice",
        ),
        ("without a hip", replaced(".*hip.*\n", ""), "the start pose lacks hip; mark hip, neck"),
        ("without a knee", replaced(".*near_knee.*\n", ""), "the start pose lacks near_knee"),
        ("all at one place", replaced(r",[\d.]+,[\d.]+,", ",50,50,", 0), "mark the two apart"),
        ("far outside", replaced(r",([\d.]+),", r",9\1,", 0), "outside the picture"),
    ),
    *cases(
        "track --anchors",
        "marks.csv",
        ("with an anchor far outside", edited(lambda data: data + b"2,hip,1e300,1e300,1\n"), "line"),
    ),
    *cases(
        "compare",
        "truth.csv",
        ("absent", removed, "no keypoints file truth.csv"),
        ("of other frames", replaced(r"(?m)^(\d),", r"7\1,", 0), "truth"),
        ("huge", replaced(r"hip,[\d.]+", "hip,-1e300", 0), "truth.csv line"),
    ),
    *cases(
        "annotate",
        "marks.csv",
        ("in UTF-16", encoded("utf-16"), "start anew with --overwrite"),
        ("cut", cut(0.9), "start anew with --overwrite"),
        ("are a folder", folder_instead, "marks.csv is a folder"),
    ),
]
