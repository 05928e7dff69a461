"""Every format of depth files gives the same depth; damaged, foreign and oversized files are one sentence."""

import contextlib
import io
import os
import resource
import struct
import zlib
from dataclasses import replace

import cv2
import numpy as np
import OpenEXR
import pytest
from toy_recording import silhouette, standing

from pipelines.errors import UserError
from pipelines.recordings.layout import CameraLayout, Layout
from pipelines.recordings.readers import SUFFIXES, read_image

LAYOUT = Layout("*", "png", 64, 48, CameraLayout(60.0, 60.0, 31.5, 23.5))
PCD = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 64\nHEIGHT 48\nPOINTS 3072\nDATA {}\n"


def depth_image():
    depth = silhouette(standing())
    return np.where(depth > 0, depth + np.arange(64), 0).astype(np.uint16)


def write_exr(path, channels, **attributes):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    with OpenEXR.File(header, {name: np.ascontiguousarray(image) for name, image in channels.items()}) as file:
        file.write(str(path))
    return path


def read(path, **settings):
    return read_image(path, replace(LAYOUT, format=SUFFIXES[path.suffix], **settings))


def pgm(depth, kind="P5", comment=b""):
    head = f"{kind}\n".encode() + comment + b"64 48\n65535\n"
    text = b"\n".join(b" ".join(b"%d" % z for z in row) for row in depth)
    return head + (depth.astype(">u2").tobytes() if kind == "P5" else text)


def test_grey_maps_are_read_binary_and_as_text_with_comments(tmp_path):
    depth = depth_image()
    for kind in ("P5", "P2"):
        for comment in (b"", b"# made by a camera\n"):
            path = tmp_path / "a.pgm"
            path.write_bytes(pgm(depth, kind, comment))
            np.testing.assert_array_equal(read(path), depth)
    path.write_bytes(pgm(depth.byteswap()))
    np.testing.assert_array_equal(read(path, swap_bytes=True), depth)
    cv2.imwrite(str(path), depth)
    np.testing.assert_array_equal(read(path), depth)


@pytest.mark.parametrize("dtype", [np.uint16, np.int16, np.int32, np.uint32, np.float32, np.float64])
@pytest.mark.parametrize("suffix", [".tif", ".tiff"])
def test_tiff_holds_integers_in_millimetres_or_floats_in_metres(tmp_path, dtype, suffix):
    depth = depth_image()
    values = depth / 1000.0 if np.issubdtype(dtype, np.floating) else depth
    path = tmp_path / f"a{suffix}"
    cv2.imwrite(str(path), values.astype(dtype))
    np.testing.assert_array_equal(read(path), depth)


@pytest.mark.parametrize("order", "<>")
def test_tiff_of_either_order_of_bytes(tmp_path, order):
    depth = depth_image()
    shorts = {256: 64, 257: 48, 258: 16, 259: 1, 262: 1, 277: 1, 278: 48}
    longs = {273: 8, 279: 6144}
    packed = {tag: struct.pack(order + "HHIHH", tag, 3, 1, value, 0) for tag, value in shorts.items()}
    packed |= {tag: struct.pack(order + "HHII", tag, 4, 1, value) for tag, value in longs.items()}
    directory = struct.pack(order + "H", len(packed)) + b"".join(packed[tag] for tag in sorted(packed))
    start = {"<": b"II", ">": b"MM"}[order] + struct.pack(order + "HI", 42, 8 + 6144)
    path = tmp_path / "a.tiff"
    path.write_bytes(start + depth.astype(order + "u2").tobytes() + directory + b"\0\0\0\0")
    np.testing.assert_array_equal(read(path), depth)


