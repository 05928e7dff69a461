"""What every frame must obey; each law says in one sentence how a frame breaks it."""

from collections.abc import Callable, Iterator

import numpy as np

from pipelines.corpus.header import Header
from synth.frame import Frame
from synth.vocabulary import JointState

LIMIT_SLACK = 1e-4
"""Joint angles are stored as float32; they may pass their limit by this [rad]."""


def broken_laws(frame: Frame, header: Header) -> Iterator[str]:
    """What is wrong with a frame, sentence by sentence; nothing if it is sound."""
    for law in LAWS:
        yield from law(frame, header)


def counted(what: str, is_wrong: np.ndarray) -> Iterator[str]:
    """A sentence that says in how many pixels something is wrong, if in any."""
    if is_wrong.any():
        yield f"{what} in {int(is_wrong.sum())} pixels"


def _is_unlabelled(header: Header) -> bool:
    """Whether the corpus is recorded depth without joints, whose pixels nothing can label."""
    return bool(header.config.get("import", {}).get("parts") == "none")


def _composite(frame: Frame, header: Header) -> Iterator[str]:
    person, thing = frame.part > 0, frame.occluder > 0
    is_wrong = (frame.depth > 0) != (person | thing)
    if _is_unlabelled(header):
        is_wrong = (frame.depth == 0) & (person | thing)
    yield from counted("depth without a label, or a label without depth", is_wrong)
    yield from counted("a person and an object", person & thing)
    yield from counted("an object class without an instance, or the other way", (frame.instance > 0) != thing)


def _body_layer(frame: Frame, header: Header) -> Iterator[str]:
    person, alone = frame.part > 0, frame.body_part > 0
    both = alone & (frame.depth > 0)
    yield from counted(
        "depth of the body without a part, or a part without depth", (frame.body_depth > 0) != alone
    )
    yield from counted("composite behind the body", both & (frame.depth > frame.body_depth))
    differs = (frame.part != frame.body_part) | (frame.depth != frame.body_depth)
    yield from counted("a seen person that differs from the body layer", person & differs)
    yield from counted("a body that neither layer of the composite covers", alone & (frame.depth == 0))


def _labels(frame: Frame, header: Header) -> Iterator[str]:
    for name, image, table in (
        ("part", frame.part, "parts"),
        ("body_part", frame.body_part, "parts"),
        ("occluder", frame.occluder, "occluders"),
        ("joint_state", frame.joint_state, "joint_states"),
    ):
        n_known = len(header.labels[table])
        if int(image.max()) >= n_known:
            yield f"{name} has code {int(image.max())}; known are 0..{n_known - 1}"


def _joints(frame: Frame, header: Header) -> Iterator[str]:
    for name in ("joint_visible_fraction", "part_visible_fraction", "angles", "T_world_root"):
        if not np.isfinite(getattr(frame, name)).all():
            yield f"{name} is not finite"
    for name in ("joint_visible_fraction", "part_visible_fraction"):
        share = getattr(frame, name)
        if ((share < 0) | (share > 1)).any():
            yield f"{name} is not in 0..1"
    is_known = frame.joint_state != JointState.UNKNOWN
    if not np.isfinite(frame.joints[is_known]).all():
        yield "joints is not finite where the joint is known"
    if not np.isnan(frame.joints[~is_known]).all() or frame.joint_visible_fraction[~is_known].any():
        yield "an unknown joint has a place or a visible fraction"
    for i, (name, lower, upper) in enumerate(header.labels["angles"]):
        angle = float(frame.angles[i])
        if not lower - LIMIT_SLACK <= angle <= upper + LIMIT_SLACK:
            yield f"joint angle {name}={angle:.4f} rad is outside its limits {lower:.4f}..{upper:.4f}"


def _poses(frame: Frame, header: Header) -> Iterator[str]:
    for name in ("T_world_root", "T_world_camera"):
        if not is_rigid(getattr(frame, name)):
            yield f"{name} is no rigid transform"


def is_rigid(T: np.ndarray) -> bool:
    """Whether a (4, 4) matrix turns and moves and does nothing else."""
    R = T[:3, :3]
    return bool(np.allclose(R @ R.T, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0 and T[3, 3] == 1.0)


def _record(frame: Frame, header: Header) -> Iterator[str]:
    info = frame.info
    n_alone, n_seen = int((frame.body_part > 0).sum()), int((frame.part > 0).sum())
    if n_alone and abs(info.visible_fraction - n_seen / n_alone) > 1e-6:
        yield f"visible fraction is {info.visible_fraction:.6f}, the images say {n_seen / n_alone:.6f}"
    classes = {item.instance: item.class_name for item in info.objects}
    if len(classes) != len(info.objects):
        yield "two objects have one instance number"
    seen = np.unique(frame.instance.astype(np.uint16) * 256 + frame.occluder)
    for instance, code in ((int(pair) // 256, int(pair) % 256) for pair in seen if pair):
        names = header.labels["occluders"]
        if code < len(names) and classes.get(instance) != names[code]:
            yield f"instance {instance} is {names[code]} in the image and {classes.get(instance)} in the record"


LAWS: tuple[Callable[[Frame, Header], Iterator[str]], ...] = (
    _composite, _body_layer, _labels, _joints, _poses, _record,
)  # fmt: skip
"""All laws."""
