"""Whether a worker would give the bytes that this process would: versions, sources, and a few frames."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from forests.crops import CropWriter
from forests.growing import GrowthConfig, grow_class_tree
from forests.samples import Samples
from pipelines.ablate.digests import sources_digest
from pipelines.corpus.frameinfo import info_line
from pipelines.corpus.header import Header, software_versions
from pipelines.corpus.write import FrameSource, make_frame, stored
from pipelines.errors import UserError
from synth.camera import Camera

_PACKAGES = ("storage", "synth", "forests", "pipelines")
_N_PROBES = 3
_SIDE = 24


@dataclass(frozen=True)
class Likeness:
    """What has to agree.

    Attributes:
        software: Versions of Python and the libraries, and a digest of this program's sources.
        frames: SHA-256 over the bytes of a few frames, or of a tree.
        processor: Named in the error if the frames differ.
    """

    software: Mapping[str, str]
    frames: str
    processor: str


def likeness_of(header: Header, source: FrameSource) -> Likeness:
    """That of this process, for the frames of a corpus."""
    digest = hashlib.sha256()
    for number in sorted({header.n_frames * k // _N_PROBES for k in range(_N_PROBES)}):
        frame = make_frame(source, number)
        digest.update(info_line(frame).encode())
        for name, values in sorted(stored(frame, header).items()):
            digest.update(name.encode() + values.tobytes())
    return Likeness(software(), digest.hexdigest(), processor())


def likeness_of_growing() -> Likeness:
    """That of this process, for trees: one of a few made-up images."""
    x, y = np.meshgrid(np.arange(_SIDE), np.arange(_SIDE))
    images = [(1800 + (13 * x + 7 * y * (k + 1)) % 600).astype(np.uint16) for k in range(4)]
    with CropWriter(2**20) as writer:
        for image in images:
            writer.add(image, Camera(_SIDE, _SIDE, 60.0, 60.0, _SIDE / 2, _SIDE / 2, "probe"))
        crops = writer.finish()
    frame, row, column = (part.ravel() for part in np.indices((len(images), _SIDE, _SIDE)))
    z_mm = np.stack(images).ravel()
    classes = ((z_mm // 100) % 5).astype(np.uint8)
    samples = Samples(
        frame.astype(np.int32),
        (column + 1).astype(np.int16),
        (row + 1).astype(np.int16),
        z_mm,
        classes + np.uint8(1),
    )
    grown = grow_class_tree(crops, samples, classes, 5, GrowthConfig(max_depth=6, n_candidates=100), 0, 0, 1)
    digest = hashlib.sha256(grown.nodes.tobytes() + grown.order.tobytes())
    return Likeness(software(), digest.hexdigest(), processor())


def software() -> dict[str, str]:
    """Versions that bytes may hang on."""
    return software_versions() | {"source": sources_digest(*_PACKAGES)[:12]}


def processor() -> str:
    """Name of the processor that kernels are compiled for."""
    import llvmlite.binding

    return str(llvmlite.binding.get_host_cpu_name())


def refuse_unlike(there: Likeness, here: Likeness, worker: str) -> None:
    """Makes sure that a worker gives the same bytes.

    Args:
        there: What was found on the worker.
        here: What must be.
        worker: Its address.

    Raises:
        UserError: It does not.
    """
    for name, version in here.software.items():
        if (other := there.software.get(name)) != version:
            raise UserError(
                f"the worker {worker} has {name} {other}, the command has {version}; install the same on all"
            )
    if there.frames != here.frames:
        raise UserError(
            f"the worker {worker} (processor {there.processor}) gives other bytes than the command (processor "
            f"{here.processor}); use machines of one kind"
        )
