"""Clips and the marks on them."""

import struct
import zlib

from tests.spoiled.case import HUGE, Case
from tests.spoiled.spoil import (
    copied,
    cut,
    edited,
    emptied,
    encoded,
    flipped,
    folder_instead,
    linked,
    nothing,
    removed,
    replaced,
    written,
)
from tests.spoiled.stock import FOLLOWED

JPEG = b"\xff\xd8\xff\xe0\x00\x10JFIF\x00\x01\x01\x00\x00\x01\x00\x01\x00\x00" + bytes(100)


def _chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


# A PNG whose header, which is right in itself, announces 60000 x 60000 pixels.
LARGE = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0))

VIDEO = [
    Case("video absent", "track", removed("walk.mp4"), "no video at walk.mp4"),
    Case("video empty", "track", emptied("walk.mp4"), "walk.mp4 is empty (0 bytes)"),
    Case("video cut before its index", "track", cut("walk.mp4", 0.5), "walk.mp4"),
    Case("video is text", "track", written("walk.mp4", "My video\n" * 99), "walk.mp4"),
    Case("video is a table", "track", copied("marks.csv", "walk.mp4"), "walk.mp4"),
    Case("video is zeros", "track", written("walk.mp4", bytes(9999)), "walk.mp4"),
    Case("video is a link to itself", "track", linked("walk.mp4", "walk.mp4"), "walk.mp4"),
    Case("video is a link to nowhere", "track", linked("walk.mp4", "gone.mp4"), "walk.mp4"),
    Case("video is a folder without images", "track", folder_instead("walk.mp4"), "no numbered images"),
    Case("video is a device", "track", linked("walk.mp4", "/dev/null"), "walk.mp4"),
    Case("video has a header alone", "track", cut("walk.mp4", 0.01), "walk.mp4"),
    Case("video for compare is cut", "compare", cut("walk.mp4", 0.3), "walk.mp4"),
    Case("video for the page is cut", "annotate", cut("walk.mp4", 0.3), "walk.mp4"),
    Case("video for the page is absent", "annotate", removed("walk.mp4"), "no video at walk.mp4"),
    Case("video's name has a line break", f"track 'no\nwalk.mp4' {FOLLOWED}", nothing, "no video at no"),
    Case("video's name rings the bell", f"track 'no\a\x1b[2J.mp4' {FOLLOWED}", nothing, "no video at no"),
    Case("video's name is too long", f"track {'w' * 300}.mp4 {FOLLOWED}", nothing, "www.mp4"),
    Case("video's name is beyond ASCII", f"track 走る.mp4 {FOLLOWED}", nothing, "no video at 走る.mp4"),
    Case(
        "video cut after its first frame",
        "track",
        cut("walk.mp4", 0.75),
        "warning: walk.mp4 ends after",
        exit=0,
    ),
    Case("image is empty", "track images", emptied("images/1.png"), "images/1.png"),
    Case("image is cut", "track images", cut("images/1.png"), "images/1.png"),
    Case("image has a flipped bit", "track images", flipped("images/1.png", 3, 5), "images/1.png"),
    Case("image is text", "track images", written("images/2.png", "no picture"), "images/2.png"),
    Case("image is a broken JPEG", "track images", written("images/2.png", JPEG), "images/2.png"),
    Case("image is of 3600 megapixels", "track images", written("images/2.png", LARGE), "images/2.png"),
    Case("image is a folder", "track images", folder_instead("images/1.png"), "images/1.png"),
]

MARKS = [
    Case("marks absent", "track", removed("marks.csv"), "no keypoints file marks.csv"),
    Case("marks empty", "track", emptied("marks.csv"), "marks.csv is no keypoints table"),
    Case("marks are a folder", "track", folder_instead("marks.csv"), "marks.csv"),
    Case("marks are a video", "track", copied("walk.mp4", "marks.csv"), "marks.csv as a UTF-8"),
    Case("marks in UTF-16", "track", encoded("marks.csv", "utf-16"), "marks.csv as a UTF-8"),
    Case("marks in Latin-1", "track", encoded("marks.csv", "latin-1"), "marks.csv as a UTF-8"),
    Case("marks with semicolons", "track", edited("marks.csv", lambda d: d.replace(b",", b";")), "semicolon"),
    Case("marks with tabs", "track", edited("marks.csv", lambda d: d.replace(b",", b"\t")), "tabs"),
    Case(
        "marks with NUL bytes",
        "track",
        edited("marks.csv", lambda d: d.replace(b"hip", b"h\0p")),
        "marks.csv",
    ),
    Case("marks cut in a row", "track", cut("marks.csv", 0.9), "marks.csv"),
    Case("marks cut in the header", "track", cut("marks.csv", 0.02), "column"),
    Case(
        "marks in one endless cell",
        "track",
        written("marks.csv", "frame,keypoint,x,y\n" + "9" * 200_000),
        "marks.csv",
    ),
    Case(
        "marks with a decimal comma",
        "track",
        replaced("marks.csv", r"hip,(\d+)\.", r"hip,\1,"),
        "marks.csv line",
    ),
    Case(
        "a mark is no number",
        "track",
        replaced("marks.csv", r"hip,[\d.]+", "hip,left"),
        "x must be a finite number",
    ),
    Case(
        "a mark is infinite",
        "track",
        replaced("marks.csv", r"hip,[\d.]+", "hip,inf"),
        "x must be a finite number",
    ),
    Case("a mark is huge", "track", replaced("marks.csv", r"hip,[\d.]+", "hip,1e308"), "marks.csv line"),
    Case(
        "a mark's frame is huge", "track", replaced("marks.csv", r"(?m)^0,", f"{HUGE},", 0), "marks.csv line"
    ),
    Case(
        "a mark's frame is below 0",
        "track",
        replaced("marks.csv", r"0,hip", "-1,hip"),
        "frame must be a whole",
    ),
    Case(
        "a mark's frame is broken",
        "track",
        replaced("marks.csv", r"0,hip", "0.5,hip"),
        "frame must be a whole",
    ),
    Case(
        "a joint nobody knows",
        "track",
        replaced("marks.csv", "near_knee", "kneecap"),
        "unknown joint 'kneecap'",
    ),
    Case("a joint twice", "track", replaced("marks.csv", "near_knee", "far_knee"), "marked twice"),
    Case(
        "all marks at one place",
        "track",
        replaced("marks.csv", r",[\d.]+,[\d.]+,", ",50,50,", 0),
        "mark the two apart",
    ),
    Case(
        "all marks far outside",
        "track",
        replaced("marks.csv", r",([\d.]+),", r",9\1,", 0),
        "outside the picture",
    ),
    Case(
        "an anchor far outside",
        "track",
        edited("marks.csv", lambda d: d + b"2,hip,1e300,1e300,1\n"),
        "line",
        "--anchors",
    ),
    Case("truth absent", "compare", removed("truth.csv"), "no keypoints file truth.csv"),
    Case("truth empty", "compare", emptied("truth.csv"), "truth.csv"),
    Case("truth of other frames", "compare", replaced("truth.csv", r"(?m)^(\d),", r"7\1,", 0), "truth"),
    Case("truth huge", "compare", replaced("truth.csv", r"hip,[\d.]+", "hip,-1e300", 0), "truth.csv line"),
    Case(
        "marks for the page in UTF-16",
        "annotate",
        encoded("marks.csv", "utf-16"),
        "start anew with --overwrite",
    ),
    Case("marks for the page cut", "annotate", cut("marks.csv", 0.9), "start anew with --overwrite"),
    Case("marks for the page are a folder", "annotate", folder_instead("marks.csv"), "marks.csv is a folder"),
]
