"""What every whole scene must obey; each law says in one sentence how a frame breaks it."""

from collections.abc import Callable, Iterator

import numpy as np

from pipelines.corpus.header import Header
from pipelines.corpus.laws import LIMIT_SLACK, counted, is_rigid
from synth.frame import RoomFrame
from synth.vocabulary import JointState


def broken_room_laws(frame: RoomFrame, header: Header) -> Iterator[str]:
    """What is wrong with a scene, sentence by sentence; nothing if it is sound."""
    for law in ROOM_LAWS:
        yield from law(frame, header)


def _composite(frame: RoomFrame, header: Header) -> Iterator[str]:
    person, thing = frame.person > 0, frame.occluder > 0
    yield from counted("depth without a label, or a label without depth", (frame.depth > 0) != (person | thing))
    yield from counted("a person and an object or surface", person & thing)
    yield from counted("a part without a person, or the other way", (frame.part > 0) != person)
    yield from counted("a class without an instance, or the other way", (frame.instance > 0) != thing)
    yield from counted("a person who is not in the record", frame.person > len(frame.people))


def _body_layers(frame: RoomFrame, header: Header) -> Iterator[str]:
    if len(frame.people) != len(frame.info.people):
        yield f"the arrays hold {len(frame.people)} people, the record {len(frame.info.people)}"
    height, width = frame.depth.shape
    for k, view in enumerate(frame.people, start=1):
        left, top, wide, high = view.box
        if left + wide > width or top + high > height:
            yield f"the box {view.box} of person {k} reaches out of the image"
            continue
        outside = frame.person == k
        outside[view.window] = False
        yield from counted(f"person {k} outside their box", outside)
        seen = frame.person[view.window] == k
        alone, depth = view.body_part > 0, frame.depth[view.window]
        yield from counted(
            f"depth of the body of person {k} without a part, or a part without depth",
            (view.body_depth > 0) != alone,
        )
        yield from counted(f"composite behind the body of person {k}", alone & (depth > view.body_depth))
        yield from counted(f"a body of person {k} that no layer covers", alone & (depth == 0))
        differs = (frame.part[view.window] != view.body_part) | (depth != view.body_depth)
        yield from counted(f"a seen person {k} who differs from the body layer", seen & differs)


def _labels(frame: RoomFrame, header: Header) -> Iterator[str]:
    checked = [("part", frame.part, "parts"), ("occluder", frame.occluder, "occluders")]
    for k, view in enumerate(frame.people, start=1):
        checked.append((f"body_part of person {k}", view.body_part, "parts"))
        checked.append((f"joint_state of person {k}", view.joint_state, "joint_states"))
    for name, image, table in checked:
        n_known = len(header.labels[table])
        code = int(image.max(initial=0))
        if code >= n_known:
            yield f"{name} has code {code}; known are 0..{n_known - 1}"


def _joints(frame: RoomFrame, header: Header) -> Iterator[str]:
    for k, view in enumerate(frame.people, start=1):
        for name in ("joint_visible_fraction", "part_visible_fraction"):
            share = getattr(view, name)
            if not ((share >= 0) & (share <= 1)).all():
                yield f"{name} of person {k} is not in 0..1"
        if not np.isfinite(view.joints).all() or (view.joint_state == JointState.UNKNOWN).any():
            yield f"a joint of person {k} is not known"
        for i, (name, lower, upper) in enumerate(header.labels["angles"]):
            angle = float(view.angles[i])
            if not lower - LIMIT_SLACK <= angle <= upper + LIMIT_SLACK:
                yield (
                    f"joint angle {name}={angle:.4f} rad of person {k} is outside its limits "
                    f"{lower:.4f}..{upper:.4f}"
                )
        if not is_rigid(view.T_world_root):
            yield f"T_world_root of person {k} is no rigid transform"
    if not is_rigid(frame.T_world_camera):
        yield "T_world_camera is no rigid transform"


def _record(frame: RoomFrame, header: Header) -> Iterator[str]:
    info = frame.info
    for k, (view, record) in enumerate(zip(frame.people, info.people, strict=False), start=1):
        n_alone, n_seen = int((view.body_part > 0).sum()), int((frame.person == k).sum())
        if abs(record.visible_fraction - n_seen / max(n_alone, 1)) > 1e-6:
            yield (
                f"visible fraction of person {k} is {record.visible_fraction:.6f}, the images say "
                f"{n_seen / max(n_alone, 1):.6f}"
            )
        if record.number != k:
            yield f"the record of person {k} has number {record.number}"
    if len({record.subject_id for record in info.people}) != len(info.people):
        yield "somebody is in the frame twice"
    classes = {item.instance: item.class_name for item in info.objects}
    if len(classes) != len(info.objects):
        yield "two objects have one instance number"
    seen_pairs = np.unique(frame.instance.astype(np.uint16) * 256 + frame.occluder)
    names = header.labels["occluders"]
    for instance, code in ((int(pair) // 256, int(pair) % 256) for pair in seen_pairs if pair):
        if code < len(names) and classes.get(instance) != names[code]:
            yield f"instance {instance} is {names[code]} in the image and {classes.get(instance)} in the record"


ROOM_LAWS: tuple[Callable[[RoomFrame, Header], Iterator[str]], ...] = (
    _composite, _body_layers, _labels, _joints, _record,
)  # fmt: skip
"""All laws."""