@pytest.mark.parametrize(
    "names", [["Z"], ["depth"], ["Y"], ["any"], ["R", "G", "B", "Z"], ["Z", "body.Z"], ["View Layer.Depth.Z", "A"]]
)
@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_the_depth_of_an_exr_is_found_among_its_channels(tmp_path, names, dtype):
    depth = depth_image()
    wanted = next(name for name in names if name.lower().rpartition(".")[2] in ("z", "depth", "y", "any"))
    channels = {name: np.full(depth.shape, 0.5, dtype) for name in names} | {
        wanted: (depth / 1000.0).astype(dtype)
    }
    found = read(write_exr(tmp_path / "a.exr", channels)).astype(int)
    assert np.abs(found - depth).max() <= (0 if dtype == np.float32 else 1)


def test_an_exr_without_a_channel_of_depth_lists_its_channels(tmp_path):
    colours = {name: np.ones((48, 64), np.float32) for name in "RGB"}
    with pytest.raises(UserError, match=r"a.exr has the channels B, G, R; one must be called z, depth, y, v"):
        read(write_exr(tmp_path / "a.exr", colours))


def test_floats_are_in_metres_unless_a_layout_says_otherwise(tmp_path):
    depth = depth_image()
    np.save(tmp_path / "a.npy", depth.astype(np.float32))
    cv2.imwrite(str(tmp_path / "a.tiff"), depth.astype(np.float32))
    write_exr(tmp_path / "a.exr", {"Z": depth.astype(np.float32)})
    points = np.zeros((depth.size, 3), "<f4")
    points[:, 2] = np.where(depth.ravel() > 0, depth.ravel(), np.nan)
    (tmp_path / "a.pcd").write_bytes(PCD.format("binary").encode() + points.tobytes())
    for path in sorted(tmp_path.iterdir()):
        with pytest.raises(
            UserError, match=r"floats are read as metres, but the values go up to \d+ .* mm_per_unit = 1 "
        ):
            read(path)
        np.testing.assert_array_equal(read(path, mm_per_unit=1.0), depth)
        with pytest.raises(UserError, match="values go up to"):
            read(path, mm_per_unit=1000.0)


def test_axes_of_one_element_do_not_matter(tmp_path):
    depth = depth_image()
    for k, shape in enumerate([(1, 48, 64), (48, 64, 1)]):
        np.save(tmp_path / f"{k}.npy", depth.reshape(shape))
        np.testing.assert_array_equal(read(tmp_path / f"{k}.npy"), depth)


def huge_png(*size):
    image = cv2.imencode(".png", np.ones((4, 4), np.uint16))[1].tobytes()
    header = b"IHDR" + struct.pack(">II", *size) + image[24:29]
    return image[:12] + header + struct.pack(">I", zlib.crc32(header)) + image[33:]


def huge_tiff():
    image = bytearray(cv2.imencode(".tiff", np.ones((4, 4), np.float32))[1].tobytes())
    (start,) = struct.unpack_from("<I", image, 4)
    (n_entries,) = struct.unpack_from("<H", image, start)
    for k in range(n_entries):
        tag, kind = struct.unpack_from("<HH", image, start + 2 + 12 * k)
        if tag in (256, 257):
            struct.pack_into("<H" if kind == 3 else "<I", image, start + 2 + 12 * k + 8, 60000)
    return bytes(image)


def huge_npy():
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)})
    return buffer.getvalue()


def pcd(**changes):
    lines = dict(line.split(" ", 1) for line in PCD.format("binary").splitlines())
    return "".join(f"{key} {value}\n" for key, value in (lines | changes).items()).encode() + bytes(3072 * 12)


