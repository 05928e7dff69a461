"""Whether a worker would give the bytes that this process would: versions, sources, and a few frames."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from pipelines.ablate.digests import sources_digest
from pipelines.corpus.frameinfo import info_line
from pipelines.corpus.header import Header, software_versions
from pipelines.corpus.write import FrameSource, make_frame, stored
from pipelines.errors import UserError

_PACKAGES = ("storage", "synth", "forests", "pipelines")
_N_PROBES = 3


@dataclass(frozen=True)
class Likeness:
    """What has to agree.

    Attributes:
        software: Versions of Python and the libraries, and a digest of this program's sources.
        frames: SHA-256 over the bytes of a few frames.
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
            f"the worker {worker} (processor {there.processor}) draws other bytes than the command (processor "
            f"{here.processor}); use machines of one kind"
        )
