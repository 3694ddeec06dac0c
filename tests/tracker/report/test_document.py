import json

import numpy as np
import pytest

from tracker.report.document import ROWS, linked_from, written
from tracker.tables.table import write_table


def test_data_are_written_as_json_however_long_their_arrays_are(rng):
    data = {
        "name": 'a "name" <b>',
        "none": None,
        "nested": [[1, 2.5, True], (), {}, {"of": [np.arange(3)]}],
        "long": np.round(rng.normal(size=(2 * ROWS + 1, 2)), 3),
        "whole": np.arange(ROWS),
        "empty": np.empty((0, 2)),
        1: "a number as a key",
    }
    want = json.dumps(data, separators=(",", ":"), default=lambda array: array.tolist())
    assert "".join(written(data)) == want


def test_no_piece_holds_more_than_a_part_of_a_long_array(rng):
    array = rng.normal(size=20 * ROWS)
    pieces = list(map(len, written({"array": array})))
    assert max(pieces) < sum(pieces) / 15


def test_what_json_cannot_hold_is_refused():
    with pytest.raises(ValueError, match="not JSON compliant"):
        list(written({"array": np.array([1.0, np.nan])}))
    with pytest.raises(TypeError, match="not JSON serializable"):
        list(written({"set": {1}}))


def test_a_name_that_is_no_text_has_an_address_and_a_place_in_a_table(tmp_path):
    name = "l\udce4uft.mp4"  # Latin-1, as old archives have it
    assert linked_from(tmp_path, tmp_path / name) == "l%E4uft.mp4"
    write_table(tmp_path / "t.csv", ("video",), [(name,)])
    assert (tmp_path / "t.csv").read_text() == "video\nl\\udce4uft.mp4\n"
