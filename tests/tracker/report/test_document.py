import numpy as np
import pytest

from tracker.report.document import as_json, linked_from
from tracker.tables.table import write_table


def test_arrays_are_written_as_lists_and_what_json_cannot_hold_is_refused():
    data = {"of": [np.arange(2.0), np.empty((0, 2)), np.array([[True]])], 1: "a number as a key"}
    assert as_json(data) == '{"of":[[0.0,1.0],[],[[true]]],"1":"a number as a key"}'
    with pytest.raises(ValueError, match="not JSON compliant"):
        as_json({"array": np.array([1.0, np.nan])})
    with pytest.raises(TypeError, match="set"):
        as_json({"set": {1}})


def test_a_name_that_is_no_text_has_an_address_and_a_place_in_a_table(tmp_path):
    name = "l\udce4uft.mp4"  # Latin-1, as old archives have it
    assert linked_from(tmp_path, tmp_path / name) == "l%E4uft.mp4"
    write_table(tmp_path / "t.csv", ("video",), [(name,)])
    assert (tmp_path / "t.csv").read_text() == "video\nl\\udce4uft.mp4\n"
