"""Reads a corpus: frames, arrays of one field, splits, with a sensor's noise on the depth if asked."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.corpus import shards
from pipelines.corpus.fields import SHARD_FRAMES
from pipelines.corpus.frameinfo import parse_info, parse_room_info, read_lines
from pipelines.corpus.header import HEADER_NAME, Header, read_header
from pipelines.corpus.manifest import MANIFEST_NAME, ShardLine, read_manifest
from pipelines.corpus.remote.mirror import MirroredFiles, mirror
from pipelines.corpus.write import shard_files
from pipelines.errors import CorpusError
from storage.remote import url_of
from synth.camera import Camera
from synth.frame import Frame, FrameInfo, RoomFrame, RoomInfo
from synth.vocabulary import SPLITS, JointState

_SENSOR_STREAM = 0x5E450
"""Keeps the sensor's random stream apart from those that made the frame."""


class Corpus:
    """A corpus on disk, read frame by frame or field by field.

    Attributes:
        path: The folder; of a corpus at a URL, that of its files on this machine.
        url: Where the corpus is; None if it is the folder.
        header: What corpus.json says.
        indices: (n,) int64, the frame numbers that are there, rising.
    """

    def __init__(self, path: Path, header: Header, lines: dict[int, ShardLine], url: str | None = None) -> None:
        self.path = path
        self.url = url
        self.header = header
        self.lines = lines
        numbers = [np.asarray(header.frames_of(shard), dtype=np.int64) for shard in sorted(lines)]
        self.indices: NDArray[np.int64] = np.concatenate([np.empty(0, np.int64), *numbers])
        self._lines_of = lru_cache(maxsize=64)(self._read_lines)
        self.files = lru_cache(maxsize=64)(self._files_of)
        self._plain = lru_cache(maxsize=4 * len(header.fields))(shards.read_plain)

    @classmethod
    def open(cls, path: Path | str, allow_incomplete: bool = False) -> "Corpus":
        """Opens a corpus folder.

        Args:
            path: The folder that `undergrowth generate` wrote, or the URL.
            allow_incomplete: Take the frames of an unfinished corpus that are there.

        Raises:
            CorpusError: No corpus, another schema version, a damaged header or manifest, unfinished, or splits
                that share a subject, an object or a pose.
        """
        url = url_of(path)
        root = Path(path) if url is None else mirror(url)
        header = read_header(root)
        lines = read_manifest(root, header)
        if len(lines) < header.n_shards and not allow_incomplete:
            n_done = sum(line.n_frames for line in lines.values())
            raise CorpusError(f"{root} is unfinished: {n_done} of {header.n_frames} frames exist")
        check_splits(root, lines)
        return cls(root, header, lines, url)

    def __len__(self) -> int:
        """Frames that are there."""
        return len(self.indices)

    def __getitem__(self, index: int) -> Frame:
        """Frame of that number, as it was made."""
        return self.frame(index)

    def __reduce__(self) -> tuple:
        """Travels between processes as its path; reopened there."""
        return Corpus, (self.path, self.header, self.lines, self.url)

    @property
    def digest(self) -> str:
        """SHA-256 over header and manifest, which hold the digests of all else."""
        parts = (self.path / HEADER_NAME, self.path / MANIFEST_NAME)
        return hashlib.sha256(b"".join(part.read_bytes() for part in parts)).hexdigest()

    @property
    def array_names(self) -> tuple[str, ...]:
        """What `arrays` can be asked for."""
        if self.header.has_rooms:
            return tuple(self.header.fields)
        return (*self.header.fields, "body_depth", "body_part")

    def split(self, name: str) -> NDArray[np.int64]:
        """(n,) frame numbers of a split, rising.

        Raises:
            CorpusError: There is no split of that name.
        """
        if name not in SPLITS:
            raise CorpusError(f"split {name!r} is unknown; known are {', '.join(SPLITS)}")
        return self.indices[self.arrays("split", self.indices) == SPLITS.index(name)]

    def info(self, index: int) -> FrameInfo:
        """The record of a frame that shows one person, without reading its arrays."""
        self._refuse_rooms(index)
        info = self.record(index)
        assert isinstance(info, FrameInfo)
        return info

    def record(self, index: int) -> FrameInfo | RoomInfo:
        """The record of a frame of any kind, without reading its arrays."""
        return self._record(index)[0]

    def scene_record(self, index: int) -> RoomInfo:
        """The record of a whole scene, without reading its arrays."""
        info = self.record(index)
        if not isinstance(info, RoomInfo):
            raise CorpusError(f"{self.path} holds single people; read the record with corpus.info({index})")
        return info

    def _refuse_rooms(self, index: int) -> None:
        if self.header.has_rooms:
            raise CorpusError(
                f"{self.path} holds whole scenes, not single people; read frame {index} with corpus.scene({index})"
            )

    def camera(self, index: int) -> Camera:
        """The camera of a frame."""
        fx, fy, cx, cy = (float(v) for v in self.arrays("intrinsics", [index])[0])
        try:
            return Camera(self.header.width, self.header.height, fx, fy, cx, cy, self._record(index)[1])
        except ValueError as error:
            raise CorpusError(f"the intrinsics of frame {index} of {self.path} are damaged: {error}") from None

    def check_sensor(self, sensor: str | None) -> None:
        """Makes sure that a sensor model may be applied to the depth; None and "ideal" always may.

        Raises:
            CorpusError: It is unknown, or would measure a second time what a real sensor has measured.
        """
        from synth.render.sensors import SENSOR_NAMES

        if sensor is None:
            return
        if sensor not in SENSOR_NAMES:
            raise CorpusError(f"sensor {sensor!r} is unknown; known are {', '.join(SENSOR_NAMES)}")
        if self.header.is_recorded and sensor != "ideal":
            raise CorpusError(
                f"sensor={sensor!r} cannot be applied: {self.path} holds recorded frames, "
                "which already have the noise of a real sensor; leave --sensor out"
            )

    def arrays(self, name: str, indices: ArrayLike | None = None, sensor: str | None = None) -> np.ndarray:
        """One field of many frames.

        Args:
            name: One of `array_names`.
            indices: (n,) frame numbers, in any order; all of the corpus if None.
            sensor: For "depth" only: the sensor model to apply.

        Returns:
            (n, ...) in the field's dtype and unit; "joints" are NaN where unknown.

        Raises:
            CorpusError: Unknown field, frame not there, damaged or missing file.
        """
        numbers = self.indices if indices is None else np.atleast_1d(np.asarray(indices, dtype=np.int64))
        if name in ("body_depth", "body_part") and not self.header.has_rooms:
            from pipelines.corpus.layers import body_layer

            layers = [self._stored(n, numbers) for n in ("depth", "part", "hidden_depth", "hidden_part")]
            return body_layer(*layers)[0 if name == "body_depth" else 1]
        values = self._stored(name, numbers)
        if sensor is None:
            return values
        if name != "depth":
            raise CorpusError(f"sensor={sensor!r} changes only depth, not {name}")
        return np.stack([self._sensed(sensor, int(i), image) for i, image in zip(numbers, values, strict=True)])

    def frame(self, index: int, sensor: str | None = None) -> Frame:
        """One frame, to the byte as it was made; with a sensor's noise on the composite depth if asked."""
        from pipelines.corpus.layers import body_layer
        from pipelines.corpus.rooms.layers import moment_of

        number = self._checked(index)
        self._refuse_rooms(number)
        values = {name: self._stored(name, np.array([number]))[0] for name in self.header.fields}
        hidden = values.pop("hidden_depth"), values.pop("hidden_part")
        body_depth, body_part = body_layer(values["depth"], values["part"], *hidden)
        moment = moment_of(values)
        for name in ("intrinsics", "split", "clip", "time", "view"):
            values.pop(name, None)
        if sensor is not None:
            values["depth"] = self._sensed(sensor, number, values["depth"])
        return Frame(
            **values,
            body_depth=body_depth,
            body_part=body_part,
            camera=self.camera(number),
            info=self.info(number),
            moment=moment,
        )

    def scene(self, index: int, sensor: str | None = None) -> RoomFrame:
        """One whole scene, to the byte as it was made; with a sensor's noise on the composite depth if asked.

        Raises:
            CorpusError: The corpus holds single people; they are read with `frame`.
        """
        from pipelines.corpus.rooms.layers import room_frame

        number = self._checked(index)
        if not self.header.has_rooms:
            raise CorpusError(f"{self.path} holds single people; read frame {number} with corpus.frame({number})")
        values = {name: self._stored(name, np.array([number]))[0] for name in self.header.fields}
        info, _ = self._record(number)
        assert isinstance(info, RoomInfo)
        frame = room_frame(values, self.camera(number), info)
        return frame if sensor is None else replace(frame, depth=self._sensed(sensor, number, frame.depth))

    def scenes(self, split: str | None = None, sensor: str | None = None) -> Iterator[RoomFrame]:
        """All whole scenes, or those of one split, in order of number."""
        for index in self.indices if split is None else self.split(split):
            yield self.scene(int(index), sensor)

    def frames(self, split: str | None = None, sensor: str | None = None) -> Iterator[Frame]:
        """All frames, or those of one split, in order of number."""
        for index in self.indices if split is None else self.split(split):
            yield self.frame(int(index), sensor)

    def _checked(self, index: int) -> int:
        number = int(index)
        if not 0 <= number < self.header.n_frames:
            raise IndexError(f"frame {number} is not in 0..{self.header.n_frames - 1}")
        if number // SHARD_FRAMES not in self.lines:
            raise CorpusError(f"frame {number} of {self.path} is not finished")
        return number

    def _stored(self, name: str, numbers: NDArray[np.int64]) -> np.ndarray:
        fields = self.header.fields
        if name not in fields:
            raise CorpusError(f"array {name!r} is unknown; known are {', '.join(self.array_names)}")
        item = fields[name]
        out = np.empty((len(numbers), *item.shape), dtype=item.dtype)
        shard_of = numbers // SHARD_FRAMES
        for shard in np.unique(shard_of).tolist():
            rows = np.flatnonzero(shard_of == shard)
            for row in rows:
                self._checked(int(numbers[row]))
            slots = (numbers[rows] - shard * SHARD_FRAMES).tolist()
            path = self.files(shard)[name]
            if item.is_image:
                out[rows] = shards.read_maps(path, item, slots, shard * SHARD_FRAMES)
            else:
                out[rows] = self._plain(path, item)[slots]
        if name == "joints":
            # Recordings may be stored with zeros for what is unknown.
            is_unknown = self._stored("joint_state", numbers) == JointState.UNKNOWN
            out[is_unknown & ~out.any(axis=-1)] = np.nan
        return out

    def _files_of(self, shard: int) -> Mapping[str, Path]:
        """Files of a shard by array name, "info" last."""
        paths = shard_files(self.path, self.header, shard)
        return paths if self.url is None else MirroredFiles(self.url, self.path, paths, self.lines[shard])

    def _read_lines(self, shard: int) -> list[str]:
        return read_lines(self.files(shard)["info"], len(self.header.frames_of(shard)))

    def _record(self, index: int) -> tuple[FrameInfo | RoomInfo, str]:
        number = self._checked(index)
        line = self._lines_of(number // SHARD_FRAMES)[number % SHARD_FRAMES]
        try:
            parse = parse_room_info if self.header.has_rooms else parse_info
            record = parse(line, self.header.seed)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise CorpusError(f"the record of frame {number} of {self.path} is damaged: {error}") from None
        if record[0].index != number:
            raise CorpusError(
                f"the record of frame {number} of {self.path} is damaged: it belongs to another frame"
            )
        return record

    def _sensed(self, sensor: str, index: int, depth: np.ndarray) -> np.ndarray:
        from synth.render.sensors import apply_sensor

        self.check_sensor(sensor)
        rng = np.random.default_rng([self.header.seed, index, _SENSOR_STREAM])
        return apply_sensor(sensor, depth, self.camera(index), rng)


def check_splits(root: Path, lines: dict[int, ShardLine]) -> None:
    """Refuses splits that share a subject, an object or a pose.

    Raises:
        CorpusError: Naming the first that is shared.
    """
    for kind in ("subjects", "objects", "poses"):
        owner: dict[str, str] = {}
        for split, name in _ids(lines.values(), kind):
            if owner.setdefault(name, split) != split:
                raise CorpusError(f"{root} shares {kind[:-1]} {name} between the splits {owner[name]} and {split}")


def _ids(lines: Iterable[ShardLine], kind: str) -> Iterator[tuple[str, str]]:
    for line in lines:
        for split, ids in line.splits.items():
            for name in getattr(ids, kind):
                yield split, name