PROMISES = {
    "a.png": (lambda: huge_png(30000, 30000), "has 30000x30000 pixels; at most 8192 a side"),
    "b.png": (lambda: huge_png(8000, 8000), "bytes cannot hold 8000x8000 pixels"),
    "c.png": (lambda: b"\x89PNG\r\n\x1a\n" + b"\xff\xff\xff\xffIHDR" + bytes(40), "the PNG is incomplete"),
    "a.tiff": (huge_tiff, "has 60000x60000 pixels; at most 8192 a side"),
    "a.pgm": (lambda: b"P5 999999999 999999999 65535\n", "at most 8192 a side"),
    "b.pgm": (lambda: b"P2 8000 8000 65535\n1 2 3", "fewer than its 8000x8000 numbers"),
    "a.npy": (huge_npy, "is damaged, or does not hold a plain array"),
    "b.npy": (lambda: b"\x93NUMPY\x01\x00\x10\x00" + b"(" * 16, "is damaged, or does not hold a plain array"),
    "a.pcd": (lambda: pcd(COUNT="1000000000 1 1"), "points of 4000000008 bytes would take"),
    "b.pcd": (lambda: pcd(WIDTH="1000000000"), "at most 8192 a side"),
    "c.pcd": (lambda: pcd(COUNT="1 1 1000000000"), "there is no field z"),
    "d.pcd": (lambda: pcd(SIZE="4 4 1000000000"), "a size of 1, 2, 4 or 8 bytes"),
    "e.pcd": (
        lambda: pcd(DATA="binary_compressed", WIDTH="8000", HEIGHT="8000"),
        "cut short or have the wrong number",
    ),
    "f.pcd": (lambda: pcd(DATA="ascii", COUNT="100 1 1"), "must hold 3072 points of 102 numbers"),
    "g.pcd": (lambda: b"x" * 100_000, "its header has no end"),
}


@pytest.mark.parametrize("name", PROMISES)
def test_headers_that_promise_too_much_take_no_memory(tmp_path, name):
    make, message = PROMISES[name]
    (tmp_path / name).write_bytes(make())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(UserError, match=message):
        read(tmp_path / name)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


def whole_files(folder):
    depth = depth_image()
    cv2.imwrite(str(folder / "a.png"), depth)
    cv2.imwrite(str(folder / "a.tiff"), (depth / 1000.0).astype(np.float32))
    np.save(folder / "a.npy", depth / 1000.0)
    (folder / "a.pgm").write_bytes(pgm(depth))
    (folder / "b.pgm").write_bytes(pgm(depth, "P2"))
    write_exr(folder / "a.exr", {"Z": (depth / 1000.0).astype(np.float32)})
    points = np.zeros((depth.size, 3), "<f4")
    points[:, 2] = depth.ravel() / 1000.0
    (folder / "a.pcd").write_bytes(PCD.format("binary").encode() + points.tobytes())
    return sorted(folder.iterdir())


def test_files_cut_short_anywhere_are_one_sentence(tmp_path):
    for path in whole_files(tmp_path):
        data = path.read_bytes()
        assert read(path).any()
        for share in (0.0, 0.02, 0.3, 0.6, 0.95):
            path.write_bytes(data[: int(share * len(data))])
            with pytest.raises(UserError) as caught:
                read(path)
            assert path.name in str(caught.value)
            assert "\n" not in str(caught.value)


def test_files_with_changed_bytes_never_raise_anything_else(tmp_path):
    rng = np.random.default_rng(3)
    for path in whole_files(tmp_path):
        data = np.frombuffer(path.read_bytes(), np.uint8)
        for _ in range(60):
            changed = data.copy()
            places = rng.integers(0, min(len(data), rng.choice([40, 400, len(data)])), rng.choice([1, 3, 10]))
            changed[places] = rng.integers(0, 256, len(places))
            path.write_bytes(changed.tobytes())
            with contextlib.suppress(UserError):
                assert read(path).dtype == np.uint16


def test_what_is_no_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    with pytest.raises(UserError, match=r"a.png is not a file"):
        read(tmp_path / "a.png")
    (tmp_path / "b.png").mkdir()
    with pytest.raises(UserError, match=r"b.png is not a file"):
        read(tmp_path / "b.png")
    with pytest.raises(UserError, match="there is no file"):
        read(tmp_path / "c.png")
