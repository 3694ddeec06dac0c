"""A start pose out of another program's file: which person, which leg, which names, and what is refused."""

from types import SimpleNamespace

import pytest

from tests.tracker import people
from tests.tracker.people import LEGS, WALKER, mirrored, moved
from tracker.foreign.names import CROWN, joints_of, parts_of
from tracker.foreign.people import Sighting
from tracker.foreign.start_marks import read_marks, read_start
from tracker.foreign.text_files import ForeignError
from tracker.tables.keypoints import KEYPOINTS, Mark, points

DERIVED = {"neck": (100.0, 70.0), "hip": (100.0, 130.0)}
CROWN_AT = (100.0 + CROWN * 6.0, 70.0 - CROWN * 30.0)
WHOLE = {"head_top": CROWN_AT, **DERIVED, **LEGS}
WITHOUT_TOES = {name: place for name, place in WHOLE.items() if "toe" not in name}

WRITERS = {
    "OpenPose": people.openpose,
    "COCO": lambda path, who: people.coco(path, {"img0.png": who}),
    "labelme": people.labelme,
    "DeepLabCut": lambda path, who: people.dlc(
        path, {"0": who}, individuals=[f"one{i}" for i in range(len(who))]
    ),
}
every_format = pytest.mark.parametrize("program", WRITERS)


def test_the_name_of_a_single_picture_need_not_number_it(tmp_path):
    path = people.labelme(tmp_path / "a.json", [WALKER], image="IMG_20240105.jpg")
    assert read_start(path, 4).frame == 4


@pytest.mark.parametrize("program", [*WRITERS, "TRC"])
def test_a_walker_is_read_from_whatever_format_told_apart_by_content(tmp_path, program):
    write = people.trc if program == "TRC" else WRITERS[program]
    taken = read_start(write(tmp_path / "start.file", [WALKER]))
    wanted = WITHOUT_TOES if program == "COCO" else WHOLE
    assert points(taken.marks) == wanted
    assert list(taken.marks) == [name for name in KEYPOINTS if name in wanted]
    assert program in taken.told


@every_format
def test_of_several_people_the_largest_is_taken_and_it_is_said(tmp_path, program):
    small, large = moved(WALKER, size=0.5), moved(WALKER, dx=30.0)
    taken = read_start(WRITERS[program](tmp_path / "start.file", [small, large]))
    assert taken.marks["hip"] == Mark(130.0, 130.0)
    assert "person 2 of 2" in taken.told


@every_format
def test_of_somebody_who_faces_left_the_left_leg_is_near(tmp_path, program):
    taken = read_start(WRITERS[program](tmp_path / "start.file", [mirrored(WALKER)]))
    assert (taken.marks["near_knee"].x, taken.marks["far_knee"].x) == (205.0, 180.0)
    assert "faces left, so the left leg is near" in taken.told


def test_without_toes_the_nose_tells_the_facing_even_of_straight_legs(tmp_path):
    straight = WALKER | {
        f"{s}_{p}": (100.0, y) for s in ("left", "right") for p, y in (("knee", 175.0), ("ankle", 218.0))
    }
    path = people.coco(tmp_path / "a.json", {"1.png": [mirrored(straight)]})
    assert "faces left" in read_start(path).told


def test_toes_tell_the_facing_better_than_a_turned_head(tmp_path):
    back = WALKER | {"nose": (96.0, 42.0)}
    assert "faces right" in read_start(people.openpose(tmp_path / "a.json", [back])).told


def test_a_derived_crown_is_an_estimate_and_a_midpoint_is_as_sure_as_its_ends(tmp_path):
    path = people.coco(tmp_path / "a.json", {"1.png": [WALKER]}, flags={"left_hip": 1, "right_knee": 1})
    taken = read_start(path)
    hidden = {name for name, mark in taken.marks.items() if not mark.visible}
    assert hidden == {"head_top", "hip", "near_knee"}
    assert "estimated: head_top, neck, hip" in taken.told
    assert "not there: near_toe, far_toe" in taken.told


def test_what_the_file_has_itself_is_not_derived(tmp_path):
    own = {"head_top": (90.0, 20.0), "neck": (91.0, 71.0), "hip": (92.0, 133.0)}
    taken = read_start(people.labelme(tmp_path / "a.json", [WALKER | own]))
    assert {name: points(taken.marks)[name] for name in own} == own
    assert "estimated" not in taken.told


SPELLINGS = (
    "right_knee,RKnee,R_Knee,rknee,knee_r,Knee Right,RIGHT-KNEE,kneeRight,rightknee,kneeright,near_knee"
)


@pytest.mark.parametrize("name", SPELLINGS.split(","))
def test_a_knee_is_a_knee_in_any_spelling(tmp_path, name):
    rest = {k: v for k, v in WALKER.items() if k != "right_knee"}
    taken = read_start(people.labelme(tmp_path / "a.json", [rest | {name: (1.0, 2.0)}]))
    assert taken.marks["near_knee"] == Mark(1.0, 2.0)


@pytest.mark.parametrize("name", ["right_wrist", "kneecap", "r", "", "7", "right"])
def test_a_point_that_is_none_of_ours_is_left_out(tmp_path, name):
    taken = read_start(people.labelme(tmp_path / "a.json", [WALKER | {name: (1.0, 2.0)}]))
    assert points(taken.marks) == WHOLE


