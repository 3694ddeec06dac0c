"""Figures: the layout of a pose, the tree, and every mistake in a TOML as one clear error."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kinematics.figure import Figure
from kinematics.figure_file import figure_from, load_figure
from kinematics.mocap import POSE_COLUMNS
from tests.kinematics.figures import HORSE, WALKER, every_figure

ARM = """
name = "arm"
base = "shoulder"

[[links]]
name = "upper"
joint = "elbow"
freedom = "raise"
length = 0.5
width = 0.2
limits = [-90, 90]

[[links]]
name = "fore"
parent = "upper"
joint = "wrist"
freedom = "bend"
length = 0.4
width = 0.1
"""


def test_the_walkers_pose_is_a_pose_row_then_ankles_scale_and_stretches():
    assert WALKER.pose_freedoms == (*POSE_COLUMNS, "ankle_near", "ankle_far")
    stretches = tuple(f"stretch_{link.name}" for link in WALKER.links if not link.name.startswith("foot"))
    assert WALKER.freedoms == (*WALKER.pose_freedoms, "scale", *stretches)
    assert [WALKER.index(name) for name in WALKER.freedoms] == list(range(17))
    legs = ("near_knee", "near_ankle", "far_knee", "far_ankle", "near_toe", "far_toe")
    assert WALKER.joints == ("hip", "neck", "head_top", *legs)
    assert sum(link.length for link in WALKER.links if link.name in ("thigh_near", "shank_near")) == 1.0


def test_a_link_that_does_not_turn_or_breathe_has_no_entry_in_the_pose():
    assert HORSE.link_of("near_hoof") == 6
    assert not any("hoof" in name for name in HORSE.freedoms)
    assert "stretch_tail" not in HORSE.freedoms
    assert len(HORSE.freedoms) == 2 + 12 + 1 + 11


@every_figure
def test_chain_and_reach_are_those_of_a_walk_up_the_tree(figure):
    names = [link.name for link in figure.links]
    for i, link in enumerate(figure.links):
        chain, reach = np.zeros(len(names), dtype=bool), np.zeros(len(names))
        chain[i], way = True, link
        while way.parent is not None:
            j = names.index(way.parent)
            chain[j], reach[j] = True, way.at
            way = figure.links[j]
        assert_array_equal(figure.chain[i], chain)
        assert_array_equal(figure.reach[i], reach)


@every_figure
def test_the_layout_says_of_every_link_what_the_tree_says(figure):
    layout, scale = figure.layout, figure.freedoms.index("scale")
    assert layout.scale == scale
    for i, link in enumerate(figure.links):
        turns, stretch = link.freedom is not None, f"stretch_{link.name}"
        assert layout.turns[i] == turns
        assert layout.angle[i] == (figure.freedoms.index(link.freedom) if turns else scale)
        assert layout.sense[i] == (link.sense if turns else 0)
        assert layout.breathes[i] == (stretch in figure.freedoms)
        assert layout.stretch[i] == (figure.freedoms.index(stretch) if link.breathes else scale)
        assert (layout.rest[i], layout.length[i]) == (link.rest, link.length)
        assert (layout.width[i], layout.taper[i], layout.layer[i]) == (link.width, link.taper, link.layer)


def test_every_joint_but_the_base_is_the_tip_of_one_link():
    for i, link in enumerate(WALKER.links):
        assert WALKER.link_of(link.joint) == i
    for joint in ("hip", "nose"):
        with pytest.raises(ValueError, match="not in tuple"):
            WALKER.link_of(joint)


def test_an_unknown_freedom_is_named_with_those_there_are():
    with pytest.raises(ValueError, match="'walker' has no freedom 'elbow'; it has root_x, root_y, torso"):
        WALKER.index("elbow")


def test_other_lengths_change_nothing_else():
    lengths = np.linspace(0.3, 0.8, len(WALKER.links))
    other = WALKER.with_lengths(lengths.tolist())
    assert [link.length for link in other.links] == lengths.tolist()
    assert other.with_lengths([link.length for link in WALKER.links]) == WALKER
    with pytest.raises(ValueError, match="shorter"):
        WALKER.with_lengths([0.5] * 7)
    with pytest.raises(ValueError, match="link 'head': length, width and taper must be positive"):
        WALKER.with_lengths([0.5, 0.0, *[0.5] * 6])


def test_a_figure_loads_by_name_and_by_path(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM)
    arm = load_figure(path)
    assert arm == load_figure(str(path)) == figure_from(tomllib.loads(ARM))
    assert (arm.name, arm.joints, arm.leg) == ("arm", ("shoulder", "elbow", "wrist"), ())
    assert load_figure() == load_figure("walker") == WALKER


def test_degrees_become_radians_and_what_is_left_out_its_default():
    upper, fore = figure_from(tomllib.loads(ARM)).links
    assert_allclose(upper.limits, [-np.pi / 2.0, np.pi / 2.0])
    assert_allclose(fore.limits, [-np.pi, np.pi])
    assert (fore.parent, fore.at, fore.rest, fore.sense) == ("upper", 1.0, 0.0, 1)
    assert (fore.taper, fore.layer) == (1.0, 0)
    assert fore.breathes
    assert WALKER.links[0].rest == pytest.approx(np.pi / 2.0)


def test_a_figure_may_extend_one_that_ships_and_a_link_be_like_its_twin():
    tail = {"name": "tail_near", "joint": "near_tip", "freedom": "wag_near", "length": 1.0, "width": 0.1}
    links = [tail, {"like": "tail_near", "length": 2.0}]
    mine = figure_from({"name": "mine", "extends": "walker", "links": links, "hints": {"hip": "here"}})
    assert mine.marks == WALKER.marks
    assert mine.hints == {**WALKER.hints, "hip": "here"}
    [one, two] = [link for link in mine.links if link not in WALKER.links]
    far = {"name": "tail_far", "joint": "far_tip", "freedom": "wag_far"}
    assert two == replace(one, **far, length=2.0)
    assert [link.learned for link in mine.links] == [True] * 8 + [False] * 2  # the feet come last


def swapped(text, old, new):
    assert text.count(old) == 1
    return text.replace(old, new)


PARENT, SHARED = 'parent = "upper"', "two freedoms of figure 'arm' share a name"
SIZES = "link 'fore': length, width and taper must be positive"
# What is added to the figure, what to its forearm, or put in place of something else, and what is said of it.
OF_THE_FIGURE = {
    "unknown key": ("legs = []", "the figure has the unknown key 'legs'"),
    "leg as text": ('leg = "fore"', "the figure: leg must be a list; got"),
    "leg of numbers": ("leg = [3]", "each of leg must be text; got 3"),
    "leg of no link": (
        'leg = ["upper", "shank"]',
        "leg of figure 'arm' names 'shank', but no link begins so; the links are upper, fore",
    ),
    "marks without the base": ('marks = ["elbow"]', "marks of figure 'arm' lack its base 'shoulder'; add it"),
    "mark of no joint": (
        'marks = ["shoulder", "knee"]',
        "marks of figure 'arm' names 'knee'; known are shoulder, ",
    ),
    "optional that is not marked": (
        'marks = ["shoulder"]\noptional = ["elbow"]',
        "optional of figure 'arm' names 'elbow'; known are shoulder$",
    ),
    "one joint ahead": ('ahead = [["elbow"]]', r"ahead holds pairs of joints; got \['elbow'\]"),
    "hint of no joint": ('hints = { knee = "bend" }', "hints of figure 'arm' names 'knee'"),
    "panel of no freedom": (
        'panels = [{ title = "Arm", curves = { arm = "twist" } }]',
        "panels of figure 'arm' names 'twist'; known are root_x, ",
    ),
    "panel without a title": ("panels = [{}]", "lacks the key 'title'"),
    "extends no figure": ('extends = "cow"', "no figure 'cow' ships, only horse, .*; extend one of these"),
    "extends a number": ("extends = 3", "the figure: extends must be text; got 3"),
}
OF_A_LINK = {
    "unknown key of a link": ("lenght = 1", "link 'fore' has the unknown key 'len"),
    "zero taper": ("taper = 0", SIZES),
    "beyond its parent": ("at = 1.5", "link 'fore': at must be a share .* 0 to 1; got"),
    "nan rest": ("rest = nan", "link 'fore': rest must be an angle; got nan"),
    "sense zero": ("sense = 0", "link 'fore': sense must be 1 or -1; got 0"),
    "half a sense": ("sense = 1.5", "link 'fore': sense must be a whole number; got 1.5"),
    "breathes as text": ('breathes = "no"', "'fore': breathes must be true or false"),
    "no such offset": ('offset = "far"', "offset must be '', 'marked'; got 'far'"),
    "like no link": ('like = "wing"', "a link is like 'wing', which is no link before it; list it first"),
    "like a number": ("like = 3", "a link: like must be text; got 3"),
    "no such twin": ('twin = "wing"', "its twin 'wing' is no link of the figure"),
}
MISTAKES = {
    "no name": ('name = "arm"', "", "the figure lacks the key 'name'"),
    "no base": ('base = "shoulder"', "", "the figure lacks the key 'base'"),
    "no length": ("length = 0.4", "", "link 'fore' lacks the key 'length'; add it"),
    "no joint": ('joint = "wrist"', "", "link 'fore' lacks the key 'joint'"),
    "a nameless link": ('name = "fore"', "", r"link '\?' lacks the key 'name'"),
    "no such parent": (PARENT, 'parent = "uper"', "link 'fore' hangs on an unlisted link, 'uper'"),
    "its own parent": (PARENT, 'parent = "fore"', "link 'fore' comes before its parent 'fore'"),
    "parent last": ('"elbow"', '"elbow"\nparent = "fore"', "'upper' comes before its parent 'fore'"),
    "one name twice": ('"fore"', '"upper"', "link 'upper' is listed twice; give each its own name"),
    "one joint twice": ('"wrist"', '"elbow"', "link 'fore': another link or the base has the joint"),
    "base as joint": ('"wrist"', '"shoulder"', "link 'fore': another link or the base has the joint"),
    "one freedom twice": ('"bend"', '"raise"', f"{SHARED}; got root_x, root_y, raise"),
    "a freedom that is": ('"bend"', '"scale"', SHARED),
    "zero length": ("length = 0.4", "length = 0", SIZES),
    "negative width": ("width = 0.1", "width = -0.1", SIZES),
    "nan length": ("length = 0.4", "length = nan", SIZES),
    "infinite length": ("length = 0.4", "length = inf", SIZES),
    "falling limits": ("[-90, 90]", "[90, -90]", r"link 'upper': limits must rise; got \[90.0, -90.0\]"),
    "nan limits": ("[-90, 90]", "[nan, 90]", "link 'upper': limits must rise"),
    "one limit": ("[-90, 90]", "[90]", r"link 'upper': limits must be two angles; got \[90\]"),
    "limits beyond all bounds": ("[-90, 90]", f"[-90, 1{400 * '0'}]", "int too large"),
    "length beyond all bounds": ("length = 0.4", f"length = 1{400 * '0'}", "int too large"),
    "limits as text": ("[-90, 90]", '["a", "b"]', "link 'upper': each of limits must be a number; got 'a'"),
    "length as text": ("length = 0.4", 'length = "long"', "link 'fore': length must be a number; got 'long'"),
    "length as truth": ("length = 0.4", "length = true", "link 'fore': length must be a number; got True"),
    "learned after what is not": (
        'name = "upper"',
        'name = "upper"\nlearned = false',
        "list the links of figure 'arm' that are not learned after all others",
    ),
}
BASE, WIDTH = 'base = "shoulder"\n', "width = 0.1\n"
MISTAKES |= {name: (BASE, BASE + added, said) for name, (added, said) in OF_THE_FIGURE.items()}
MISTAKES |= {name: (WIDTH, WIDTH + added, said) for name, (added, said) in OF_A_LINK.items()}


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_in_a_figure_is_one_clear_error_that_names_the_file(tmp_path, old, new, message):
    path = tmp_path / "arm.toml"
    path.write_text(swapped(ARM, old, new))
    with pytest.raises(ValueError, match=message) as caught:
        load_figure(path)
    assert str(caught.value).startswith(f"figure {path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("links", "message"),
    [
        ("", "lacks the key 'links'"),
        ("links = 3", "links must be a list"),
        ("links = [3]", "must be a table; got 3"),
    ],
)
def test_links_that_are_none_or_no_tables_are_refused(links, message):
    with pytest.raises(ValueError, match=message):
        figure_from(tomllib.loads(f'name = "arm"\nbase = "shoulder"\n{links}'))


def test_a_figure_without_links_is_refused():
    with pytest.raises(ValueError, match="figure 'nothing' has no links; give it one at least"):
        Figure("nothing", "hip", (), (), ("hip",))


def test_twins_may_be_named_and_angles_that_differ_in_side_alone_share_a_panel():
    figure = figure_from(tomllib.loads(ARM.replace('name = "fore"', 'name = "fore"\ntwin = "upper"')))
    assert figure.twins == {0: 1, 1: 0}
    assert figure.joint_twins.tolist() == [0, 2, 1]
    assert [dict(panel.curves) for panel in figure.panels] == [{"raise": "raise"}, {"bend": "bend"}]
    alike = [dict(panel.curves) for panel in HORSE.panels]
    assert {"near": "hip_near", "far": "hip_far"} in alike
    assert {"tail": "tail"} in alike


def test_twins_that_turn_or_breathe_unlike_are_refused():
    i = next(i for i, link in enumerate(WALKER.links) if link.name.endswith("far"))
    links = [replace(link, breathes=False) if k == i else link for k, link in enumerate(WALKER.links)]
    with pytest.raises(ValueError, match="must be each other's twin, turn and breathe alike"):
        replace(WALKER, links=tuple(links))


def test_layers_rank_from_far_to_near_and_one_layer_is_the_trunk():
    assert dict(zip((link.name for link in WALKER.links), WALKER.depth, strict=True)) == {
        "torso": "trunk",
        "head": "trunk",
        **{f"{part}_{side}": side for part in ("thigh", "shank", "foot") for side in ("near", "far")},
    }
    flat = replace(WALKER, links=tuple(replace(link, layer=4) for link in WALKER.links))
    assert set(flat.depth) == {"trunk"}


def test_a_file_that_is_missing_or_no_text_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"no figure file .*horse\.toml; give a TOML file that exists"):
        load_figure(tmp_path / "horse.toml")
    with pytest.raises(ValueError, match="no figure 'cow' ships, only horse, walker and walker-arms"):
        load_figure("cow")
    for content, fault in (
        (b'name = "\xff"', "byte 8 is no UTF-8"),
        (b"length =", "Invalid value"),
        (b"a = " + 9999 * b"[", "nested too deeply"),
    ):
        (tmp_path / "arm.toml").write_bytes(content)
        with pytest.raises(ValueError, match=rf"arm\.toml is no TOML file \({fault}.*\); docs/figures\.md"):
            load_figure(tmp_path / "arm.toml")
