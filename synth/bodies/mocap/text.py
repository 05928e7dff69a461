"""The text of a BVH file: bytes of any encoding, numbers with points or commas, frames over one line or several."""

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e9
"""Numbers beyond this are no lengths or angles; a frame that holds one counts as broken."""
_NOT_FINITE = re.compile(r"^[+-]?1\.#[A-Z]+\d*$|^[+-]?nan(\(.*\))?$|^[+-]?inf(inity)?$", re.IGNORECASE)
"""How programs write NaN and infinity, such as -nan(ind) and 1.#QNAN."""
_DECIMAL_COMMA = re.compile(r"^[+-]?\d*,\d+(e[+-]?\d+)?$", re.IGNORECASE)
_COMMENT = re.compile(r"(^|\s)(#|//).*")
_COMMA_WITHIN = re.compile(r"\d,\d|[-+\s],\d")
_POINT_WITHIN = re.compile(r"\d\.|\.\d")
_BLANKS = " \t\0\x1a\f\v"
LONGEST_LINE = 2_000_000
"""Characters of a line; frames of 1000 joints are far shorter."""
_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
_LETTERS_FOR_BYTES = {code: code + 0x100 for code in range(0x80, 0xA1)}
"""Bytes that Latin-1 takes for blanks and controls are parts of letters in other encodings."""


class MocapError(ValueError):
    """Motion capture that cannot be used; the message says what is wrong with it."""


class Line(NamedTuple):
    """A line that says something.

    Attributes:
        number: Its place in the file, from 1.
        text: Without blanks around it and without comments.
    """

    number: int
    text: str


def decode_bvh(data: bytes) -> str:
    """The text of a BVH file's bytes.

    UTF-8 and UTF-16 are read as they are. Of any other encoding (Latin-1, GBK, Shift-JIS) every byte that is not
    ASCII becomes a letter: only names can hold such bytes, and which letters they are does not matter.

    Args:
        data: The whole file.

    Raises:
        MocapError: It begins as UTF-16 does and is none.
    """
    if data[:2] in _BYTE_ORDER_MARKS or data[:2].upper() in (b"H\0", b"\0H"):
        encoding = (
            "utf-16" if data[:2] in _BYTE_ORDER_MARKS else ("utf-16-be" if data[:1] == b"\0" else "utf-16-le")
        )
        try:
            return data.decode(encoding)
        except UnicodeDecodeError:
            raise MocapError("is neither text in UTF-16, as its first bytes say, nor a BVH file") from None
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1").translate(_LETTERS_FOR_BYTES)


def lines_of(text: str, first: int = 1) -> Iterator[Line]:
    """The lines that are not empty, without comments (from `#` or `//` on), one at a time.

    Args:
        text: Part of a file.
        first: Number of its first line in the file.

    Raises:
        MocapError: A line is longer than any frame.
    """
    begin, number = 0, first
    while begin < len(text):
        end = text.find("\n", begin)
        end = len(text) if end < 0 else end
        if end - begin > LONGEST_LINE:
            raise MocapError(f"line {number}: has {end - begin} characters; at most {LONGEST_LINE} are read")
        line = text[begin:end]
        if "#" in line or "/" in line:
            line = _COMMENT.sub("", line)
        line = line.strip(_BLANKS)
        if line:
            yield Line(number, line)
        begin, number = end + 1, number + 1


def number_of(word: str, where: str = "") -> float:
    """A finite number, with a point or a comma.

    Args:
        word: As in the file.
        where: Begins the message, such as "line 3: ".

    Raises:
        MocapError: It is none, or larger than any length or angle.
    """
    try:
        value = float(word.replace(",", ".") if _DECIMAL_COMMA.match(word) else word)
    except ValueError:
        raise MocapError(f"{where}has {word[:40]!r} where a number is expected") from None
    if not abs(value) <= LARGEST:
        raise MocapError(f"{where}has {word[:40]!r} where a finite number up to {LARGEST:g} is expected")
    return value


def number_after(label: str, lines: Iterator[Line]) -> float:
    """The number that the next line gives after its label, as in `Frames: 40`.

    Args:
        label: Words, in either case.
        lines: The MOTION part from that line on.

    Raises:
        MocapError: The line has another label, or no number.
    """
    number, line = next(lines, (0, ""))
    pattern = r"\s*".join(map(re.escape, label.split())) + r"\s*:?\s*(.*)"
    found = re.fullmatch(pattern, line, re.IGNORECASE)
    where = f"line {number}: " if number else ""
    if found is None:
        raise MocapError(f"{where}has {line[:40]!r} where '{label}:' is expected")
    return number_of(found[1], where)


