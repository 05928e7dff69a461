"""Digested files come back as they were, mapped or read, and every other file is refused in one sentence."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
import safetensors.numpy

from storage.digested import DTYPES, DigestedFormat, read_digested, write_digested


class OddFileError(ValueError):
    """What these tests' files raise."""


FORM = DigestedFormat("undergrowth thing", 3, "thing file", OddFileError, "make it again")
ARRAYS = {
    "depths": np.arange(24, dtype=np.int16).reshape(2, 3, 4),
    "marks": np.array([True, False, True]),
    "places": np.linspace(0, 1, 9).reshape(3, 3),
    "nothing": np.zeros((0, 3), np.uint16),
    "one": np.array(7, np.uint8),
}
METADATA = {"name": "Ä", "scores": [0.1, None], "nested": {"b": 1, "a": True}}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "odd.safetensors"


@pytest.mark.parametrize("is_mapped", [False, True])
def test_what_is_written_is_read(path, is_mapped):
    write_digested(path, FORM, "k", ARRAYS, METADATA)
    kind, arrays, metadata = read_digested(path, FORM, "k", is_mapped)
    assert (kind, metadata) == ("k", METADATA)
    assert arrays.keys() == ARRAYS.keys()
    for name, values in arrays.items():
        assert (values.dtype, values.shape) == (ARRAYS[name].dtype, ARRAYS[name].shape)
        np.testing.assert_array_equal(values, ARRAYS[name])
        assert values.flags.c_contiguous
        assert values.flags.aligned
        assert values.flags.writeable


def test_writing_to_mapped_arrays_leaves_the_file_alone(path):
    write_digested(path, FORM, "k", ARRAYS, METADATA)
    before = path.read_bytes()
    arrays = read_digested(path, FORM, is_mapped=True).arrays
    arrays["depths"][:] = -1
    assert path.read_bytes() == before
    np.testing.assert_array_equal(read_digested(path, FORM, is_mapped=True).arrays["depths"], ARRAYS["depths"])


def test_mapped_arrays_outlive_the_file_that_replaces_theirs(path):
    write_digested(path, FORM, "k", ARRAYS, METADATA)
    arrays = read_digested(path, FORM, is_mapped=True).arrays
    write_digested(path, FORM, "k", {name: np.zeros_like(values) for name, values in ARRAYS.items()}, {})
    np.testing.assert_array_equal(arrays["places"], ARRAYS["places"])


@pytest.mark.parametrize("dtype", list(DTYPES.values()), ids=list(DTYPES))
def test_every_type_is_kept(path, dtype):
    values = {"a": np.array([0, 1, 1, 0, 1], dtype), "b": np.ones((), dtype)}
    write_digested(path, FORM, "k", values, {})
    for name, there in read_digested(path, FORM).arrays.items():
        assert there.dtype == dtype
        np.testing.assert_array_equal(there, values[name])


def test_arrays_of_others_at_odd_places_are_aligned(path):
    """safetensors itself puts wide items first; a file that does not is read all the same."""
    write_digested(path, FORM, "k", {"a": np.arange(3.0), "b": np.ones(1, np.uint8)}, {})
    whole = path.read_bytes()
    (size,) = struct.unpack("<Q", whole[:8])
    header = json.loads(whole[8 : 8 + size])
    header["b"]["data_offsets"], header["a"]["data_offsets"] = [0, 1], [1, 25]
    text = json.dumps(header).encode()
    body = whole[8 + size :]
    path.write_bytes(struct.pack("<Q", len(text)) + text + body[24:] + body[:24])
    values = read_digested(path, FORM).arrays["a"]
    assert values.flags.aligned
    np.testing.assert_array_equal(values, np.arange(3.0))


def test_a_foreign_file_is_refused_before_it_is_read(path):
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(OddFileError, match="is no thing file: it is not in the safetensors format"):
        read_digested(path, FORM)
    text = json.dumps({"a": {"dtype": "U8", "shape": [2**38], "data_offsets": [0, 2**38]}}).encode()
    with path.open("wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        file.truncate(8 + len(text) + 2**38)
    with pytest.raises(OddFileError, match="is no undergrowth thing: it lacks the metadata; of an older one"):
        read_digested(path, FORM)


@pytest.mark.parametrize(
    "document",
    [
        "null",
        "[]",
        "7",
        '"undergrowth thing"',
        '{"format": null}',
        "{" * 5000,
        "[" * 100_000,
        "1" * 5000,
    ],
)
def test_metadata_of_any_shape_is_refused(path, document):
    path.write_bytes(safetensors.numpy.save({"a": np.zeros(3)}, {"undergrowth": document}))
    with pytest.raises(OddFileError, match="lacks the metadata"):
        read_digested(path, FORM)


def test_another_version_kind_or_format_says_so(path):
    write_digested(path, FORM, "k", ARRAYS, METADATA)
    with pytest.raises(OddFileError, match="holds a thing of kind 'k', must be 'm'"):
        read_digested(path, FORM, "m")
    with pytest.raises(OddFileError, match="has format version 3; this program reads version 4; make it again"):
        read_digested(path, replace(FORM, version=4))
    with pytest.raises(OddFileError, match="is no undergrowth even thing: it lacks the metadata"):
        read_digested(path, replace(FORM, name="undergrowth even thing"))
    with pytest.raises(OddFileError, match="there is no thing file"):
        read_digested(path.with_name("none"), FORM)
    with pytest.raises(OddFileError, match="is a folder, not a thing file"):
        read_digested(path.parent, FORM)


@pytest.mark.parametrize("error", [KeyError("a"), TypeError("b"), OddFileError("d"), IndexError("e")])
def test_errors_about_contents_name_the_file(path, error):
    def build():
        with FORM.naming_file(path):
            raise error

    with pytest.raises(OddFileError, match=r"odd\.safetensors holds no usable thing: "):
        build()
