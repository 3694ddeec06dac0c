"""Every spoiled input ends with one clear line, and nothing that was there before is harmed."""

import pytest

from tests.spoiled.cases import CASES
from tests.spoiled.said import check_line, letters, read_said
from tests.spoiled.stock import BEFOREHAND, COMMANDS, words
from tests.tracker.clips import everything, figtrack, succeeds
from tracker.settings import Settings

pytestmark = pytest.mark.whole

SAID = read_said()


def test_there_are_four_hundred_of_them_and_every_command_has_its_own():
    assert len({case.name for case in CASES}) == len(CASES) >= 400
    met = {words(case.command)[0] for case in CASES}
    assert met == {line.split()[0] for line in COMMANDS.values()} | {"find", "compare-runs"}


# Those that wait for somebody or take long are not run; nor those that made the folder and were silent.
@pytest.mark.parametrize(
    "command",
    [c for c in COMMANDS if c not in {"annotate", "correct", "batch", "demo", "reproduce", *BEFOREHAND}],
)
def test_nothing_keeps_a_command_from_its_work_where_nothing_is_spoiled(folder, command):
    result = figtrack(*words(command))
    assert (result.exit_code, result.stderr) == (0, "")


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_a_spoiled_input_ends_in_one_clear_line_and_harms_nothing(folder, case, capfd):
    case.spoil(folder / case.file)
    before = everything(folder)
    result = figtrack(*words(case.command))
    assert result.exit_code == case.exit, result.output
    assert letters(result.stderr, folder) == SAID[case.name], "if it is meant so: python -m tests.spoiled"
    assert capfd.readouterr().err == ""  # of libraries, which do not ask Python to print
    assert not list(folder.rglob("*.part"))
    assert case.says in result.stderr
    if case.exit == 1:
        check_line(result.stderr)
    if case.exit == 2:
        usage, _, *others = filter(None, result.stderr.splitlines())
        assert usage.startswith("Usage: ")
        assert [line.partition(":")[0] for line in others] == ["Error"]
    if case.exit:
        assert everything(folder) == before


# Of the settings those that drove sums beyond all numbers, or matrices singular, before they had both ends.
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["noise", "scale_drift", "breathing", "ankle", "mark"])
@pytest.mark.parametrize("end", ["lowest", "highest"])
def test_a_setting_at_the_end_of_its_range_still_tracks(folder, name, end):
    (folder / "s.toml").write_text(f"{name} = {ends(name)[end]!r}\n")
    succeeds(*words("track"), "--no-overlay", "--no-report")


def ends(name):
    """The least and the greatest value of a setting that is allowed; the least above 0 where 0 is not."""
    schema = Settings.model_json_schema()["properties"][name]
    return {"lowest": schema.get("minimum", 1e-6), "highest": schema["maximum"]}
