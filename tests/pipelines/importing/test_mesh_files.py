"""Every kind of mesh file is read as its specification says, or refused in one line that names it."""

import json
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from pipelines.foreign import ForeignFileError
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.read import MeshFile, read_mesh
from tests.pipelines.importing.mesh_texts import CHAIR, TABLE, dae_text, data_uri, glb, gltf_tree, vertices_of


def read(path: Path, content: str | bytes) -> MeshFile:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_mesh(path, Reach(path.parent), "pose")


def refusal(path: Path, content: str | bytes) -> str:
    with pytest.raises(ForeignFileError) as caught:
        read(path, content)
    text = str(caught.value)
    assert str(path.name) in text
    assert "\n" not in text
    return text


def area(file: MeshFile) -> np.ndarray:
    """(3,) sum of the triangles' areas as vectors, and their sum as numbers."""
    a, b, c = (file.triangles.vertices[file.triangles.faces[:, k]] for k in range(3))
    cross = 0.5 * np.cross(b - a, c - a)
    return np.array([*cross.sum(axis=0), np.linalg.norm(cross, axis=1).sum()])


def same_points(found: np.ndarray, wanted: np.ndarray) -> bool:
    return np.allclose(np.unique(np.round(found, 4), axis=0), np.unique(np.round(wanted, 4), axis=0), atol=2e-4)


ARROW = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 .5 0\nv 0 2 0\n"
"""A pentagon with a notch: its area is 2.5, a fan's from its first corner is more."""


@pytest.mark.parametrize(
    "face", ["f 1 2 3 4 5", "f 3 4 5 1 2", "f -1 -5 -4 -3 -2", "f 2/1/1 3/2/1 \\\n4/3/1 5//1 1 # c"]
)
def test_a_concave_polygon_of_an_obj_is_cut_not_fanned(tmp_path: Path, face: str) -> None:
    file = read(tmp_path / "a.obj", ARROW + face + "\n")
    assert area(file) == pytest.approx((0.0, 0.0, 2.5, 2.5))
    assert len(file.triangles.faces) == 3


