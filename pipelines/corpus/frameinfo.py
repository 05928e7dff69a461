"""FrameInfo as JSON lines: one file a shard, one line a frame."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

from pipelines.corpus.header import plain_json
from pipelines.corpus.manifest import SplitIds
from pipelines.errors import CorpusError
from synth.frame import Frame, FrameInfo, ObjectRecord, PersonRecord, RoomFrame, RoomInfo


def info_path(root: Path, shard: int) -> Path:
    """File of a shard's frame records."""
    return root / "frames" / f"{shard:06d}.jsonl"


def info_line(frame: Frame | RoomFrame) -> str:
    """A frame's record with its camera's name; the seed stands in corpus.json."""
    values = dict(vars(frame.info))
    del values["seed"]
    if isinstance(frame.info, RoomInfo):
        values["people"] = [vars(person) for person in frame.info.people]
    values["objects"] = [vars(item) for item in frame.info.objects]
    values["camera"] = frame.camera.name
    return json.dumps(values, separators=(",", ":"), default=plain_json)


def parse_info(line: str, seed: int) -> tuple[FrameInfo, str]:
    """Undoes `info_line`: the record and the camera's name.

    Raises:
        ValueError, KeyError, TypeError, AttributeError, RecursionError: It is no record.
    """
    values = json.loads(line)
    camera, objects = values.pop("camera"), _objects(values.pop("objects"))
    info = FrameInfo(seed=seed, objects=objects, **values)
    if not isinstance(camera, str) or not _is_record(info):
        raise ValueError("a value is of the wrong type")
    return info, camera


def parse_room_info(line: str, seed: int) -> tuple[RoomInfo, str]:
    """Undoes `info_line` for a whole scene; errors as of `parse_info`."""
    values = json.loads(line)
    camera, objects, listed = values.pop("camera"), _objects(values.pop("objects")), values.pop("people")
    people = tuple(PersonRecord(**item) for item in listed)
    info = RoomInfo(seed=seed, objects=objects, people=people, **values)
    names = (camera, info.split, info.room_id)
    if (
        not all(isinstance(name, str) for name in names)
        or type(info.index) is not int
        or not isinstance(info.room, dict)
        or not isinstance(listed, list)
        or not all(map(_is_person, people))
    ):
        raise ValueError("a value is of the wrong type")
    return info, camera


def _objects(listed: object) -> tuple[ObjectRecord, ...]:
    if not isinstance(listed, list):
        raise ValueError("a value is of the wrong type")
    objects = tuple(
        ObjectRecord(
            **item | {"T_world_object": _rows(item["T_world_object"]), "contacts": tuple(item["contacts"])}
        )
        for item in listed
    )
    if not all(map(_is_object, objects)):
        raise ValueError("a value is of the wrong type")
    return objects


def _is_person(item: PersonRecord) -> bool:
    names = (item.subject_id, item.pose_family, item.pose_id, item.group, item.activity)
    return (
        all(isinstance(name, str) for name in names)
        and all(type(number) is int for number in (item.number, item.group_number, item.seat))
        and isinstance(item.subject, dict)
        and _is_number(item.visible_fraction)
    )


def _is_record(info: FrameInfo) -> bool:
    names = (info.split, info.subject_id, info.scene_family, info.pose_family, info.pose_id)
    return (
        all(isinstance(name, str) for name in names)
        and type(info.index) is int
        and isinstance(info.subject, dict)
        and _is_number(info.visible_fraction)
    )


def _is_object(item: ObjectRecord) -> bool:
    rows = item.T_world_object
    return (
        all(isinstance(name, str) for name in (item.class_name, item.spec_id, *item.contacts))
        and type(item.instance) is int
        and isinstance(item.spec, dict)
        and _is_number(item.visible_fraction)
        and len(rows) == 4
        and all(len(row) == 4 and all(map(_is_number, row)) for row in rows)
    )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _rows(T: list[list[float]]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in T)


def read_lines(path: Path, n_frames: int) -> list[str]:
    """The records of a shard, not yet parsed.

    Raises:
        CorpusError: The file is missing or damaged.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        raise CorpusError(f"{path} is missing") from None
    except UnicodeDecodeError as error:
        raise CorpusError(f"{path} is damaged: {error}") from None
    if len(lines) != n_frames:
        raise CorpusError(f"{path} is damaged: it holds {len(lines)} records, not {n_frames}")
    return lines


def split_ids(infos: Sequence[FrameInfo | RoomInfo]) -> dict[str, SplitIds]:
    """Who and what stands in the frames, by split."""
    out = {}
    for split in sorted({info.split for info in infos}):
        of_split = [info for info in infos if info.split == split]
        out[split] = SplitIds(
            n_frames=len(of_split),
            subjects=sorted({who.subject_id for info in of_split for who in people_of(info)}),
            objects=sorted({item.spec_id for info in of_split for item in info.objects}),
            poses=sorted({who.pose_id for info in of_split for who in people_of(info)}),
        )
    return out


def people_of(info: FrameInfo | RoomInfo) -> tuple[FrameInfo | PersonRecord, ...]:
    """Who is in a frame: the record itself, where it is of one person."""
    return info.people if isinstance(info, RoomInfo) else (info,)
