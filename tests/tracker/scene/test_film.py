"""The rendered walk: its truth is consistent, its motion human, its pictures hard in the ways it claims."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tracker.scene.film import KEYPOINTS, LOWEST, STRIDES, Scene, compress, render, truth_table
from tracker.scene.steps import _wander

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return render(2, frames=50, shrubs=False)


@pytest.fixture(scope="module")
def short() -> Scene:
    return render(5, frames=8, size=(240, 135))


def length(scene: Scene, a: str, b: str) -> Array:
    return np.linalg.norm(scene.joints[a] - scene.joints[b], axis=1)


def distance_to_near_leg(scene: Scene, name: str) -> Array:
    """Slow and obvious: from a mark to the nearest of many points along the near leg's bones, pixels."""
    hip, knee, ankle, toe = (scene.joints[j] for j in ("hip", "near_knee", "near_ankle", "near_toe"))
    points = [
        (1.0 - w) * a + w * b
        for a, b in ((hip, knee), (knee, ankle), (ankle, toe))
        for w in np.linspace(0, 1, 50)
    ]
    return np.min([np.linalg.norm(scene.joints[name] - p, axis=1) for p in points], axis=0)


@pytest.mark.parametrize("size", [(160, 90), (90, 160)])
def test_the_same_seed_gives_the_same_pictures_and_another_seed_does_not(size):
    one, again, other = (render(seed, frames=2, size=size) for seed in (5, 5, 6))
    assert all(np.array_equal(a, b) for a, b in zip(one.images, again.images, strict=True))
    assert truth_table(one) == truth_table(again)
    assert not np.array_equal(one.images[0], other.images[0])


@pytest.mark.parametrize(("facing", "name"), [(1, "scene"), (-1, "short")])
def test_joints_are_the_pose_carried_through_the_figure(facing, name, request):
    scene = request.getfixturevalue(name)
    assert scene.facing == facing
    forward, up = np.array([scene.facing, 0.0]), np.array([0.0, -1.0])

    def link(a: str, b: str, angle_from_up: Array) -> Array:
        direction = np.sin(angle_from_up)[:, None] * forward + np.cos(angle_from_up)[:, None] * up
        return scene.joints[a] + length(scene, a, b)[:, None] * direction

    x, y, torso, neck, hip_near, knee_near, hip_far, knee_far = scene.pose.T
    root = scene.joints["hip"][0] + scene.leg_px * (x[:, None] * forward + y[:, None] * up)
    assert scene.joints["hip"] == pytest.approx(root, abs=1e-9)
    assert scene.joints["neck"] == pytest.approx(link("hip", "neck", torso), abs=1e-9)
    assert scene.joints["head_top"] == pytest.approx(link("neck", "head_top", torso + neck), abs=1e-9)
    for side, hip, knee in (("near", hip_near, knee_near), ("far", hip_far, knee_far)):
        upper, lower = link("hip", f"{side}_knee", np.pi - hip), np.pi - (hip - knee)
        assert scene.joints[f"{side}_knee"] == pytest.approx(upper, abs=1e-9)
        assert scene.joints[f"{side}_ankle"] == pytest.approx(
            link(f"{side}_knee", f"{side}_ankle", lower), abs=1e-9
        )


def test_every_link_keeps_its_length_and_both_legs_are_one_leg_long(scene):
    for a, b in (("hip", "neck"), ("neck", "head_top"), ("near_ankle", "near_toe"), ("far_ankle", "far_toe")):
        assert np.ptp(length(scene, a, b)) < 1e-9
    for side in ("near", "far"):
        leg = length(scene, "hip", f"{side}_knee") + length(scene, f"{side}_knee", f"{side}_ankle")
        assert leg == pytest.approx(scene.leg_px, abs=1e-9)


def test_the_whole_figure_is_in_view_in_every_frame(scene):
    height, width = scene.images[0].shape[:2]
    for name in KEYPOINTS:
        x, y = scene.joints[name].T
        assert x.min() > 10.0
        assert x.max() < width - 11.0
        assert y.min() > 10.0
        assert y.max() < height - 11.0