def test_concave_polygons_are_cut_in_ply_and_dae_too(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 1\nproperty list uchar int vertex_index\nend_header\n"
    text = head + ARROW.replace("v ", "") + "5 4 3 2 1 0\n"
    assert area(read(tmp_path / "a.ply", text)) == pytest.approx((0.0, 0.0, -2.5, 2.5))
    binary = head.replace("ascii", "binary_big_endian").encode()
    binary += np.array([line.split()[1:] for line in ARROW.splitlines()], ">f4").tobytes()
    binary += struct.pack(">B5i", 5, 0, 1, 2, 3, 4)
    assert area(read(tmp_path / "b.ply", binary)) == pytest.approx((0.0, 0.0, 2.5, 2.5))
    box = [((0.0, 0.0, 0.0), (2.0, 2.0, 2.0))]  # corner k is at the bits of k: x, y, z
    polygon = "<polygons><input semantic='VERTEX' source='#v' offset='0'/>{}</polygons>"
    holed = "<ph><p>0 4 6 2</p><h>0 6 4</h></ph>"
    assert area(read(tmp_path / "c.dae", dae_text(box, primitive=polygon.format(holed))))[3] == pytest.approx(2.0)
    strips = "<tristrips><input semantic='VERTEX' source='#v' offset='1'/><p>9 0 9 4 9 2 9 6</p></tristrips>"
    assert area(read(tmp_path / "d.dae", dae_text(box, primitive=strips))) == pytest.approx((0.0, 0.0, 4.0, 4.0))


def test_names_in_any_encoding_do_not_matter(tmp_path: Path) -> None:
    text = "o St\u00fchl\ng Lehne\nmtllib St\u00fchl.mtl\nusemtl Gr\u00fcn\n" + ARROW + "f 1 2 3 4 5\n"
    assert len(read(tmp_path / "a.obj", text.encode("latin-1")).triangles.faces) == 3
    dae = dae_text(TABLE, asset="<contributor><author>M\u00fcller</author></contributor>")
    assert len(read(tmp_path / "a.dae", dae.encode("latin-1")).triangles.faces) == 60


@pytest.mark.parametrize(
    ("asset", "said"),
    [
        ("", ("y", False, None)),
        ("<unit name='inch' meter='0.0254'/><up_axis>Z_UP</up_axis>", ("z", True, "inch")),
        ("<unit meter='0.01'/><up_axis>X_UP</up_axis>", ("x", True, "cm")),
        ("<unit meter='1.0'/><up_axis>Y_UP</up_axis>", ("y", True, "m")),
        ("<unit name='foot' meter='0.3048'/>", ("y", False, "m")),
    ],
)
def test_a_dae_says_its_unit_and_axis(tmp_path: Path, asset: str, said: tuple) -> None:
    file = read(tmp_path / "a.dae", dae_text(TABLE, 0.3048 if "foot" in asset else 1.0, asset=asset))
    assert (file.said.up, file.said.is_up_stated, file.said.unit) == said
    assert np.ptp(file.triangles.vertices, axis=0) == pytest.approx((1.4, 0.8, 0.74), abs=1e-6)


def test_transforms_of_dae_nodes_are_applied_in_their_order(tmp_path: Path) -> None:
    node = "<translate>1 2 3</translate><rotate>0 0 1 90</rotate><scale>1 -1 2</scale>"
    file = read(tmp_path / "a.dae", dae_text(TABLE, node=node))
    x, y, z = vertices_of(TABLE).T
    assert same_points(file.triangles.vertices, np.stack([1 + y, 2 + x, 3 + 2 * z], axis=1))
    before = read(tmp_path / "b.dae", dae_text(TABLE)).triangles
    a, b, c = (before.vertices[before.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum()
    a, b, c = (file.triangles.vertices[file.triangles.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() == pytest.approx(2.0 * volume)  # still outwards


def test_nodes_and_skins_are_shown_where_they_are_instantiated(tmp_path: Path) -> None:
    library = "<library_nodes><node id='n'><translate>0 0 5</translate><instance_geometry url='#g'/></node>"
    library += "</library_nodes><library_controllers><controller id='c'><skin source='#g'><bind_shape_matrix>"
    library += "2 0 0 0 0 2 0 0 0 0 2 -9 0 0 0 1</bind_shape_matrix></skin></controller></library_controllers>"
    text = dae_text(CHAIR, node="<scale>1 1 3</scale>").replace("<library_visual", library + "<library_visual")
    nodes = "<instance_node url='#n'/><instance_controller url='#c'/><node><instance_camera url='#gone'/></node>"
    file = read(
        tmp_path / "a.dae", text.replace("<instance_geometry url='#g'/></node></visual", nodes + "</node></visual")
    )
    points = vertices_of(CHAIR)
    wanted = [(points + np.array((0, 0, 5))) * (1, 1, 3), (2 * points - np.array((0, 0, 9))) * (1, 1, 3)]
    assert same_points(file.triangles.vertices, np.concatenate(wanted))
    plain = read(tmp_path / "b.dae", text.replace("http://www.collada.org/2005/11/COLLADASchema", ""))
    assert same_points(plain.triangles.vertices, points * (1, 1, 3))
    assert "<skew>" in refusal(tmp_path / "c.dae", dae_text(CHAIR, node="<skew>45 1 0 0 0 1 0</skew>"))
    deep = "<node>" * 250 + "</node>" * 250
    assert "nested more than" in refusal(tmp_path / "d.dae", dae_text(CHAIR, node=deep))


def solid(name: str, normal: str = "0 0 1") -> str:
    corners = "".join(f"  vertex {x} {y} 0.0E+00\r\n" for x, y in ((0, 0), (2, 0), (0, 1)))
    facet = f"FACET normal {normal}\r\n outer loop\r\n{corners} endloop\r\nendfacet\r\n"
    return f"solid {name}\r\n{facet}endsolid {name}\r\n"


def test_solids_of_an_stl_count_all(tmp_path: Path) -> None:
    both = solid("St\u00fchl, vertex 1") + solid("")
    for text in (both, both.rpartition("endsolid")[0]):
        assert area(read(tmp_path / "a.stl", text.encode("latin-1"))) == pytest.approx((0.0, 0.0, 2.0, 2.0))
    record = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 7)
    for head, tail in ((b"solid a", b""), (b"a", b""), (b"a", b"colours")):
        data = head.ljust(80) + struct.pack("<I", 2) + record * 2 + tail
        assert area(read(tmp_path / "b.stl", data)) == pytest.approx((0.0, 0.0, 2.0, 2.0))
    middle = solid("a").replace("endsolid a", "") + solid("b")
    assert area(read(tmp_path / "c.stl", middle)) == pytest.approx((0.0, 0.0, 2.0, 2.0))


def test_libraries_log_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("DEBUG")
    assert len(read(tmp_path / "a.stl", solid("a", "none of three")).triangles.faces) == 1
    refusal(tmp_path / "a.urdf", "<robot name='r'><link name='a'/><joint name='j' type='fixed'/></robot>")
    refusal(tmp_path / "a.dae", dae_text(TABLE, node="<matrix>1</matrix>"))
    assert not caplog.records


def quantised() -> tuple[dict, np.ndarray]:
    """The chair as interleaved normalised int16 positions under a node that scales them back."""
    tree = gltf_tree(CHAIR)
    points = vertices_of(CHAIR, 1.0, "y")
    rows = np.zeros((len(points), 6), "<i2")
    rows[:, 1:4] = np.round(points / 0.9 * 32767)
    tree["extensionsUsed"] = tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    tree["accessors"][0] |= {"componentType": 5122, "normalized": True, "byteOffset": 2}
    tree["bufferViews"][0] |= {"buffer": 1, "byteOffset": 0, "byteLength": rows.nbytes, "byteStride": 12}
    tree["buffers"].append({"byteLength": rows.nbytes, "uri": data_uri(rows.tobytes())})
    tree["nodes"] = [{"children": [1], "translation": [0, 1, 0]}, {"mesh": 0, "scale": [0.9, 0.9, 0.9]}]
    return tree, points + np.array((0.0, 1.0, 0.0))


def test_quantised_positions_are_read(tmp_path: Path) -> None:
    tree, points = quantised()
    file = read(tmp_path / "a.gltf", json.dumps(tree))
    assert np.abs(file.triangles.vertices - points).max() < 3e-5
    assert same_points(read(tmp_path / "a.glb", glb(tree)).triangles.vertices, points)
    assert (file.unit, file.said.up) == ("m", "y")


def test_only_the_scene_that_is_shown_counts(tmp_path: Path) -> None:
    tree = gltf_tree(CHAIR)
    turned = {"mesh": 0, "rotation": [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)], "scale": [1, 1, -1]}
    matrix = {"mesh": 0, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 0, 0, 1]}
    tree |= {"nodes": [turned, matrix], "scenes": [{"nodes": [0]}, {"nodes": [1]}], "scene": 1}
    points = vertices_of(CHAIR, 1.0, "y")
    assert same_points(read(tmp_path / "a.gltf", json.dumps(tree)).triangles.vertices, 2 * points + (5, 0, 0))
    tree["scene"] = 0
    x, y, z = points.T
    found = read(tmp_path / "a.gltf", json.dumps(tree)).triangles
    assert same_points(found.vertices, np.stack([-y, x, -z], axis=1))
    del tree["scene"], tree["scenes"]
    assert len(read(tmp_path / "a.gltf", json.dumps(tree)).triangles.faces) == 2 * len(found.faces)


def test_sparse_accessors_strips_and_binary_buffers_are_read(tmp_path: Path) -> None:
    points, where = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], "<f4"), np.array([0, 1, 2, 3], "<u1")
    data = points.tobytes() + where.tobytes()
    tree = gltf_tree(CHAIR)
    tree["buffers"] = [{"byteLength": len(data)}]
    tree["bufferViews"] = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 4}]
    sparse = {"count": 4, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0}}
    tree["accessors"] = [{"componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse}]
    tree["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}]
    assert area(read(tmp_path / "a.glb", glb(tree, data))) == pytest.approx((0.0, 0.0, 1.0, 1.0))


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_compressed_meshes_are_refused_by_name(tmp_path: Path, suffix: str) -> None:
    def written(tree: dict) -> bytes:
        return glb(tree) if suffix == "glb" else json.dumps(tree).encode()

    path = tmp_path / f"a.{suffix}"
    tree = gltf_tree(CHAIR)
    name = "EXT_meshopt_compression"
    assert "meshopt-compressed, which is not read" in refusal(path, written(tree | {"extensionsRequired": [name]}))
    tree["bufferViews"][0]["extensions"] = {name: {}}
    assert "meshopt-compressed" in refusal(path, written(tree))
    tree = gltf_tree(CHAIR)
    text = refusal(path, written(tree | {"extensionsRequired": ["EXT_new_shapes"]}))
    assert "requires the extension EXT_new_shapes, which is not read" in text
    read(path, written(tree | {"extensionsRequired": ["KHR_texture_transform", "KHR_materials_unlit"]}))
    tree["meshes"][0]["primitives"][0]["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "DracoPy", None)
        text = refusal(path, written(tree | {"extensionsRequired": ["KHR_draco_mesh_compression"]}))
    assert "is Draco-compressed: install DracoPy" in text


def test_a_small_file_that_promises_much_is_refused_before_memory_is_taken(tmp_path: Path) -> None:
    tree = gltf_tree(CHAIR)
    tree["accessors"][0] = {"componentType": 5126, "count": 400_000_000, "type": "VEC3"}
    assert "GiB" in refusal(tmp_path / "a.gltf", json.dumps(tree))
    tree = gltf_tree(CHAIR)
    tree["buffers"][0]["byteLength"] = 5_000_000_000
    assert "would take 4.7 GiB" in refusal(tmp_path / "a.gltf", json.dumps(tree))
    tree = gltf_tree(CHAIR)
    tree["nodes"] = [{"children": [k + 1] * 9} for k in range(20)] + [{"mesh": 0}]
    assert "places more than" in refusal(tmp_path / "a.gltf", json.dumps(tree))
    tree["nodes"] = [{"mesh": 0, "children": [0]}]
    assert "nested more than" in refusal(tmp_path / "a.gltf", json.dumps(tree))
    head = "ply\nformat {}\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    assert "GiB" in refusal(tmp_path / "a.ply", head.format("ascii 1.0", 10**10))
    assert "promises at least" in refusal(tmp_path / "a.ply", head.format("binary_little_endian 1.0", 10**6))
    assert "promises 4294967295" in refusal(tmp_path / "a.stl", b" " * 80 + b"\xff" * 4 + b" " * 500)
    links = [f"<instance_node url='#n{k + 1}'/>" * 9 for k in range(20)]
    nodes = "".join(f"<node id='n{k}'>{link}</node>" for k, link in enumerate(links))
    text = dae_text(CHAIR).replace("<scene>", f"<library_nodes>{nodes}<node id='n20'/></library_nodes><scene>")
    text = text.replace("<instance_geometry url='#g'/>", "<instance_geometry url='#g'/><instance_node url='#n0'/>")
    assert "places more than" in refusal(tmp_path / "a.dae", text)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.obj", "v 1 2\nf 1 1 1\n", "line 1 is no vertex: v 1 2"),
        ("a.obj", "v 1 2 0,5\n", "line 1 is no vertex: v 1 2 0,5"),
        ("a.obj", ARROW + "f 1 2 9\n", "a face names vertex 8, but there are 5"),
        ("a.obj", ARROW + "f 1 2 0\n", "line 6 is no face: f 1 2 0"),
        ("a.obj", ARROW, "there are no faces in it"),
        ("a.obj", b"\x00\xff" * 50, "there are no faces in it"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "0 whole facets, but 1 vertices"),
        ("a.ply", "ply\n", "it has no PLY header"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex x\nend_header\n",
            "its header has the line 'element vertex x'",
        ),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "no vertices with x, y and z"),
        ("a.dae", "<COLLADA><asset>", "no well-formed XML"),
        ("a.dae", "<html></html>", "its root is <html>"),
        ("a.dae", dae_text(TABLE, node="<rotate>1 0</rotate>"), "Rotate node requires four float values"),
        ("a.dae", dae_text(TABLE, node="<translate/>"), "Translate node requires three float values"),
        ("a.dae", dae_text(TABLE).replace("url='#g'", "url='#h'"), "Geometry #h not found in library"),
        ("a.dae", dae_text(TABLE).replace("source='#p'", "source='#q'"), "the source 'q'"),
        ("a.dae", dae_text(TABLE, asset="<unit meter='-1'/>"), "its unit is -1 m"),
        ("a.gltf", "{" * 100_000, "is damaged, or not a glTF file"),
        ("a.gltf", "[" * 100_000, "is damaged, or not a glTF file"),
        ("a.gltf", "null", "value of another kind"),
        ("a.gltf", '{"asset": {"version": "1.0"}}', "it is glTF 1.0, only glTF 2 is read"),
        ("a.gltf", json.dumps(gltf_tree(TABLE) | {"nodes": None}), "value of another kind"),
        ("a.gltf", json.dumps(gltf_tree(TABLE) | {"nodes": [[]]}), "value of another kind"),
        ("a.gltf", json.dumps(gltf_tree(TABLE) | {"meshes": []}), "mesh 0 is named, but there are 0"),
        ("a.glb", glb(gltf_tree(TABLE))[:200], "its header promises"),
        ("a.glb", b"glTF\x01\0\0\0", "GLB version 1"),
    ],
)
def test_damage_is_one_line_that_says_what(tmp_path: Path, name: str, content: str | bytes, said: str) -> None:
    assert said in refusal(tmp_path / name, content)


@pytest.mark.parametrize("kind", ["dae", "urdf"])
def test_external_entities_are_not_opened(tmp_path: Path, kind: str) -> None:
    (tmp_path / "secret.txt").write_text("secret")
    plain = dae_text(TABLE).partition("?>")[2] if kind == "dae" else "<robot name='r'>&x;</robot>"
    for doctype in (
        f"<!DOCTYPE a [<!ENTITY x SYSTEM '{tmp_path}/secret.txt'>]>",
        "<!DOCTYPE a SYSTEM 'http://a/b.dtd'>",
    ):
        assert "which are not opened" in refusal(tmp_path / f"a.{kind}", doctype + plain)
    bomb = "<!DOCTYPE a [<!ENTITY x 'xx'><!ENTITY y '&x;&x;'>]>".encode("utf-16")
    assert "which are not opened" in refusal(tmp_path / f"a.{kind}", bomb + plain.encode("utf-16-le"))


def test_buffers_outside_the_folder_are_not_opened(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    tree = gltf_tree(CHAIR)
    data = np.random.default_rng(0).bytes(tree["buffers"][0]["byteLength"])
    (tmp_path / "a.bin").write_bytes(data)
    for uri in ("../a.bin", str(tmp_path / "a.bin"), (tmp_path / "a.bin").as_uri(), "..%2Fa.bin"):
        tree["buffers"][0]["uri"] = uri
        assert "is outside" in refusal(folder / "a.gltf", json.dumps(tree))
    tree["buffers"][0]["uri"] = "https://a/b.bin"
    assert "which is not there" in refusal(folder / "a.gltf", json.dumps(tree))
