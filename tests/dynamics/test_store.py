"""Model files: there and back, and every way of being no good."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from dynamics.store import VERSION, ModelError, load, save
from tests.dynamics.hmms import random_hmm
from tests.dynamics.periodic.strides import two_strides
from tests.oracles import random_slds

ARRAYS = ("pi0", "Pi", "A", "b", "Q", "C", "R", "mean0", "cov0")
DAMAGED = "no model file|damaged|format version"


@pytest.fixture
def slds(rng):
    return replace(random_slds(2, order=2, travelling=("a",), rng=rng), labels=("walk", "jog"), fps=29.97)


@pytest.fixture
def path(slds, tmp_path):
    save(slds, tmp_path / "model.npz", "a test")
    return tmp_path / "model.npz"


def assert_same(one, other):
    assert type(one) is type(other)
    for field in fields(one):
        got, want = (getattr(model, field.name) for model in (one, other))
        assert type(got) is type(want)
        assert_array_equal(got, want)


def rewrite(path, *, entries=None, drop=(), **arrays):
    """The same file with some entries of its header, or some of its arrays, replaced."""
    with np.load(path) as archive:
        parts = {name: archive[name] for name in archive.files if name not in drop}
    if entries is not None:
        parts["header"] = np.array(json.dumps(json.loads(str(parts["header"])) | entries))
    np.savez_compressed(path, **(parts | arrays))


def test_what_is_saved_is_what_is_loaded(slds, path):
    assert_same(load(path), slds)
    assert_same(load(str(path)), slds)


@pytest.mark.parametrize("make", [lambda rng: replace(random_hmm(2, rng, M=3), fps=25.0), two_strides])
def test_models_of_other_kinds_are_kept_as_what_they_are(make, tmp_path, rng):
    model = make(rng)
    save(model, tmp_path / "other.npz", "a test")
    assert_same(load(tmp_path / "other.npz"), model)


def test_a_name_without_ending_is_kept_as_it_is(slds, tmp_path):
    save(slds, tmp_path / "walk", "a test")
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk"]
    assert_same(load(tmp_path / "walk"), slds)


def test_the_file_says_what_it_was_learned_from_and_holds_no_pickles(path):
    with np.load(path, allow_pickle=False) as archive:
        header = json.loads(str(archive["header"]))
        kinds = {archive[name].dtype for name in ARRAYS}
    assert header["origin"] == "a test"
    assert header["version"] == VERSION
    assert kinds == {np.dtype(np.float64)}


def test_saving_again_replaces_the_model(slds, path):
    other = replace(slds, fps=60.0)
    save(other, path, "again")
    assert_same(load(path), other)
    assert [entry.name for entry in path.parent.iterdir()] == ["model.npz"]


def test_a_failed_save_leaves_the_older_model_and_nothing_else(slds, path, monkeypatch):
    def half(file, **arrays):
        file.write(b"PK half a model")
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez_compressed", half)
    with pytest.raises(OSError, match="disk full"):
        save(replace(slds, fps=60.0), path, "too large")
    assert [entry.name for entry in path.parent.iterdir()] == ["model.npz"]
    assert_same(load(path), slds)


def test_saving_where_nothing_can_be_saved_leaves_nothing(slds, tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="taken"):
        save(slds, tmp_path / "taken", "a test")
    assert [entry.name for entry in tmp_path.iterdir()] == ["taken"]
    with pytest.raises(FileNotFoundError):
        save(slds, tmp_path / "nowhere" / "model.npz", "a test")


@pytest.mark.parametrize("version", [VERSION + 1, 0, None, "1"])
def test_another_format_version_says_which(version, path):
    rewrite(path, entries={"version": version})
    with pytest.raises(
        ModelError, match=f"has format version {version}, this program reads {VERSION}; update"
    ):
        load(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        *(
            ({"entries": {"format": kind}}, "; learn one")
            for kind in ("figtrack-track", None, 5, ["figtrack-slds"])
        ),
        *(({"header": np.array(text)}, "; learn one") for text in ("[1, 2]", "3", '"walk"')),
        *(({"header": np.array(text)}, " or is damaged; copy or learn it again") for text in ("{", "")),
    ],
)
def test_another_kind_of_file_and_a_header_that_is_none_are_refused(change, said, path):
    rewrite(path, **change)
    with pytest.raises(ModelError, match=f"is no model file{said}"):
        load(path)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_missing_array_is_named(name, path):
    rewrite(path, drop=(name,))
    with pytest.raises(ModelError, match=f"damaged: .*'{name}'"):
        load(path)


LABELS = [[None, None], [1, 2], "ab", ["walk", ""], ["walk", "\x1b[2J"], [["a"], "b"]]
RATES = ["fast", "30", None, True, [30], -30.0, float("inf"), float("nan")]


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"names": None}, "names must be a list of printable texts"),
        ({"names": [], "travelling": []}, "names must name a freedom at least"),
        ({"names": 5}, "names must be a list of printable texts"),
        ({"names": ["a", "a"]}, "names must differ"),
        ({"travelling": ["z"]}, "travelling freedoms must be among"),
        ({"labels": ["walk"]}, "every state needs a label"),
        *(({"labels": labels}, "labels must be a list of printable texts") for labels in LABELS),
        ({"fps": 10**400}, "int too large"),
        *(({"fps": fps}, "fps must be") for fps in RATES),
    ],
)
def test_a_header_that_does_not_fit_is_damage(entries, said, path):
    rewrite(path, entries=entries)
    with pytest.raises(ModelError, match=rf"model\.npz is damaged: {said}"):
        load(path)


def indefinite(cov):
    wrong = cov.copy()
    wrong[..., 0, 0] *= -1.0
    return wrong


@pytest.mark.parametrize("name", ["Q", "R", "cov0"])
@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda cov: cov * (1.0 + np.eye(cov.shape[-1], k=1)), "{} must be symmetric; of state 0 it is not"),
        (np.negative, "{} must be positive definite; of state 0 it is not"),
        (indefinite, "{} must be positive definite; of state 0 it is not"),
        (np.zeros_like, "{} must be positive definite; of state 0 it is not"),
        (lambda cov: cov + 0.5j, "{} must hold real numbers, not complex128"),
        (lambda cov: cov.astype(str), "{} must hold real numbers, not <U"),
        (lambda cov: cov[0], "{} must have shape"),
        (lambda cov: np.full_like(cov, np.nan), "{} must be finite"),
    ],
)
def test_what_is_no_covariance_is_refused_where_it_is_read(name, spoil, said, path, slds):
    rewrite(path, **{name: spoil(getattr(slds, name))})
    with pytest.raises(ModelError, match=rf"model\.npz is damaged: {said.replace('{}', name)}"):
        load(path)


BELOW = np.kron([[0.0, 0.0], [0.1, 0.0]], np.ones((2, 2)))  # between two poses of two freedoms
CARRY = "A and b must carry the last pose over"


@pytest.mark.parametrize(
    ("name", "spoil", "said"),
    [
        ("R", lambda R: np.eye(3), r"R must have shape \(2, 2\); got \(3, 3\)"),
        ("b", lambda b: b[0], "b must have 2 dimensions, not 1"),  # which tells the sizes
        ("Q", lambda Q: Q + np.eye(4), "Q must be zero but for the pose"),
        ("A", lambda A: A + BELOW, CARRY),
        ("A", lambda A: A + BELOW[:, ::-1], CARRY),
        ("b", lambda b: b + np.repeat([0.0, 0.1], 2), CARRY),
        ("C", lambda C: C[:, ::-1], "C must measure the pose"),
    ],
)
def test_arrays_that_do_not_fit_are_named(name, spoil, said, path, slds):
    rewrite(path, **{name: spoil(getattr(slds, name))})
    with pytest.raises(ModelError, match=f"is damaged: {said}"):
        load(path)


@pytest.mark.parametrize("entry", [{"labels": ("walk", "slow\xa0walk")}, {"names": ("a", "a")}])
def test_what_could_not_be_loaded_is_not_saved(entry, slds, tmp_path):
    with pytest.raises(ValueError, match=r"the model cannot be saved: .*; rename them"):
        save(replace(slds, **entry), tmp_path / "model.npz", "a test")


def test_freedoms_that_drift_are_not_saved(slds, tmp_path):
    drifting = slds.with_drifts(("z",), np.ones(1), np.ones(1), np.ones(1))
    with pytest.raises(ValueError, match="holds no freedoms that drift; got z"):
        save(drifting, tmp_path / "model.npz", "a test")
    assert not list(tmp_path.iterdir())


def test_a_small_file_that_unpacks_to_much_is_not_unpacked(path):
    rewrite(path, more=np.zeros(2**23 + 1))
    assert path.stat().st_size < 10**5
    with pytest.raises(ModelError, match="unpacks to more than any model holds"):
        load(path)


def test_a_hidden_markov_models_covariances_are_looked_at_too(tmp_path, rng):
    save(replace(random_hmm(2, rng), cov=np.stack([np.eye(2), -np.eye(2)])), tmp_path / "h.npz", "a test")
    with pytest.raises(ModelError, match="cov must be positive definite; of state 1"):
        load(tmp_path / "h.npz")


def test_a_cut_file_is_refused_wherever_it_is_cut(path):
    whole = path.read_bytes()
    for length in [*range(0, len(whole), 37), len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(ModelError, match=DAMAGED):
            load(path)


def test_flipped_bits_are_found_or_harmless(slds, path, rng):
    whole = path.read_bytes()
    found = 0
    for at in range(0, len(whole), 5):
        damaged = bytearray(whole)
        damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            got = load(path)
        except ModelError:
            found += 1
        else:  # in dates and attributes, which an archive keeps besides
            assert_same(got, slds)
    # Measured with every byte: 70 % of the flips are found.
    assert found > 0.5 * len(whole) / 5