@pytest.mark.parametrize("facing", [1, -1])
def test_a_figure_s_own_joints_may_be_called_right_and_left(facing):
    crab = SimpleNamespace(marks=("base", "right_claw", "left_claw"))
    claws = {name: Sighting(float(x), 5.0) for x, name in enumerate(crab.marks)}
    joints, derived = joints_of(parts_of(claws, crab), facing, crab)
    assert (joints, derived) == (claws, [])


def test_unsure_points_are_estimates_and_hopeless_ones_are_left_out(tmp_path):
    unsure = people.openpose(tmp_path / "a.json", [WALKER], confidence=0.4)
    assert not any(mark.visible for mark in read_start(unsure).marks.values())
    hopeless = people.openpose(tmp_path / "b.json", [WALKER], confidence=0.05)
    with pytest.raises(ForeignError, match="no point of ours"):
        read_start(hopeless)


def test_the_frame_asked_for_is_taken_wherever_it_is(tmp_path):
    path = people.dlc(tmp_path / "a.csv", {str(t): moved(WALKER, dx=t) for t in range(9)})
    taken = read_start(path, frame=7, first=8)
    assert (taken.frame, taken.marks["hip"].x) == (7, 107.0)


def stepping(by):
    """The walker with the left foot farther ahead."""
    return WALKER | {name: (WALKER[name][0] + by, WALKER[name][1]) for name in ("left_ankle", "left_toe")}


HALF = {name: WALKER[name] for name in ("nose", "left_hip", "right_hip", "left_ankle", "right_ankle")}
ONE_ANKLE = {name: place for name, place in stepping(12.0).items() if name != "right_ankle"}


def test_unless_told_the_first_frame_with_the_ankles_farthest_apart_is_taken(tmp_path):
    walk = {"1": WALKER, "2": stepping(6.0), "3": stepping(3.0), "4": stepping(6.0)}
    assert read_start(people.dlc(tmp_path / "a.csv", walk)).frame == 2


@pytest.mark.parametrize("worse", [{}, HALF, moved(HALF, size=3.0), ONE_ANKLE], ids=len)
def test_a_figure_that_is_not_whole_is_no_start_where_another_is(tmp_path, worse):
    assert read_start(people.dlc(tmp_path / "a.csv", {"0": worse, "1": WALKER})).frame == 1


def test_a_figure_that_cannot_be_right_is_no_start_where_another_can(tmp_path):
    walk = {"0": stepping(150.0), "1": WALKER, "2": stepping(6.0)}
    assert read_start(people.dlc(tmp_path / "a.csv", walk)).frame == 2
    assert read_start(people.dlc(tmp_path / "b.csv", {"0": stepping(150.0), "1": HALF})).frame == 0


def test_of_two_figures_the_likelier_is_the_start_unless_its_ankles_are_much_closer(tmp_path):
    for t, (who, confidence) in enumerate([(WALKER, 0.9), (stepping(6.0), 0.6), (stepping(-10.0), 1.0)]):
        people.openpose(tmp_path / f"walk_{t:012d}_keypoints.json", [who], confidence=confidence)
    assert read_start(tmp_path).frame == 0


def test_the_start_is_looked_for_no_further_than_told(tmp_path):
    path = people.dlc(tmp_path / "a.csv", {"3": WALKER, "5": stepping(6.0)})
    assert (read_start(path, last=5).frame, read_start(path, last=4).frame) == (5, 3)
    with pytest.raises(ForeignError, match=r"from frame 0 to 2 of .* somebody in 3, 5"):
        read_start(path, last=2)
    assert read_start(path, first=4).frame == 5
    with pytest.raises(ForeignError, match=r"from frame 6 on of .* somebody in 3, 5"):
        read_start(path, first=6)


def test_marks_are_every_frame_of_a_table_of_ours(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("scorer,frame,keypoint,x,y\nme,4,hip,1,2\nme,2,neck,3,4\n")
    wanted = {4: {"hip": Mark(1, 2)}, 2: {"neck": Mark(3, 4)}}
    assert read_marks(path, 2, None, 0, None) == (wanted, "")


def test_the_only_frame_of_a_file_stands_for_any_that_is_asked_for(tmp_path):
    path = people.labelme(tmp_path / "a.json", [WALKER], image="walk_0012.png")
    assert read_start(path).frame == 12
    taken = read_start(path, frame=40)
    assert taken.frame == 40
    assert "frame 12" in taken.told


def test_a_frame_without_anybody_is_refused_with_those_that_have_somebody(tmp_path):
    path = people.dlc(tmp_path / "a.csv", {"3": WALKER, "5": WALKER})
    with pytest.raises(ForeignError, match=r"frame 4 .* somebody in 3, 5"):
        read_start(path, frame=4)
    path = people.trc(tmp_path / "a.trc", [WALKER, {}, WALKER])
    with pytest.raises(ForeignError, match=r"frame 1 .* somebody in 0, 2"):
        read_start(path, frame=1)
    path = people.trc(tmp_path / "b.trc", [{}, {}, WALKER])
    with pytest.raises(ForeignError, match=r"frame 0 .* somebody in 2"):
        read_start(path, frame=0)
