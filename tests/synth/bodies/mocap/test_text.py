"""The same motion in any encoding and layout is read as the same numbers; what is wrong is told with its line."""

import re

import numpy as np
import pytest

from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.roles import joints_of
from synth.bodies.mocap.text import MocapError, decode_bvh
from tests.mocap_files import SIT, STAND, bvh_text, standing_root

HEAD, MARK, VALUES = bvh_text([(a, standing_root(a)) for a in (STAND, SIT, STAND)]).partition("MOTION\n")
TEXT = HEAD + MARK + VALUES
ROWS = VALUES.splitlines()[2:]
TRUTH = parse_bvh(TEXT)


def motion(rows: list[str], n: int | str = 4, time: str = "Frame Time: 0.033333") -> str:
    return "\n".join([HEAD + MARK + f"Frames: {n}", time, *rows]) + "\n"


def named(prefix: str) -> str:
    return re.sub(r"(ROOT|JOINT) ", rf"\1 {prefix}", TEXT)


def wrapped(row: str, n: int) -> list[str]:
    words = row.split()
    return [" ".join(words[k : k + n]) for k in range(0, len(words), n)]


@pytest.mark.parametrize(
    ("prefix", "encoding"),
    [
        ("Müller_", "latin-1"), ("Müller_", "cp1252"), ("Jürgen:", "latin-1"), ("É_", "latin-1"), ("舞者_", "gbk"),
        ("舞者:", "big5"), ("ボーン_", "shift_jis"), ("能ポ_", "shift_jis"), ("홍길동_", "euc_kr"), ("Анна_", "cp1251"),
        ("Müller_", "utf-8"), ("舞者_", "utf-8-sig"), ("舞者_", "utf-16"), ("Müller_", "utf-16-le"), ("", "utf-16-be"),
    ],
)  # fmt: skip
def test_names_in_any_encoding(prefix, encoding):
    bvh = parse_bvh(decode_bvh(named(prefix).encode(encoding)))
    assert np.array_equal(bvh.values, TRUTH.values)
    assert joints_of(bvh)[1] == joints_of(TRUTH)[1]
    assert all(joint.name.isprintable() for joint in bvh.joints)


def test_half_a_utf_16_file_is_no_bvh_file():
    with pytest.raises(MocapError, match="UTF-16"):
        decode_bvh(TEXT.encode("utf-16")[:-1])


@pytest.mark.parametrize(
    "text",
    [
        TEXT.replace(".", ","), HEAD + (MARK + VALUES).replace(".", ","), HEAD.replace(".", ",") + MARK + VALUES,
        motion([row.replace(" ", ", ") for row in ROWS]), motion([row + " # frame" for row in ROWS]),
        motion([f"{row} // {k}" for k, row in enumerate(ROWS)]),
        motion([line for row in ROWS for line in (row, "", " ")]),
        TEXT.replace("\n", "\r\n"), TEXT.replace("\n", "\r"), TEXT.replace(" ", "\t"), TEXT.replace("\n", " \n"),
        "\ufeff" + TEXT, "\n\n" + TEXT, "# made by hand\n" + TEXT, TEXT + "\n\n\x1a", TEXT + "\0",
        motion(ROWS, time="Frame Time 0.033333"), motion(ROWS, time="FrameTime:0.033333"), TEXT.replace("\n{", " {"),
        re.sub(r"(\w)\n\s*{", r"\1{", TEXT), motion([line for row in ROWS for line in wrapped(row, 40)]),
        motion([line for row in ROWS for line in wrapped(row, 1)]), motion([" ".join(ROWS)]),
        motion([ROWS[0] + " " + ROWS[1], ROWS[2], *wrapped(ROWS[3], 7)]),
    ],
)  # fmt: skip
def test_any_layout_holds_the_same_motion(text):
    bvh = parse_bvh(text)
    assert bvh.joints == TRUTH.joints
    assert np.array_equal(bvh.values, TRUTH.values)
    assert (bvh.frame_time, bvh.n_promised) == (0.033333, 4)


