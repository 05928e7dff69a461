"""What an installation brings, and what the locks hold."""

import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
IMPORTED_AS = {
    "google-crc32c": "google_crc32c",
    "opencv-python-headless": "cv2",
    "mapbox-earcut": "mapbox_earcut",
    "pycollada": "collada",
}


def name_of(requirement):
    return re.match(r"[A-Za-z0-9_.-]+", requirement)[0]


def imported_modules():
    """Top-level names that the packages import, anywhere in a file."""
    found = set()
    for package in ("storage", "synth", "forests", "nets", "pipelines"):
        for path in (ROOT / package).rglob("*.py"):
            for words in re.findall(r"^\s*(?:import|from) ([\w.]+)", path.read_text(encoding="utf-8"), re.M):
                found.add(words.split(".")[0])
    return found


def third_party(names):
    return {name for name in names if name not in sys.stdlib_module_names}


def test_every_dependency_is_used():
    wanted = {IMPORTED_AS.get(name_of(line), name_of(line)) for line in PROJECT["dependencies"]}
    assert wanted - imported_modules() == set()


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-dev.lock"])
def test_a_lock_holds_every_dependency_at_a_version_that_is_allowed(lock):
    text = (ROOT / lock).read_text(encoding="utf-8")
    pinned = dict(re.findall(r"^([A-Za-z0-9_.-]+)==([0-9.]+)", text, re.M))
    for line in PROJECT["dependencies"]:
        name, _, least = line.partition(">=")
        version = pinned[name.lower()]
        assert [int(part) for part in version.split(".")] >= [int(part) for part in least.split(".")], line


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-dev.lock"])
def test_a_lock_names_no_index(lock):
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert "://" not in text
    assert not re.search(r"^--(?!hash)", text, re.M)


def test_these_alone_are_extras():
    assert set(PROJECT["optional-dependencies"]) == {"cluster", "gl", "nets", "online", "remote", "viewer"}


def test_the_installed_command_is_the_front_door():
    (command,) = importlib.metadata.entry_points(group="console_scripts", name="undergrowth")
    assert command.value == PROJECT["scripts"]["undergrowth"]


def test_synth_forests_and_nets_show_no_progress():
    for package in ("synth", "forests", "nets"):
        for path in (ROOT / package).rglob("*.py"):
            assert "tqdm" not in path.read_text(encoding="utf-8"), path


def test_pipelines_show_progress_through_one_module():
    users = [p for p in (ROOT / "pipelines").rglob("*.py") if "tqdm" in p.read_text(encoding="utf-8")]
    assert users == [ROOT / "pipelines" / "progress.py"]
