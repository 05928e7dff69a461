"""Folders or an option tell whose recording a file is; dates never do."""

from pathlib import Path

import pytest

from pipelines.importing.subjects import Named, numbers_in_folders, subjects_of, trial_and_subject
from synth.bodies.mocap.text import MocapError

ROOT = Path("/d/recordings")


def told(*names: str, subject_from: str = "auto") -> list[tuple[str, str] | None]:
    files = [ROOT / name for name in names]
    found = subjects_of(files, ROOT, subject_from)
    return [named[:2] if isinstance(named := found[path], Named) else None for path in files]


@pytest.mark.parametrize(
    ("path", "names"),
    [
        ("x/02_06.bvh", ("02_06", "02")), ("x/02_06_daz.bvh", ("02_06", "02")), ("x/143_6_a_2.bvh", ("143_6", "143")),
        ("/d/anna/walk.bvh", ("anna_walk", "anna")), ("/d/anna/2_walk.bvh", ("anna_2_walk", "anna")),
        ("/d/anna/2023_05_12_take1.bvh", ("anna_2023_05_12_take1", "anna")),
        ("/d/anna/23_05_12_take1.bvh", ("anna_23_05_12_take1", "anna")),
        ("/d/anna/12_05_2023.bvh", ("anna_12_05_2023", "anna")),
        ("/d/anna/20230512_01.bvh", ("anna_20230512_01", "anna")), ("/d/anna/2023_05.bvh", ("anna_2023_05", "anna")),
        ("/d/anna/2023-05-12/walk.bvh", ("anna_2023-05-12_walk", "anna")),
        ("/d/anna/20230512/walk.bvh", ("anna_20230512_walk", "anna")),
        ("/d/anna/session 2/walk.bvh", ("anna_session 2_walk", "anna")),
    ],
)  # fmt: skip
def test_numbers_and_folders_tell_subjects_and_dates_do_not(path, names):
    assert trial_and_subject(Path(path)) == names


@pytest.mark.parametrize(
    ("name", "subject"),
    [
        ("anna_walk", "anna"), ("2023_05_12_anna_walk", "anna"), ("20230512-ben-1", "ben"),
        ("dance1_subject2", "subject2"),
        ("take1_2023-05-12_carl", "carl"), ("Actor_07_run", "Actor_07"), ("02_06_daz", "02"),
    ],
)  # fmt: skip
def test_names_tell_subjects_where_the_option_says_so(name, subject):
    assert trial_and_subject(Path(f"/d/x/{name}.bvh"), "name")[1] == subject


def test_a_name_that_tells_no_subject_is_refused():
    with pytest.raises(MocapError, match="tells no subject"):
        trial_and_subject(Path("/d/2023_05_12_take1.bvh"), "name")
    assert told("2023_05_12.bvh", "anna_1.bvh", subject_from="name") == [None, ("anna_1", "anna")]


def test_folders_tell_subjects_where_the_option_says_so():
    assert told("anna/05_12.bvh", "ben/05_12.bvh", subject_from="folder") == [
        ("anna_05_12", "anna"),
        ("ben_05_12", "ben"),
    ]


def test_folders_of_one_name_in_different_places_are_different_people():
    assert told("here/p1/a.bvh", "there/p1/a.bvh", "there/p2/a.bvh") == [
        ("here_p1_a", "here/p1"),
        ("there_p1_a", "there/p1"),
        ("p2_a", "p2"),
    ]
    assert told("anna/day1/a.bvh", "anna/day2/a.bvh", "ben/day1/a.bvh") == [
        ("anna_day1_a", "anna"),
        ("anna_day2_a", "anna"),
        ("ben_day1_a", "ben"),
    ]


def test_a_folder_of_sessions_alone_is_the_subject():
    assert told("2023_05_12/a.bvh", "2023_05_13/a.bvh") == [
        ("recordings_2023_05_12_a", "recordings"),
        ("recordings_2023_05_13_a", "recordings"),
    ]


def test_numbers_that_several_folders_share_are_named():
    files = [ROOT / name for name in ("anna/05_12.bvh", "ben/05_13.bvh", "ben/06_01.bvh", "anna/walk.bvh")]
    assert list(numbers_in_folders(subjects_of(files, ROOT, "auto"))) == [("05", ["anna", "ben"])]
