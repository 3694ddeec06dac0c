"""All spoiled inputs."""

from tests.spoiled.clips import MARKS, VIDEO
from tests.spoiled.every import EVERY
from tests.spoiled.motions import CAPTURES, MODELS, POSES, SETTINGS
from tests.spoiled.others import JOBS, RUNS, SOURCES
from tests.spoiled.places import NAMES, OPTIONS, PLACES

CASES = [
    *VIDEO,
    *MARKS,
    *SETTINGS,
    *MODELS,
    *POSES,
    *CAPTURES,
    *RUNS,
    *JOBS,
    *SOURCES,
    *OPTIONS,
    *PLACES,
    *NAMES,
    *EVERY,
]
