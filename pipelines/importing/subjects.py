"""Whose recording a file is: told by its folder or by its name, never by digits that may be a date."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from synth.bodies.mocap.text import MocapError

SubjectFrom = Literal["auto", "folder", "name"]
_NUMBERED = re.compile(r"(\d{1,3})_(\d{1,3})(?:_(?!\d+(?:_|$)).*)?")
"""SUBJECT_TRIAL and SUBJECT_TRIAL_any, as in the CMU database; three numbers are a date."""
_DATE = re.compile(
    r"(?:19|20)\d\d[-_. ]?\d{1,2}(?:[-_. ]?\d{1,2})?(?!\d)"
    r"|\d{1,2}[-_. ]\d{1,2}[-_. ](?:\d{4}|\d\d)(?!\d)"
    r"|\d{6,}"
)
_PERSON = re.compile(r"(?:subject|subj|actor|person|participant|performer)[-_ ]?\d+", re.IGNORECASE)
_NO_PERSON = re.compile(r"(?:session|day|take|trial|visit|bvh|mocap|recording)s?[-_ ]?\d*", re.IGNORECASE)


class Named(NamedTuple):
    """What a recording is called.

    Attributes:
        trial: Name of the recording.
        subject: Name of the person.
        home: What all recordings of that person have in common: their folder, or their name.
    """

    trial: str
    subject: str
    home: Path


def trial_and_subject(path: Path, subject_from: SubjectFrom = "auto") -> tuple[str, str]:
    """Names of a recording and its subject.

    "auto" takes "02_06" and "02" of 02_06_x.bvh, and else the folder; "folder" takes the nearest folder that is not
    named after a date or a session, at most the folder that is imported; "name" takes what the file's name begins
    with, after any date.

    Args:
        path: The file.
        subject_from: What tells the subject.

    Raises:
        MocapError: The name tells no subject.
    """
    return _named(path, path.resolve().parents[-1], subject_from)[:2]


def subjects_of(files: Sequence[Path], root: Path, subject_from: SubjectFrom) -> dict[Path, Named | MocapError]:
    """Names of all recordings that are imported together and of their subjects, or why a file has none.

    Folders of one name in different places are different people, whose names then hold the folder above.

    Args:
        files: All of them.
        root: The folder that is imported.
        subject_from: What tells the subjects.
    """
    told: dict[Path, Named | MocapError] = {}
    for path in files:
        try:
            told[path] = _named(path, root.resolve(), subject_from)
        except MocapError as error:
            told[path] = error
    homes: dict[str, set[Path]] = {}
    for named in told.values():
        if not isinstance(named, MocapError):
            homes.setdefault(named.subject, set()).add(named.home)
    for path, named in told.items():
        if not isinstance(named, MocapError) and named.home.name and len(homes[named.subject]) > 1:
            above = named.home.parent.name
            told[path] = Named(f"{above}_{named.trial}", f"{above}/{named.subject}", named.home)
    return told


def numbers_in_folders(told: Mapping[Path, Named | MocapError]) -> Iterator[tuple[str, list[str]]]:
    """Subjects that are told by the number in a file's name and found in several folders, and these folders' names.

    Args:
        told: From `subjects_of`.
    """
    folders: dict[str, set[str]] = {}
    for path, named in told.items():
        if not isinstance(named, MocapError) and not named.home.name:
            folders.setdefault(named.subject, set()).add(path.resolve().parent.name)
    for subject, names in sorted(folders.items()):
        if len(names) > 1:
            yield subject, sorted(names)


def _named(path: Path, root: Path, subject_from: SubjectFrom) -> Named:
    numbered = _NUMBERED.fullmatch(path.stem)
    if numbered and subject_from != "folder":
        return Named(f"{numbered[1]}_{numbered[2]}", numbered[1], Path())
    folder = path.resolve().parent
    if subject_from == "name":
        return Named("_".join([*_below(root, folder), path.stem]), _subject_in(path.stem), Path())
    above = [parent for parent in (folder, *folder.parents) if parent.name and parent.is_relative_to(root)]
    person = next((parent for parent in above if parent == root or not _is_no_person(parent.name)), folder)
    return Named("_".join([person.name, *_below(person, folder), path.stem]), person.name, person)


def _below(root: Path, folder: Path) -> tuple[str, ...]:
    return folder.relative_to(root).parts if folder.is_relative_to(root) else ()


def _is_no_person(name: str) -> bool:
    """Whether a folder's name is a date or a session's."""
    return bool(_DATE.fullmatch(name) or _NO_PERSON.fullmatch(name))


def _subject_in(stem: str) -> str:
    """The subject that a file's name tells."""
    person = _PERSON.search(stem)
    if person:
        return person[0]
    words = [word for word in re.split(r"[-_. ]+", _DATE.sub("", stem)) if word]
    word = next((word for word in words if not _is_no_person(word)), None)
    if word is None:
        raise MocapError("has a name that tells no subject; put each subject's files into a folder of their own")
    return word