@pytest.mark.parametrize(
    ("rows", "promised", "n_read", "n_left"),
    [
        (ROWS, 3, 4, 0), (ROWS, 1, 4, 0), ([*ROWS, "1 2 3"], 4, 4, 1), ([*ROWS, "END"], 4, 4, 1),
        ([*ROWS, "end of the take", "bye"], 4, 4, 2), (ROWS, 9, 4, 0), ([*ROWS, "1 2 3"], 9, 4, 1),
        ([*ROWS, "x " * 81], 4, 4, 1), ([line for row in ROWS for line in wrapped(row, 40)], 3, 4, 0),
        ([line for row in ROWS for line in wrapped(row, 40)][:-1], 4, 3, 0), (ROWS, 10**9, 4, 0),
    ],
)  # fmt: skip
def test_a_wrong_number_of_frames_is_no_reason_to_refuse(rows, promised, n_read, n_left):
    bvh = parse_bvh(motion(rows, promised))
    assert (len(bvh.values), bvh.n_promised) == (n_read, promised)
    assert bvh.n_left_over == n_left or n_read < promised
    assert np.array_equal(bvh.values, TRUTH.values[:n_read])


N = HEAD.count("\n")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (motion([ROWS[0], ROWS[1].partition(" ")[2], *ROWS[2:]]), rf"lines {N + 5}-{N + 6}: frame 1 has \d+ values"),
        (motion([ROWS[0], ROWS[1] + " 1", *ROWS[2:]]), rf"line {N + 5}: frame 1 has \d+ values"),
        (motion([ROWS[0], "x" + ROWS[1], *ROWS[2:]]), rf"line {N + 5}: frame 1 holds a value .* 'x"),
        (motion([*ROWS[:3], ROWS[3].replace(".", ",")]), rf"line {N + 7}: has commas within numbers beside decimal"),
        (motion(ROWS, 0), "has 0 frames"), (motion([], 4), "no complete line"), (motion(ROWS, "many"), "'many'"),
        (motion(ROWS, "nan"), rf"line {N + 2}: has 'nan' where a finite"), (motion(ROWS, -3), "has -3 frames"),
        (motion(ROWS, time="Frame Time: 0"), r"of 0\.0 s"), (motion(ROWS, time="0.03"), "'Frame Time:' is expected"),
        (TEXT.replace("CHANNELS 3", "CHANNELS 1000000000", 1), r"line \d+: promises 1e\+09 channels for 'Spine'"),
        (TEXT.replace("CHANNELS 3", "CHANNELS -1", 1), "promises -1 channels"),
        (TEXT.replace("CHANNELS 3", "CHANNELS 2.5", 1), "promises 2.5 channels"),
        (TEXT.replace("OFFSET 0.000000", "OFFSET 1e300", 1), "where a finite number up to 1e"),
        (HEAD + "x" * 2_100_000 + "\n" + MARK + VALUES, "characters; at most"),
        (motion(["1 " * 1_100_000]), "characters"),
        (HEAD.replace("HIERARCHY", "HIERARCHY\n" + "ROOT a\n{\n" * 3000) + MARK + VALUES, "where|breaks off"),
        ("HIERARCHY\n" + "\n" * 4_000_001 + MARK, "HIERARCHY of"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_line(text, message):
    with pytest.raises(MocapError, match=message):
        parse_bvh(text)


def test_numbers_beyond_any_length_are_broken_frames():
    bvh = parse_bvh(motion([ROWS[0], "1e200 " + ROWS[1].partition(" ")[2], *ROWS[2:]]))
    assert bvh.frame.tolist() == [0, 2, 3]
    assert bvh.n_broken == 1


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """With a byte changed, bytes left out or put in, or the end cut off."""
    start, end = np.sort(rng.integers(len(data), size=2))
    junk = [b"1e999", b"\0", b"{", b"nan", b"}", b"-", b"\xff", b"9" * 400]
    kinds = (
        data[:start] + bytes([rng.integers(256)]) + data[start + 1 :],
        data[:start] + data[min(end, start + 200) :],
        data[:end],
        data[:start] + junk[rng.integers(len(junk))] + data[start:],
    )
    return kinds[rng.integers(len(kinds))]


def test_mutated_files_are_read_or_refused_in_one_line_and_nothing_else():
    rng = np.random.default_rng(0)
    refused = []
    for _ in range(400):
        try:
            parse_bvh(decode_bvh(mutated(TEXT.encode(), rng)))
        except MocapError as error:
            refused.append(str(error))
    assert 0 < len(refused) < 400
    assert not any("\n" in message for message in refused)
