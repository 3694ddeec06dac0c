"""ASF/AMC: a bone with known axes, what is refused, and the same trials as BVH."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kinematics.asfamc import find_skeleton, read_amc
from kinematics.bvh import MotionError, read_bvh

ASF = """# a thigh and a shank
:version 1.10
:units
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     name thigh
     direction 0 -1 0
     length 2
     axis 0 0 90 XYZ
    dof rx ry
  end
  begin
     name shank
     direction 0 -1 0
     length 1
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root thigh
    thigh shank
  end
"""
AMC = ":FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 0 0 0\nthigh 90 0\n2\nroot 1 2 3 0 0 90\nthigh 0 90\n"


def leg(tmp_path, asf=ASF, amc=AMC):
    (tmp_path / "leg.asf").write_text(asf)
    (tmp_path / "leg_01.amc").write_text(amc)
    return tmp_path / "leg_01.amc"


def test_a_dof_turns_the_bone_about_the_bones_own_axis(tmp_path):
    capture = read_amc(leg(tmp_path))
    assert capture.names == ("root", "thigh", "shank")
    # The bone's x is the world's y at rest, so rx leaves a hanging thigh; its y is -x, so ry lifts it to +z,
    # and the root's turn about z leaves it there.
    assert_allclose(capture.at("thigh") - capture.at("root"), [[0, -2, 0], [0, 0, 2]], atol=1e-12)
    assert_allclose(capture.at("shank") - capture.at("thigh"), [[0, -1, 0], [0, 0, 1]], atol=1e-12)
    assert_allclose(capture.at("root"), [[1, 2, 3]] * 2)


def test_the_dof_listed_first_is_applied_first(tmp_path):
    straight = ASF.replace("axis 0 0 90 XYZ", "axis 0 0 0 XYZ").replace("dof rx ry", "dof rx rz")
    capture = read_amc(leg(tmp_path, straight, "1\nroot 0 0 0 0 0 0\nthigh 90 90\n"))
    assert_allclose(capture.at("thigh"), [[0, 0, -2]], atol=1e-12)


def test_radians_are_read_as_radians(tmp_path):
    degrees = read_amc(leg(tmp_path)).positions
    in_radians = AMC.replace(":DEGREES", ":RADIANS").replace("90", str(np.pi / 2))
    assert_allclose(read_amc(leg(tmp_path, amc=in_radians)).positions, degrees, atol=1e-12)


def test_the_skeleton_is_the_longest_whole_name_that_begins_the_captures(tmp_path):
    for name in ("0.asf", "HDM.asf", "HDM_bd.asf", "HDM_bk.asf"):
        (tmp_path / name).touch()
    assert find_skeleton(tmp_path / "HDM_bd_jog.amc").name == "HDM_bd.asf"
    with pytest.raises(MotionError, match=r"no skeleton; put the \.asf beside it"):
        find_skeleton(tmp_path / "02_01.amc")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("thigh 0 90", "thigh 0", r"leg_01.amc, line 8: 2 values wanted, 1 found"),
        ("thigh 0 90", "thigh 0 nan", r"leg_01.amc, line 8: finite numbers wanted, 'nan' found"),
        ("thigh 0 90", "arm 0 90", r"line 8: the skeleton has no bone 'arm'"),
        ("thigh 0 90\n", "", r"2 frames, but bone 'thigh' moves in 1"),
        (AMC, "", r"0 frames"),
        (":bonedata", ":bones", r"leg.asf has no :bonedata section"),
        ("dof rx ry", "dof rx l", r"leg.asf, line 16: dofs rx, ry, rz can be read"),
        ("0 0 90 XYZ", "0 0 90 XYW", r"line 15: an axis order such as XYZ wanted, XYW found"),
        ("order TX TY TZ RX RY RZ", "order TX TY TZ", r"the root's order must hold TX TY TZ RX RY RZ"),
        ("position 0 0 0", "position 0 9 0", r"line 8: a root that starts at 0 0 0 wanted"),
        ("thigh shank", "thigh foot", r"line 27: no bone is called 'foot'"),
        ("    root thigh\n", "", r"line 26: bone 'thigh' has no parent yet"),
        ("thigh shank", "thigh shank thigh", r"line 27: bone 'thigh' has a parent already"),
    ],
)
def test_a_malformed_file_is_refused_with_its_line(tmp_path, old, new, message):
    path = leg(tmp_path, ASF.replace(old, new), AMC.replace(old, new))
    with pytest.raises(MotionError, match=message):
        read_amc(path)


@pytest.mark.parametrize(
    ("bvh", "amc"),
    [
        ("02_01", "02_01"),
        ("09_10", "09_10"),
        ("49_04", "49_04"),
        ("hdbk_jog003", "HDM_bk_jogLeftCircle4StepsRstart_003_120"),
    ],
)
def test_a_trial_stands_in_the_same_place_as_bvh_and_as_amc(data_dir, bvh, amc):
    folder = data_dir / "mocap" / "open"
    a, b = read_bvh(folder / f"{bvh}.bvh"), read_amc(folder / "asfamc" / f"{amc}.amc")
    assert len(a.positions) == len(b.positions)
    same = {
        "Hips": "root",
        "LeftUpLeg": "lhipjoint",
        "LeftLeg": "lfemur",
        "LeftFoot": "ltibia",
        "LeftToeBase": "lfoot",
        "RightUpLeg": "rhipjoint",
        "RightLeg": "rfemur",
        "RightFoot": "rtibia",
        "RightToeBase": "rfoot",
        "Neck": "thorax",
        "Head_end": "head",
    }
    for joint, bone in same.items():
        # The BVH holds degrees to four decimals: eight turns of 5e-5 degrees over 15 units are 1e-4.
        assert_allclose(a.at(joint), b.at(bone), atol=1e-3, err_msg=joint)
