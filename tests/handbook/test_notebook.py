"""The notebook runs from its top to its end, and is kept without what a run left in it."""

import json

import matplotlib.pyplot as plt
import pytest

from tests.handbook.blocks import ROOT
from tests.handbook.stage import set_up

NOTEBOOK = "docs/walk.ipynb"
CELLS = json.loads((ROOT / NOTEBOOK).read_text(encoding="utf-8"))["cells"]
CODE = ["".join(cell["source"]) for cell in CELLS if cell["cell_type"] == "code"]


@pytest.mark.handbook
def test_the_notebook_runs_from_top_to_end(stage, here):
    set_up(stage, here, NOTEBOOK)
    plt.switch_backend("agg")
    names = {}
    for number, source in enumerate(CODE):
        exec(compile(source, f"{NOTEBOOK} cell {number}", "exec"), names)
    assert len(names["table"]) == len(names["track"])
    assert names["axes"].lines
    plt.close("all")


def test_the_notebook_is_kept_without_results():
    code = [cell for cell in CELLS if cell["cell_type"] == "code"]
    assert len(code) == len(CODE) > 3
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