def test_hips_and_knees_move_as_in_normal_gait(scene):
    hips, knees = np.degrees(scene.pose[:, [4, 6]]), np.degrees(scene.pose[:, [5, 7]])
    assert np.all((hips.min(axis=0) > -25.0) & (hips.min(axis=0) < -10.0))
    assert np.all((hips.max(axis=0) > 23.0) & (hips.max(axis=0) < 40.0))
    assert np.all((knees.min(axis=0) >= 0.0) & (knees.min(axis=0) < 10.0))
    assert np.all((knees.max(axis=0) > 54.0) & (knees.max(axis=0) < 72.0))


def test_it_walks_at_an_adults_speed_and_rises_and_falls_twice_a_stride(scene):
    seconds = (len(scene.images) - 1) / scene.fps
    assert 1.15 < scene.pose[-1, 0] / seconds < 1.6  # leg lengths a second
    assert np.all(np.diff(scene.pose[:, 0]) > 0.0)
    bob = scene.pose[:, 1] - scene.pose[:, 1].mean()
    assert 0.03 < np.ptp(bob) < 0.1
    periods = np.arange(10, 45)
    alike = [np.corrcoef(bob[:-lag], bob[lag:])[0, 1] for lag in periods]
    step = periods[int(np.argmax(alike[:18]))]
    assert STRIDES[0] - 2.0 <= 2.0 * step <= STRIDES[1] + 2.0


def test_a_foot_flat_on_the_floor_stays_where_it_is(scene):
    lowest = np.max([scene.joints[f"{side}_ankle"][:, 1] for side in ("near", "far")])  # over a flat foot
    planted = 0
    for side in ("near", "far"):
        toe, ankle = scene.joints[f"{side}_toe"], scene.joints[f"{side}_ankle"]
        on_floor = lowest - ankle[:, 1] < 0.7
        still = on_floor[1:] & on_floor[:-1]
        planted += still.sum()
        step = np.linalg.norm(np.diff(toe, axis=0), axis=1)[still]
        assert np.median(step) < 0.3  # pixels a frame; the hip covers about 4
        assert np.quantile(step, 0.75) < 0.8
        assert step.max() < 3.0  # the toe comes down as the weight goes from leg to leg
    assert planted > len(scene.images) // 2


def test_a_far_joint_behind_the_near_leg_is_flagged_hidden_and_one_in_the_open_visible(scene):
    crossings = 0
    for name in ("far_knee", "far_ankle"):
        away = distance_to_near_leg(scene, name) / scene.leg_px
        covered = away < 0.03  # well inside a trouser leg, half as wide as 0.065 at its hem
        crossings += covered.sum()
        assert not scene.visible[name][covered].any()
    open_ankle = distance_to_near_leg(scene, "far_ankle") > 0.2 * scene.leg_px  # no arm reaches so low
    assert scene.visible["far_ankle"][open_ankle].all()
    assert open_ankle.sum() > len(scene.images) // 3
    assert crossings >= 3
    for name in ("head_top", "near_knee", "near_ankle", "near_toe"):
        assert scene.visible[name].mean() > 0.9


def test_shrubs_hide_both_legs_for_a_while_and_leave_the_head_free():
    behind = render(1, size=(240, 135))
    for name in ("near_ankle", "far_ankle", "near_knee"):
        assert 4 <= (~behind.visible[name]).sum() <= len(behind.images) // 2
    assert behind.visible["head_top"].all()
    assert behind.visible["near_ankle"][0]


def test_a_swinging_arm_hides_the_hip_now_and_then(scene):
    assert 0 < (~scene.visible["hip"]).sum() < len(scene.images) // 2


def test_the_light_changes_by_more_than_the_noise(scene):
    # Eight blocks of wall above every head: nothing but light changes there.
    wall = np.stack([image[:80] for image in scene.images]).astype(np.float64).mean(axis=(1, 3))
    blocks = np.stack([part.mean(axis=1) for part in np.array_split(wall, 8, axis=1)], axis=1)
    relative = blocks / blocks.mean(axis=0)
    assert np.ptp(relative.mean(axis=1)) > 0.06  # everything together
    assert np.ptp(relative, axis=0).max() > 0.2  # the band of shadow
    assert np.abs(relative - relative.mean(axis=1, keepdims=True)).max() > 0.05  # not everywhere alike


