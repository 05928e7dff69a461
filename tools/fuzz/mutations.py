"""Damage to files, drawn from a generator: bits, bytes, lines, numbers, values of JSON."""

import copy
import json
from typing import Any

import numpy as np

NUMBERS = (
    "1e999", "-1e999", "nan", "inf", "-1", "0", "1e9", "1000000000", "99999999999999999999", "", "abc", "1,5",
    "0x10", "4294967295", "-2147483649",
)  # fmt: skip
"""What may stand in the place of a number of a text file."""
INTEGERS = (0, 1, 255, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1)
"""What may stand in the place of a number of a binary file."""
VALUES: tuple[Any, ...] = (
    None, [], {}, True, -1, 0, 1e308, 10**30, "", "x", [[]], {"a": None}, [None], "\udcff", 0.5,
)  # fmt: skip
"""What may stand in the place of a value of a JSON file."""
DEEP = 3000
"""Lists inside one another that a parser may not follow."""


def damaged_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """A binary file with one to three kinds of damage."""
    for _ in range(int(rng.integers(1, 4))):
        data = _BINARY[int(rng.integers(len(_BINARY)))](data, rng)
    return data


def damaged_text(data: bytes, rng: np.random.Generator) -> bytes:
    """A text file with one to three kinds of damage, to its bytes or its lines and numbers."""
    for _ in range(int(rng.integers(1, 4))):
        ways = _TEXT if rng.random() < 0.7 else _BINARY
        data = ways[int(rng.integers(len(ways)))](data, rng)
    return data


def damaged_json(data: bytes, rng: np.random.Generator) -> bytes:
    """A file of JSON, or of JSON lines, of which a value is another; sometimes the text is damaged."""
    if rng.random() < 0.3:
        return damaged_text(data, rng)
    try:
        return json.dumps(damaged_value(json.loads(data), rng)).encode()
    except ValueError:
        lines = data.splitlines()
        k = int(rng.integers(len(lines)))
        lines[k] = json.dumps(damaged_value(json.loads(lines[k]), rng)).encode()
        return b"\n".join(lines) + b"\n"


def damaged_value(document: Any, rng: np.random.Generator) -> Any:
    """JSON values of which one to three are replaced, missing, doubled or deep."""
    for _ in range(int(rng.integers(1, 4))):
        places = list(_places(document))
        if not places:
            return document
        above, key = places[int(rng.integers(len(places)))]
        way = int(rng.integers(8))
        if way == 0:
            del above[key]
        elif way == 1 and isinstance(above, list):
            above.append(above[key])
        elif way == 2:
            above[key] = {str(key): above[key]}
        elif way == 3:
            above[key] = [above[key]]
        elif way == 4 and rng.random() < 0.1:
            above[key] = json.loads("[" * 500 + "]" * 500)
        else:
            above[key] = copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
    return document


def _places(value: Any) -> Any:
    """Every value with what holds it."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in list(items):
        yield value, key
        yield from _places(item)


def _place(data: bytes, rng: np.random.Generator) -> int:
    """Anywhere, half of the times in the head, where the headers are."""
    return int(rng.integers(min(len(data), 400) if rng.random() < 0.5 else len(data))) if data else 0


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 9)) if out else 0):
        out[_place(data, rng)] ^= 1 << int(rng.integers(8))
    return bytes(out)


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: _place(data, rng)]


def _drop(data: bytes, rng: np.random.Generator) -> bytes:
    start = _place(data, rng)
    return data[:start] + data[start + int(rng.integers(1, 64)) :]


def _insert(data: bytes, rng: np.random.Generator) -> bytes:
    start = _place(data, rng)
    return data[:start] + rng.bytes(int(rng.integers(1, 64))) + data[start:]


def _repeat(data: bytes, rng: np.random.Generator) -> bytes:
    start = _place(data, rng)
    piece = data[start : start + int(rng.integers(1, 256))]
    return data[:start] + piece * int(rng.integers(2, 5)) + data[start:]


def _fill(data: bytes, rng: np.random.Generator) -> bytes:
    start, n = _place(data, rng), int(rng.integers(1, 64))
    piece = (b"\x00" * n, b"\xff" * n, rng.bytes(n))[int(rng.integers(3))]
    return data[:start] + piece + data[start + n :]


def _huge(data: bytes, rng: np.random.Generator) -> bytes:
    start, size = _place(data, rng), int(rng.choice([1, 2, 4, 8]))
    value = INTEGERS[int(rng.integers(len(INTEGERS)))] % 2 ** (8 * size)
    return data[:start] + value.to_bytes(size, "little" if rng.random() < 0.8 else "big") + data[start + size :]


_BINARY = (_flip, _flip, _cut, _drop, _insert, _repeat, _fill, _huge, _huge)


def _of_lines(data: bytes, rng: np.random.Generator) -> bytes:
    """Takes away, doubles or exchanges lines."""
    lines = data.split(b"\n")
    i, j = (int(k) for k in rng.integers(len(lines), size=2))
    way = int(rng.integers(4))
    if way == 0:
        del lines[i]
    elif way == 1:
        lines.insert(j, lines[i])
    elif way == 2:
        lines[i], lines[j] = lines[j], lines[i]
    else:
        lines = lines[: i + 1]
    return b"\n".join(lines)


def _of_numbers(data: bytes, rng: np.random.Generator) -> bytes:
    """Replaces a word, mostly a number, by another."""
    lines = data.split(b"\n")
    numbered = [k for k, line in enumerate(lines) if any(48 <= byte < 58 for byte in line)]
    head = numbered[:20] if rng.random() < 0.5 else numbered
    if not head:
        return data
    k = head[int(rng.integers(len(head)))]
    words = lines[k].split(b" ")
    word = int(rng.integers(len(words)))
    words[word] = NUMBERS[int(rng.integers(len(NUMBERS)))].encode()
    lines[k] = b" ".join(words)
    return b"\n".join(lines)


def _digits(data: bytes, rng: np.random.Generator) -> bytes:
    """Exchanges the digits of a number inside a word, such as of an attribute."""
    places = [k for k in range(len(data)) if 48 <= data[k] < 58]
    if not places:
        return data
    start = places[int(rng.integers(len(places)))]
    end = start
    while end < len(data) and 48 <= data[end] < 58:
        end += 1
    return data[:start] + NUMBERS[int(rng.integers(len(NUMBERS)))].encode() + data[end:]


def _odd_text(data: bytes, rng: np.random.Generator) -> bytes:
    start = _place(data, rng)
    piece = (
        b"\xff\xfe",
        "ä".encode("latin-1"),
        b"\x00",
        b"[" * DEEP,
        b"{" * DEEP,
        b"9" * 5000,
        b"\r",
        b"\xef\xbb\xbf",
    )
    return data[:start] + piece[int(rng.integers(len(piece)))] + data[start:]


_TEXT = (_of_lines, _of_lines, _of_numbers, _of_numbers, _digits, _digits, _odd_text)