class Frames(NamedTuple):
    """Frames as they are written.

    Attributes:
        values: (n, n_channels); frames with NaN, infinity or numbers beyond `LARGEST` hold NaN.
        n_left_over: Lines after the last whole frame that were not read.
    """

    values: NDArray[np.float64]
    n_left_over: int


class _Gathered:
    """The lines of a frame that is not whole yet."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self.numbers: list[int] = []
        self.n_first = 0

    def add(self, line: Line) -> None:
        words = line.text.split()
        self.n_first = self.n_first if self.numbers else len(words)
        self.words += words
        self.numbers.append(line.number)

    def is_not_whole(self, frame: int, n_channels: int) -> MocapError:
        first, last = self.numbers[0], self.numbers[-1]
        where = f"line {first}" if first == last else f"lines {first}-{last}"
        return MocapError(
            f"{where}: frame {frame} has {self.n_first} values; the channels of the hierarchy are {n_channels}, and "
            "a frame may go over several lines, but must end where a line ends"
        )


def read_frames(lines: Iterable[Line], n_promised: int, n_channels: int) -> Frames:
    """Reads frames that take a line each, or several lines each, or share a line.

    What follows the promised frames is read as long as it is whole frames. Where there are fewer, the file was cut,
    and an unfinished last frame is left out.

    Args:
        lines: The values, with decimal points.
        n_promised: Number of frames that the file says it has.
        n_channels: Values of a frame.

    Raises:
        MocapError: There is no whole frame, or a line with too many values or something that is no number.
    """
    rows: list[NDArray[np.float64]] = []
    n_frames, n_lines, n_left_over = 0, 0, 0
    open_frame = _Gathered()
    for line in lines:
        if n_left_over:
            n_left_over += 1
            continue
        open_frame.add(line)
        n_lines += 1
        if len(open_frame.words) < n_channels:
            continue
        try:
            if n_channels == 0 or len(open_frame.words) % n_channels:
                raise open_frame.is_not_whole(n_frames, n_channels)
            rows.append(_values_of(open_frame.words, line, n_frames).reshape(-1, n_channels))
        except MocapError:
            if n_frames < n_promised:
                raise
            n_left_over = len(open_frame.numbers)
            continue
        n_frames += len(rows[-1])
        open_frame = _Gathered()
    n_open = len(open_frame.numbers)
    is_line_a_frame = n_lines - n_open == n_frames
    if not n_left_over and n_open and is_line_a_frame and 0 < n_frames < n_promised <= n_frames + n_open:
        raise open_frame.is_not_whole(n_frames, n_channels)
    if not n_frames:
        raise MocapError(f"has no complete line of values, but says Frames: {n_promised}")
    return Frames(np.concatenate(rows), n_left_over or n_open)


def with_points(motion: str, first: int) -> str:
    """Numbers with decimal points, if all of them had commas; commas between numbers become blanks.

    Args:
        motion: Frame time and values.
        first: Number of its first line in the file.

    Raises:
        MocapError: Some numbers have points and others commas.
    """
    if "," not in motion:
        return motion
    mixed = _COMMA_WITHIN.search(motion)
    if mixed is None:
        return motion.replace(",", " ")
    if _POINT_WITHIN.search(motion):
        number = first + motion.count("\n", 0, mixed.start())
        raise MocapError(
            f"line {number}: has commas within numbers beside decimal points elsewhere; write all numbers with "
            "decimal points or all with decimal commas, with blanks between them"
        )
    return motion.replace(",", ".")


def _values_of(words: list[str], line: Line, frame: int) -> NDArray[np.float64]:
    """(n,) numbers; NaN for NaN, infinity and what is too large."""
    if "n" in line.text.lower() or "#" in line.text:
        words = [_NOT_FINITE.sub("nan", word) for word in words]
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        wrong = next(word for word in words if not _is_number(word))
        raise MocapError(
            f"line {line.number}: frame {frame} holds a value that is not a number: {wrong[:40]!r}"
        ) from None
    values[~(np.abs(values) <= LARGEST)] = np.nan
    return values


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