def test_the_walker_is_painted_at_its_joints(scene):
    # Against the median picture, what differs near the bones of the legs is the figure.
    stack = np.stack(scene.images[::4]).astype(np.float64)
    street = np.median(stack, axis=0)
    on, off = [], []
    for picture, t in zip(stack, range(0, len(scene.images), 4), strict=True):
        gain = picture[:80].mean() / street[:80].mean()
        differs = np.abs(picture - gain * street).mean(axis=2)
        for name in ("near_knee", "hip", "neck"):
            x, y = np.round(scene.joints[name][t]).astype(int)
            on.append(differs[y - 2 : y + 3, x - 2 : x + 3].mean())
            off.append(np.median(differs[y]))
    assert np.mean(on) > 3.0 * np.mean(off)


def test_both_trouser_legs_look_alike_and_the_far_one_is_darker(scene):
    def colour(side: str) -> Array:
        middle = (scene.joints[f"{side}_knee"] + scene.joints[f"{side}_ankle"]) / 2.0
        apart = length(scene, "near_ankle", "far_ankle") > 0.5 * scene.leg_px
        places = np.round(middle[apart]).astype(int)
        pictures = [image for image, wide in zip(scene.images, apart, strict=True) if wide]
        samples = [
            image[y - 2 : y + 3, x - 2 : x + 3] for image, (x, y) in zip(pictures, places, strict=True)
        ]
        return np.mean(samples, axis=(0, 1, 2))

    near, far = colour("near"), colour("far")
    assert 0.45 < far.mean() / near.mean() < 0.95
    assert near / near.mean() == pytest.approx(far / far.mean(), abs=0.2)


def test_the_table_has_a_row_for_every_keypoint_of_every_frame(short):
    rows = truth_table(short)
    assert [row[:2] for row in rows] == [(t, name) for t in range(8) for name in KEYPOINTS]
    t, name, x, y, visible = rows[len(KEYPOINTS) * 7 + 2]
    assert (t, name) == (7, "hip")
    assert [x, y] == list(short.joints["hip"][7])
    assert visible == int(short.visible["hip"][7])


def test_compression_changes_pixels_little_and_less_at_a_higher_quality(rng):
    blocks = np.kron(rng.integers(0, 255, (6, 8, 3)), np.ones((8, 8, 1))).astype(np.uint8)
    noisy = np.clip(blocks + rng.normal(0.0, 8.0, blocks.shape), 0, 255).astype(np.uint8)
    loss = [np.abs(compress([noisy], q)[0].astype(float) - noisy).mean() for q in (30, 60, 95)]
    assert loss[0] > loss[1] > loss[2] > 0.0
    red = np.full((16, 16, 3), (200, 30, 20), np.uint8)
    assert compress([red])[0].mean(axis=(0, 1)) == pytest.approx(
        [200, 30, 20], abs=4
    )  # channels keep their order


@pytest.mark.parametrize("steps", [1, 10, 300])
def test_people_vary_as_much_in_a_short_walk_as_in_a_long_one(steps, rng):
    drawn = np.array([_wander(steps, 140.0, rng) for _ in range(500)])
    assert np.sqrt(np.mean(drawn**2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_a_low_picture_is_rendered_and_a_lower_one_refused(seed):
    assert render(seed, frames=2, size=(90, LOWEST)).images[0].shape == (LOWEST, 90, 3)
    with pytest.raises(ValueError, match=f"at least {LOWEST} px high"):
        render(seed, frames=2, size=(90, LOWEST - 1))


def test_a_walk_too_long_for_its_picture_is_refused_with_what_to_do():
    with pytest.raises(ValueError, match="render fewer frames or a wider picture"):
        render(1, frames=300)
