"""BVH files: a chain with known answers, position channels, the missing thorax, what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.bvh import MotionError, joint_positions, read_bvh, rotation

CHAIN = """HIERARCHY
ROOT Hips
{{
    OFFSET 100 200 300
    CHANNELS 6 Xposition Yposition Zposition {root}
    JOINT Knee
    {{
        OFFSET 0 -2 0
        CHANNELS {knee}
        End Site
        {{
            OFFSET 0 -1 0
        }}
    }}
}}
MOTION
Frames: {frames}
Frame Time: 0.0333333
{rows}
"""

SPINE = """HIERARCHY
ROOT Hips
{{
    OFFSET 0 0 0
    CHANNELS 3 Xposition Yposition Zposition
    JOINT Spine1
    {{
        OFFSET 3 4 0
        CHANNELS 0
        JOINT Neck
        {{
            OFFSET {neck}
            CHANNELS 0
        }}
        JOINT LeftShoulder
        {{
            OFFSET 0 0 0
            CHANNELS 0
        }}
        JOINT RightShoulder
        {{
            OFFSET 0 0 0
            CHANNELS 0
        }}
    }}
}}
MOTION
Frames: 1
Frame Time: 0.01
1 1 1
"""


def chain(
    tmp_path, *rows, root="Zrotation Xrotation Yrotation", knee="3 Zrotation Xrotation Yrotation", frames=None
):
    path = tmp_path / "chain.bvh"
    count = len(rows) if frames is None else frames
    path.write_text(CHAIN.format(root=root, knee=knee, frames=count, rows="\n".join(rows)))
    return path


def test_root_position_channels_replace_the_root_offset_and_a_byte_order_mark_is_no_word(tmp_path):
    path = chain(tmp_path, "1 2 3 0 0 0 0 0 0")
    path.write_text("\ufeff" + path.read_text(), encoding="utf-8")
    assert_allclose(read_bvh(path).at("Hips"), [[1, 2, 3]])


def test_a_position_channel_replaces_only_its_own_entry_of_the_offset(tmp_path):
    capture = read_bvh(chain(tmp_path, "0 0 0 0 0 0 7", knee="1 Xposition"))
    assert_allclose(capture.at("Knee"), [[7, -2, 0]])


def test_six_channels_per_joint_place_it_in_its_parents_axes(tmp_path):
    knee = "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    capture = read_bvh(chain(tmp_path, "0 0 0 90 0 0 5 0 0 0 0 0", knee=knee))
    # The root's quarter turn about z takes the parent's x to y; the OFFSET 0 -2 0 is gone.
    assert_allclose(capture.at("Knee"), [[0, 5, 0]], atol=1e-12)


def test_a_pendulum_swings_by_the_sum_of_its_joints_turns(tmp_path):
    capture = read_bvh(chain(tmp_path, "0 0 0 90 0 0 -90 0 0", "0 0 0 0 0 0 90 0 0"))
    assert capture.names == ("Hips", "Knee", "Knee_end")
    assert capture.fps == pytest.approx(30.0, rel=1e-5)
    assert_allclose(capture.at("Knee"), [[2, 0, 0], [0, -2, 0]], atol=1e-12)
    assert_allclose(capture.at("Knee_end"), [[2, -1, 0], [1, -2, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("order", "knee"),
    # 0 -2 0 turned a quarter about x lies at 0 0 -2; the quarter about z then leaves it, or came first.
    [("Zrotation Xrotation Yrotation", [0, 0, -2]), ("Xrotation Zrotation Yrotation", [2, 0, 0])],
)
def test_the_channel_named_first_turns_last(tmp_path, order, knee):
    capture = read_bvh(chain(tmp_path, "0 0 0 90 90 0 0 0 0", root=order))
    assert_allclose(capture.at("Knee"), [knee], atol=1e-12)


def test_every_frame_is_placed_as_a_frame_alone_is(rng):
    parents = [-1, 0, 1, 0]
    translations = rng.normal(size=(5, 4, 3))
    rotations = rotation("ZXY", rng.normal(size=(5, 4, 3)))
    together = joint_positions(parents, translations, rotations)
    for t in range(5):
        frame: list[tuple[np.ndarray, np.ndarray]] = []
        for j, parent in enumerate(parents):
            p, R = frame[parent] if parent >= 0 else (np.zeros(3), np.eye(3))
            frame.append((p + R @ translations[t, j], R @ rotations[t, j]))
        assert_allclose(together[t], [p for p, _ in frame], atol=1e-12)


def test_a_turn_about_each_axis_takes_the_next_axis_to_the_one_after():
    quarter = np.array([np.pi / 2])
    x, y, z = np.eye(3)
    for axis, start, end in (("X", y, z), ("Y", z, x), ("Z", x, y)):
        assert_allclose(rotation(axis, quarter) @ start, end, atol=1e-15)


@pytest.mark.parametrize(
    ("neck", "at", "shoulder"), [("0 0 0", [4, 10, 1], [4, 10, 1]), ("0 2 0", [4, 7, 1], [4, 5, 1])]
)
def test_a_neck_on_spine1_is_raised_by_spine1s_length_and_one_that_stands_off_it_stays(
    neck, at, shoulder, tmp_path
):
    path = tmp_path / "spine.bvh"
    path.write_text(SPINE.format(neck=neck))
    assert_allclose(read_bvh(path).at("Neck"), [at])
    assert_allclose(read_bvh(path).at("LeftShoulder"), [shoulder])


def test_carriage_returns_and_braces_on_the_name_line_change_nothing(tmp_path):
    path = chain(tmp_path, "1 2 3 10 20 30 40 50 60")
    want = read_bvh(path).positions
    text = path.read_text().replace("Hips\n{", "Hips {").replace("\n", "\r\n")
    path.write_bytes(text.encode())
    assert_allclose(read_bvh(path).positions, want)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1 2 3", "1 2", "line 19: 9 values wanted, 8 found"),
        ("1 2 3", "1 nan 3", "line 19: finite numbers wanted, 'nan' found"),
        ("1 2 3", "1 two 3", "line 19: finite numbers wanted, 'two' found"),
        ("0 -2 0", "0 -2", "line 8: finite numbers wanted, 'CHANNELS' found"),
        ("Frames: 1", "Frames: 2", "line 17: 2 frames announced, 1 found"),
        ("Frame Time: 0.0333333", "Frame Time: 0", "line 18: Frame Time must be above 0"),
        ("Frames: 1", "Frames 1", "line 17: 'Frames:' and 'Frame Time:' must follow MOTION"),
        ("MOTION", "", "no MOTION line"),
        ("JOINT", "JOIN", "line 6: a BVH keyword wanted, 'JOIN' found"),
        ("Zposition", "Wposition", "line 5: no channel is called 'Wposition'"),
        ("        }\n", "", "a brace stays open"),
        ("        }\n", "        }\n}\n}\n", "braces do not match"),
    ],
)
def test_a_malformed_file_is_refused_with_its_line(tmp_path, old, new, message):
    path = chain(tmp_path, "1 2 3 0 0 0 0 0 0")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(MotionError, match=message):
        read_bvh(path)
