"""The page of speed and memory."""

from collections.abc import Mapping
from dataclasses import dataclass

from tests.benchmarks.page import Claim, chapter, claim_table, table, written
from tests.benchmarks.speed.command import LENGTHS, LONG, Command
from tests.benchmarks.speed.measure import FILTER_LIMITS, ROUND_LIMITS, STATES, Timing
from tests.benchmarks.speed.tracking import Cost, Growth
from tracker.clip.job import Job

STRAIGHT = 0.1  # share of the greatest cost by which one may lie beside the line, at most

WHAT = """\
CPU time of one thread; seconds depend on the machine, ratios hardly. Lucas-Kanade is the rival of
[results.md](results.md), reading included."""

COMMAND = f"""\
`figtrack track` as a process, from marks, medians of five runs. Films of {LENGTHS[0]} and {LENGTHS[1]}
frames are the clip played there and back, followed once. `figtrack classify` labels a table of {LONG}
frames."""

STAGES = "The best of three runs in a process that has run before."

GROWTH = "![Milliseconds against hypotheses, and against template points](speed.png)"

FILTERS = f"""\
Times as fast as filterpy's interacting multiple models, a frame of a second-order system of eight freedoms
with {STATES[0]}, {STATES[1]} and {STATES[2]} switching states (microseconds in brackets)."""

ROUNDS = """\
Eighteen sequences of fifty frames, four switching states, beside a Kalman filter and smoother in numpy."""


@dataclass(frozen=True)
class Measured:
    """All that the page tells; filters by the number of switching states."""

    command: Command
    cost: Cost
    hypotheses: Growth
    points: Growth
    filters: Mapping[int, Mapping[str, Timing]]
    rounds: Mapping[str, Timing]


def page(job: Job, measured: Measured) -> str:
    """The whole page, Markdown."""
    return "\n".join(
        [
            *chapter("# Speed", f"{written('bench')}, on {job.video.stem} with {job.model}.", WHAT),
            *chapter("## What is wanted", claim_table(claims(measured))),
            *chapter("## The command", COMMAND, _command(measured.command)),
            *chapter("## A frame by stage", STAGES, _stages(measured.cost)),
            *chapter("## How cost grows", GROWTH),
            *chapter("## Filters", FILTERS, _filters(measured.filters)),
            *chapter("## A round of EM", ROUNDS, _rounds(measured.rounds)),
        ]
    )


def claims(measured: Measured) -> list[Claim]:
    """What speed and memory are to be."""
    cost, command = measured.cost, measured.command
    whole = next(iter(command.ways.values()))
    return [
        Claim("CPU seconds of `figtrack track`, all files", whole.seconds, 6.0),
        Claim("its MB resident", whole.megabytes, 400.0),
        Claim(f"MB resident, {LONG} frames", command.long[-1].megabytes, 400.0),
        Claim("ms of each further frame of a long film", command.milliseconds, 40.0),
        Claim(f"CPU seconds of `figtrack classify`, {LONG} frames", command.classify.seconds, 30.0),
        Claim("its MB resident", command.classify.megabytes, 600.0),
        Claim("frame against Lucas-Kanade's, no survey, no outline", cost.tracked / cost.rival, 1.0),
        Claim("frame against Lucas-Kanade's, with both", cost.whole / cost.rival, 1.5),
        Claim("cost beside a line in hypotheses", measured.hypotheses.astray, STRAIGHT),
        Claim("cost beside a line in template points", measured.points.astray, STRAIGHT),
        *(
            Claim(f"{name} against filterpy, {K} states", 1.0 / table[name].ratio, float("inf"), least)
            for name, limits in FILTER_LIMITS.items()
            for (K, table), least in zip(measured.filters.items(), limits, strict=True)
        ),
        *(
            Claim(f"EM round, {name}", measured.rounds[name].ratio, most)
            for name, most in ROUND_LIMITS.items()
        ),
    ]


def _command(command: Command) -> list[str]:
    rows = [
        *command.ways.items(),
        *((f"{n} frames", used) for n, used in zip(LENGTHS, command.long, strict=True)),
        ("`classify`", command.classify),
    ]
    header = ("files or frames", "CPU seconds", "MB resident at most")
    return table(header, [[name, f"{used.seconds:.1f}", f"{used.megabytes:.0f}"] for name, used in rows])


def _stages(cost: Cost) -> list[str]:
    ends = {"all": cost.whole, "all, without survey and outline": cost.tracked, "Lucas-Kanade": cost.rival}
    rows = (cost.stages | ends).items()
    return table(("stage", "ms a frame"), [[name, f"{spent:.2f}"] for name, spent in rows])


def _filters(filters: Mapping[int, Mapping[str, Timing]]) -> list[str]:
    names = next(iter(filters.values()))
    rows = [
        [name, *(f"{1.0 / of[name].ratio:.1f} ({of[name].microseconds:.0f})" for of in filters.values())]
        for name in names
    ]
    return table(("filter", *(f"{K} states" for K in filters)), rows)


def _rounds(rounds: Mapping[str, Timing]) -> list[str]:
    rows = [[name, f"{of.ratio:.2f}", f"{of.microseconds:.0f}"] for name, of in rounds.items()]
    return table(("inference", "times the one-state loop", "microseconds a frame"), rows)
