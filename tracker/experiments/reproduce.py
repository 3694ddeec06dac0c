"""The papers' experiments on a user's captures: learning, measuring, judging the claims."""

import json
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

from tracker import __version__
from tracker.experiments import ahead, classify, gaps, phases, runtime, synthesis
from tracker.experiments.section import Section, write_findings
from tracker.experiments.study import FPS, Study, read_study
from tracker.progress import Progress
from tracker.run.folder import fresh_folder

# Modules, each with run(study).
EXPERIMENTS: tuple[ModuleType, ...] = (phases, classify, ahead, synthesis, gaps, runtime)
PAGE, CLAIMS = "reproduce.html", "reproduce.json"


def reproduce(
    trials: Path, out: Path, *, overwrite: bool, progress: Progress, seed: int = 0, quick: bool = False
) -> str:
    """Run every experiment that the captures allow; writes reproduce.html and reproduce.json into `out`.

    `quick` uses few captures, sequences and models, to test that all works; the figures mean nothing. Returns
    a line for each claim, and the page's path.

    Raises:
        MotionError: a table or capture that cannot be read.
        ValueError: no walk and no run in the table.
        FolderError: a place that cannot be written.
    """
    with fresh_folder(out, overwrite=overwrite, inputs=[trials]) as aside:
        study = read_study(trials, progress, seed=seed, quick=quick)
        sections = [experiment.run(study) for experiment in EXPERIMENTS]
        about, notes = _about(study, trials)
        write_findings(sections, about, notes, aside / PAGE)
        _write_claims(study, sections, aside / CLAIMS)
    return "\n".join([*_lines(sections), "", f"open {out / PAGE}"])


def _about(study: Study, trials: Path) -> tuple[str, list[str]]:
    parts = []
    for motion in study.motions:
        captures = study.of(motion)
        subjects, frames = {c.subject for c in captures}, sum(len(c.y) for c in captures)
        parts.append(
            f"{motion}: {len(captures)} straight segments of {len(subjects)} subjects, {frames} frames"
        )
    about = f"{trials.name}; {'; '.join(parts)}, at {FPS:g} frames a second. Seed {study.seed}."
    notes = [
        "People are told apart by the table's column subject; somebody listed under two names counts as two."
    ]
    if study.folds:
        groups = "; ".join(", ".join(sorted(fold)) for fold in study.folds)
        notes.append(f"Groups of subjects left out in turn: {groups}.")
    else:
        notes.append(
            "Too few subjects to leave some out: everything was measured on people that were learned from."
        )
    if study.quick:
        notes.append("A quick look at a few captures; its figures mean nothing.")
    return about, notes


def _write_claims(study: Study, sections: list[Section], path: Path) -> None:
    news = {
        "figtrack": __version__,
        "seed": study.seed,
        "quick": study.quick,
        "folds": [sorted(fold) for fold in study.folds],
        "claims": {s.heading.key: [asdict(claim) for claim in s.claims] for s in sections},
    }
    path.write_text(json.dumps(news, indent=1), encoding="utf-8")


def _lines(sections: list[Section]) -> list[str]:
    width = max(len(claim.verdict.value) for s in sections for claim in s.claims)
    return [f"{c.verdict.value:<{width}}  {s.heading.title} {c.paper}" for s in sections for c in s.claims]
