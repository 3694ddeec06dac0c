"""The settings file."""

import json
import re

import pytest

from tracker.settings import Settings, SettingsError, read_settings


@pytest.fixture
def toml(tmp_path):
    def write(content):
        path = tmp_path / "s.toml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_what_a_file_does_not_name_keeps_its_default(toml):
    assert read_settings(toml("iterations = 3\n")) == Settings(iterations=3)
    assert read_settings(toml("")) == Settings()


def test_every_fault_is_named_at_once(toml):
    path = toml('colour = "red"\niterations = 0\nspacing = nan\nmode = "new"\n')
    with pytest.raises(SettingsError) as caught:
        read_settings(path)
    text = str(caught.value)
    assert "colour: no such setting" in text
    assert "iterations: input should be greater than or equal to 1, got 0" in text
    assert re.search(r"spacing: .*, got nan", text)
    assert "mode: input should be 'full' or 'classic', got 'new'" in text
    assert "\n" not in text


@pytest.mark.parametrize("content", ["spacing: 1", "spacing = ", b"\xff\xfe\x00"])
def test_what_is_no_toml_is_refused(toml, content):
    with pytest.raises(SettingsError, match=r"s\.toml is no TOML file"):
        read_settings(toml(content))


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(SettingsError, match=r"no settings file .*absent\.toml"):
        read_settings(tmp_path / "absent.toml")


def test_every_setting_says_what_it_is():
    for name, field in Settings.model_fields.items():
        assert field.description, name


def test_defaults_survive_the_file_that_holds_them(toml):
    def literal(value):
        # Of what the settings hold, JSON writes everything as TOML does.
        return json.dumps(value)

    lines = [f"{name} = {literal(value)}" for name, value in Settings().model_dump().items()]
    assert read_settings(toml("\n".join(lines))) == Settings()
