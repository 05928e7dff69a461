"""MOTChallenge text: a folder a clip and camera with depth images, seqinfo.ini and gt/gt.txt (Milan et al. 2016)."""

import configparser
import io
from pathlib import Path

from pipelines.corpus.rooms.clips import Clip, clips_of
from pipelines.errors import UserError
from pipelines.export.records import ExportJob, png_bytes
from pipelines.export.rooms.coco import IGNORED_BELOW
from synth.frame import RoomFrame

PEDESTRIAN = 1
"""MOTChallenge's class of people."""


def export_mot(job: ExportJob) -> None:
    """Writes SPLIT/CLIP-VIEW/{img1/NNNNNN.png, gt/gt.txt, seqinfo.ini}.

    Raises:
        UserError: The corpus has no clips.
    """
    if not job.corpus.header.clip_steps:
        raise UserError(f"{job.corpus.path} has no clips; MOTChallenge's files need scene.clip")
    for clip in clips_of(job.corpus, job.split):
        for view in range(clip.n_views):
            _write_sequence(job, clip, view)


def _write_sequence(job: ExportJob, clip: Clip, view: int) -> None:
    folder = job.folder / job.split / f"{clip.number:05d}-{view}"
    for name in ("img1", "gt"):
        (folder / name).mkdir(parents=True)
    lines = []
    for step in range(clip.n_steps):
        frame = job.scene(int(clip.numbers[step, view]))
        (folder / "img1" / f"{step + 1:06d}.png").write_bytes(png_bytes(frame.depth))
        lines += truth_lines(frame, step + 1)
        job.on_frame()
    (folder / "gt" / "gt.txt").write_text("".join(lines), encoding="ascii")
    _write_seqinfo(folder, clip)


def truth_lines(frame: RoomFrame, number: int) -> list[str]:
    """Lines of gt.txt: frame, identity, left, top, width, height, counts, class, visible share.

    Boxes are those of the whole body, as far as the image reaches; who is visible to less than a tenth does not count.

    Args:
        frame: The frame.
        number: Its number in the sequence, from 1.
    """
    lines = []
    for view, record in zip(frame.people, frame.info.people, strict=True):
        left, top, width, height = view.box
        if width == 0:
            continue
        counts = int(record.visible_fraction >= IGNORED_BELOW)
        lines.append(
            f"{number},{record.number},{left + 1},{top + 1},{width},{height},{counts},{PEDESTRIAN},"
            f"{record.visible_fraction:.4f}\n"
        )
    return lines


def _write_seqinfo(folder: Path, clip: Clip) -> None:
    header = clip.corpus.header
    info = configparser.ConfigParser()
    info.optionxform = str  # type: ignore[assignment,method-assign]
    info["Sequence"] = {
        "name": folder.name,
        "imDir": "img1",
        "frameRate": f"{clip.fps:g}",
        "seqLength": str(clip.n_steps),
        "imWidth": str(header.width),
        "imHeight": str(header.height),
        "imExt": ".png",
    }
    text = io.StringIO()
    info.write(text, space_around_delimiters=False)
    (folder / "seqinfo.ini").write_text(text.getvalue(), encoding="ascii")
