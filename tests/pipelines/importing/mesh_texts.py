"""Mesh files as programs write them, made in the tests: boxes as OBJ, DAE, GLB and in URDFs."""

import base64
import json
import struct
from pathlib import Path

import numpy as np

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
LEGS = [((x, y, 0.0), (0.05, 0.05, 0.71)) for x in (0, 1.35) for y in (0, 0.75)]
TABLE = [((0.0, 0.0, 0.71), (1.4, 0.8, 0.03)), *LEGS]
CHAIR = [((0.0, 0.0, 0.0), (0.45, 0.45, 0.45)), ((0.0, 0.41, 0.45), (0.45, 0.04, 0.45))]


def vertices_of(boxes, unit=1.0, up="z"):
    """(n, 3) corners of boxes (lower corner, size) [m], z up, in a unit and with another axis up."""
    turn = {"x": (2, 0, 1), "y": (1, 2, 0), "z": (0, 1, 2)}[up]
    points = np.concatenate([np.array(low) + CORNERS * np.array(size) for low, size in boxes]) / unit
    return points[:, list(turn)]


def quads_of(boxes):
    return [tuple(8 * k + i for i in quad) for k in range(len(boxes)) for quad in QUADS]


def write_obj(path: Path, boxes, unit=1.0, up="y"):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices_of(boxes, unit, up)]
    lines += ["f " + " ".join(str(k + 1) for k in quad) for quad in quads_of(boxes)]
    path.write_text("\n".join(lines) + "\n")


def dae_text(boxes, unit=1.0, up="z", asset="", primitive="", node=""):
    points = vertices_of(boxes, unit, up)
    quads = quads_of(boxes)
    primitive = primitive or (
        f"<polylist count='{len(quads)}'><input semantic='VERTEX' source='#v' offset='0'/>"
        f"<vcount>{'4 ' * len(quads)}</vcount><p>{' '.join(str(k) for quad in quads for k in quad)}</p></polylist>"
    )
    return (
        "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>"
        f"<asset>{asset}</asset><library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' "
        f"count='{points.size}'>{' '.join(f'{x:.9g}' for x in points.ravel())}</float_array><technique_common>"
        f"<accessor source='#a' count='{len(points)}' stride='3'/></technique_common></source><vertices id='v'>"
        f"<input semantic='POSITION' source='#p'/></vertices>{primitive}</mesh></geometry></library_geometries>"
        f"<library_visual_scenes><visual_scene id='s'><node>{node}<instance_geometry url='#g'/></node></visual_scene>"
        "</library_visual_scenes><scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    )


def gltf_tree(boxes):
    """A glTF with its buffer inside: triangles of boxes, y up, in metres."""
    points = vertices_of(boxes, 1.0, "y").astype("<f4")
    faces = np.array([f for q in quads_of(boxes) for f in (q[:3], (q[0], q[2], q[3]))], "<u2")
    data = points.tobytes() + faces.tobytes()
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": faces.nbytes},
        ],
        "buffers": [{"byteLength": len(data), "uri": data_uri(data)}],
    }


def data_uri(data: bytes) -> str:
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


def glb(tree, data: bytes = b"") -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if data:
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def robot(links: dict[str, str], joints: str = "") -> str:
    return (
        "<robot name='r'>"
        + "".join(f"<link name='{n}'>{v}</link>" for n, v in links.items())
        + joints
        + "</robot>"
    )


def visual(geometry: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return f"<visual><origin xyz='{xyz}' rpy='{rpy}'/><geometry>{geometry}</geometry></visual>"


def joint(kind: str, parent: str, child: str, inner: str = "<axis xyz='0 0 1'/>", name: str = "") -> str:
    ends = f"<parent link='{parent}'/><child link='{child}'/>"
    return f"<joint name='{name or child}' type='{kind}'>{ends}{inner}</joint>"
