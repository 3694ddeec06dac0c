"""The settings file."""

import re
import tomllib

import pytest

from tests.tracker.clips import figtrack, succeeds
from tracker.settings import Settings, SettingsError, read_settings, settings_toml


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


def test_defaults_survive_the_file_that_holds_them(toml):
    assert read_settings(toml(settings_toml())) == Settings()
    assert tomllib.loads(settings_toml()).keys() == Settings.model_fields.keys()


def test_the_file_says_what_each_setting_means_its_range_and_its_default():
    blocks = dict(re.findall(r"# (\w+): (.*)\n\1 = ", settings_toml()))
    assert blocks.keys() == Settings.model_fields.keys()
    for name, field in Settings.model_fields.items():
        assert field.description, name
        assert blocks[name].startswith(f"{field.description}; ")
        assert "; default " in blocks[name]
    assert blocks["spacing"].endswith("leg lengths; at least 0.005 and at most 0.2; default 0.022")
    assert blocks["iterations"].endswith("; a whole number at least 1 and at most 100; default 4")
    assert blocks["mode"].endswith('; "full" or "classic"; default "full"')
    assert "; a list of 1 or more, each above 0 and at most 1; default [" in blocks["blurs"]


def test_a_range_that_the_file_names_is_the_one_that_is_kept(toml):
    for name, low, high in re.findall(r"# (\w+): .*; at least (\S+) and at most (\d\S*);", settings_toml()):
        if "list" in name or isinstance(getattr(Settings(), name), tuple):
            continue
        read_settings(toml(f"{name} = {low}\n"))
        with pytest.raises(SettingsError, match=name):
            read_settings(toml(f"{name} = {float(high) + 1}\n"))
        with pytest.raises(SettingsError, match=name):
            read_settings(toml(f"{name} = {float(low) - 1}\n"))


def test_the_command_writes_the_file_and_replaces_none_unasked(tmp_path):
    assert figtrack("settings").stdout == settings_toml()
    path = tmp_path / "neue Werte" / "s.toml"
    succeeds("settings", "--out", path)
    assert read_settings(path) == Settings()
    path.write_text("mine = 1\n")
    result = figtrack("settings", "--out", path)
    assert result.exit_code == 1
    assert result.stderr.startswith("error: ")
    assert path.read_text() == "mine = 1\n"
    succeeds("settings", "--out", path, "--overwrite")
    assert read_settings(path) == Settings()


def test_a_file_with_a_byte_order_mark_is_read(toml):
    assert read_settings(toml("noise = 7.5\n".encode("utf-8-sig"))).noise == 7.5
