"""`undergrowth import meshes` reads what others wrote, lists what it cannot use, and feeds `generate`."""

import re
from pathlib import Path

import numpy as np
import pytest

from pipelines.commands.generate import GenerateSettings
from pipelines.commands.importing.meshes import MeshSettings
from pipelines.errors import UserError
from synth.occluders.imported.sizes import TO_UPRIGHT
from tests.shared_data import SHARED

REAL = SHARED / "data" / "furniture"
CORNERS = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
FACES = [
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip
SIZE = (0.5, 0.3, 0.7)


def obj(path: Path, scale: float = 1.0) -> None:
    lines = [f"v {scale * x * SIZE[0]} {scale * z * SIZE[2]} {-scale * y * SIZE[1]}" for x, y, z in CORNERS]
    path.write_text("\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES)]) + "\n")


def ply(path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
    lines = [f"{x * SIZE[0]} {y * SIZE[1]} {z * SIZE[2]}" for x, y, z in CORNERS]
    faces = [f"3 {a} {b} {c}" for a, b, c in FACES]
    middle = "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_text(head + middle + "\n".join([*lines, *faces]) + "\n")


def stl(path: Path) -> None:
    lines = ["solid a"]
    for face in FACES:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x * SIZE[0]} {y * SIZE[1]} {z * SIZE[2]}" for x, y, z in (CORNERS[k] for k in face)]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid a"]) + "\n")


def urdf(path: Path) -> None:
    box = "<visual><origin xyz='0 0 {0}'/><geometry><box size='{1} {2} {3}'/></geometry></visual>"
    path.write_text(
        f"<robot name='r'><link name='a'>{box.format(0.25, 0.5, 0.3, 0.5)}</link>"
        f"<link name='b'>{box.format(0.1, 0.4, 0.05, 0.2)}</link>"
        "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/><origin xyz='0 0 0.5'/>"
        "<axis xyz='0 0 1'/><limit lower='0' upper='0.1' effort='1' velocity='1'/></joint></robot>"
    )


def test_every_kind_of_file_gives_the_same_thing(tmp_path: Path) -> None:
    obj(tmp_path / "a.obj", 100.0)  # in centimetres
    ply(tmp_path / "b.ply")
    stl(tmp_path / "c.stl")
    library = MeshSettings(tmp_path, tmp_path / "lib", class_name="suitcase", test=("[ab]",)).library()
    assert [model.name for model in library.models] == ["a", "b", "c"]
    assert [model.frame for model in library.models] == ["cm, y up", "m, z up", "m, z up"]
    assert {model.split for model in library.models[:2]} == {"test"}
    for model in library.models:
        assert np.ptp(model.vertices, axis=0) == pytest.approx(SIZE, abs=1e-6)
        assert model.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
        assert len(model.boxes) == 1
        assert model.is_closed


def test_a_urdf_is_posed_within_its_limits_by_the_seed(tmp_path: Path) -> None:
    urdf(tmp_path / "suitcase__trolley.urdf")
    heights = []
    for seed in (0, 0, 1):
        (model,) = MeshSettings(tmp_path, tmp_path / "lib", seed=seed).library().models
        assert (model.class_name, model.name) == ("suitcase", "trolley")
        heights.append(float(model.vertices[:, 2].max()))
    assert heights[0] == heights[1] != heights[2]
    assert all(0.7 <= height <= 0.8 for height in heights)


def test_what_cannot_be_used_is_listed_and_the_rest_imported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    obj(tmp_path / "suitcase__good.obj")
    obj(tmp_path / "lamp__tall.obj")
    obj(tmp_path / "table__huge.obj", 3e5)
    (tmp_path / "suitcase__empty.ply").write_text("ply\n")
    caplog.set_level("WARNING", "pipelines")
    library = MeshSettings(tmp_path, tmp_path / "lib").library()
    assert [model.name for model in library.models] == ["good"]
    refused = [record.getMessage() for record in caplog.records]
    assert len(refused) == 3
    assert "has the unknown class 'lamp__tall'" in refused[0] or "has the unknown class 'lamp'" in refused[0]
    assert "known are table, laptop, stroller, chair, monitor, suitcase, other" in refused[0]
    assert "suitcase__empty.ply" in refused[1]
    assert "no table (0.25-1.25 m high" in refused[2]


def test_an_index_says_class_split_and_forward(tmp_path: Path) -> None:
    obj(tmp_path / "a.obj")
    (tmp_path / "index.csv").write_text("file,category,split,forward\na.obj,bag,val,z\n")
    settings = MeshSettings(tmp_path, tmp_path / "lib", index=tmp_path / "index.csv")
    (model,) = settings.library().models
    assert (model.class_name, model.split) == ("suitcase", "val")
    assert np.ptp(model.vertices, axis=0) == pytest.approx((0.3, 0.5, 0.7), abs=1e-6)
    (tmp_path / "index.csv").write_text("file,class\nb.obj,bag\n")
    with pytest.raises(UserError, match=r"lists b\.obj, which is not in"):
        settings.library()
    (tmp_path / "index.csv").write_text("name\nb\n")
    with pytest.raises(UserError, match="needs a header with a column 'file'"):
        settings.library()


def test_bad_orders_are_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has no files of these kinds"):
        MeshSettings(tmp_path, tmp_path / "lib").library()
    with pytest.raises(UserError, match="is not a folder"):
        MeshSettings(tmp_path / "none", tmp_path / "lib").library()
    with pytest.raises(UserError, match="class 'lamp' is unknown, known are table"):
        MeshSettings(tmp_path, tmp_path / "lib", class_name="lamp").library()


def test_the_digest_goes_into_the_configuration(tmp_path: Path) -> None:
    obj(tmp_path / "suitcase__a.obj")
    lib = tmp_path / "lib"
    assert MeshSettings(tmp_path, lib, test=("*",)).run() == 0
    order = GenerateSettings(tmp_path / "out", frames=4, objects=lib, objects_splits=("test",)).order()
    chosen = order.config["objects"]
    assert isinstance(chosen, dict)
    assert chosen["splits"] == ["test"]
    assert len(chosen["digest"]) == 64
    obj(tmp_path / "suitcase__b.obj", 1.1)
    MeshSettings(tmp_path, lib, test=("*",), overwrite=True).run()
    with pytest.raises(UserError, match="has changed since the corpus was begun"):
        order.make_source()
    with pytest.raises(UserError, match="has no models for split 'train'"):
        GenerateSettings(tmp_path / "out", objects=lib).order()


@pytest.mark.skipif(not REAL.is_dir(), reason=f"no models at {REAL}")
def test_a_real_table_and_a_real_laptop_are_understood(tmp_path: Path) -> None:
    for name in ("table__cafe_table_gazebo.obj", "laptop__laptop_volta.obj"):
        (tmp_path / name).write_bytes((REAL / name).read_bytes())
    laptop, table = MeshSettings(tmp_path, tmp_path / "lib").library().models
    assert laptop.role == "laptop"
    assert table.role == "table"
    assert table.occluder.anchor("top").size == pytest.approx((0.914, 0.914), abs=0.03)


# Files of other programs


def table_parts(trimesh):
    """A table's top and legs as two meshes, y up, in metres."""
    top = trimesh.creation.box((1.4, 0.03, 0.8), trimesh.transformations.translation_matrix((0, 0.735, 0)))
    legs = [
        trimesh.creation.box((0.06, 0.72, 0.06), trimesh.transformations.translation_matrix((x, 0.36, z)))
        for x in (-0.6, 0.6)
        for z in (-0.3, 0.3)
    ]
    return top, trimesh.util.concatenate(legs)


def nested_scene(trimesh):
    """The table under nodes that scale and turn it, beside an empty node, a line and points."""
    scene, outer = trimesh.Scene(), np.diag([2.0, 2.0, 2.0, 1.0])
    scene.graph.update(frame_from="world", frame_to="group", matrix=outer)
    scene.graph.update(frame_from="world", frame_to="nothing", matrix=np.eye(4))
    for k, part in enumerate(table_parts(trimesh)):
        T = trimesh.transformations.rotation_matrix(0.7 + k, (0, 1, 0)) @ np.diag([100.0, 100.0, 100.0, 1.0])
        inner = part.copy()
        inner.apply_transform(np.linalg.inv(outer @ T))
        scene.add_geometry(inner, node_name=f"part {k}", parent_node_name="group", transform=T)
    scene.add_geometry(trimesh.load_path(np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]])))
    scene.add_geometry(trimesh.PointCloud(np.full((3, 3), 4.0)))
    return scene


def write_scenes(trimesh, folder: Path) -> None:
    nested_scene(trimesh).export(folder / "table__glb.glb")
    for name, data in trimesh.exchange.gltf.export_gltf(nested_scene(trimesh)).items():
        (folder / ("table__gltf.gltf" if name == "model.gltf" else name)).write_bytes(data)
    whole = trimesh.util.concatenate(table_parts(trimesh))
    whole.export(folder / "table__y.obj")
    whole.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    for suffix, unit in (("ply", 1.0), ("stl", 1000.0)):
        made = whole.copy()
        made.apply_scale(unit)
        made.export(folder / f"table__z_{suffix}.{suffix}")


def test_scene_graphs_and_kinds_of_files_give_one_table(tmp_path: Path) -> None:
    import trimesh

    write_scenes(trimesh, tmp_path)
    library = MeshSettings(tmp_path, tmp_path / "lib", test=("*",)).library()
    frames = {model.name: model.frame for model in library.models}
    assert frames == {
        "glb": "m, y up", "gltf": "m, y up", "y": "m, y up", "z_ply": "m, z up", "z_stl": "mm, z up",
    }  # fmt: skip
    for model in library.models:
        assert model.role == "table"
        assert np.sort(np.ptp(model.vertices, axis=0)) == pytest.approx([0.75, 0.8, 1.4], abs=1e-4)
        assert len(model.faces) == 60


@pytest.mark.parametrize(
    ("asset", "up", "scale", "frame"),
    [
        ("<unit meter='1'/><up_axis>Y_UP</up_axis>", "y", 1.0, "m, y up"),
        ("<unit name='c' meter='0.01'/><up_axis>Z_UP</up_axis>", "z", 100.0, "cm, z up"),
        ("<unit meter='0.0254'/><up_axis>X_UP</up_axis>", "x", 1 / 0.0254, "inch, x up"),
        ("<up_axis>Y_UP</up_axis>", "z", 1000.0, "mm, z up"),
        ("<unit meter='1'/><up_axis>Z_UP</up_axis>", "y", 100.0, "cm, y up"),
    ],
)
def test_what_a_dae_says_of_itself_counts_where_it_can_be_true(
    tmp_path: Path, asset: str, up: str, scale: float, frame: str
) -> None:
    import trimesh

    mesh = trimesh.util.concatenate(table_parts(trimesh))
    R = TO_UPRIGHT[up].T @ TO_UPRIGHT["y"]
    made = trimesh.Trimesh(scale * mesh.vertices @ R.T, mesh.faces, process=False)
    text = made.export(file_type="dae")
    text = text.decode() if isinstance(text, bytes) else text
    dates = "<created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>"
    text = re.sub("<asset>.*?</asset>", f"<asset>{dates}{asset}</asset>", text, flags=re.DOTALL)
    (tmp_path / "table__a.dae").write_text(text)
    (model,) = MeshSettings(tmp_path, tmp_path / "lib").library().models
    assert model.frame == frame
    assert np.ptp(model.vertices, axis=0)[2] == pytest.approx(0.75, abs=1e-4)


def test_a_table_forty_metres_long_is_refused(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    import trimesh

    write_scenes(trimesh, tmp_path)
    long = trimesh.util.concatenate(table_parts(trimesh))
    long.apply_transform(np.diag([40.0 / 1.4, 1.0, 1.0, 1.0]))
    for suffix in ("obj", "glb", "stl"):
        long.export(tmp_path / f"table__long_{suffix}.{suffix}")
    large = trimesh.util.concatenate(table_parts(trimesh))
    large.apply_scale(40.0 / 1.4)
    large.export(tmp_path / "table__large.glb")
    caplog.set_level("WARNING", "pipelines")
    names = {model.name for model in MeshSettings(tmp_path, tmp_path / "lib").library().models}
    refused = [record.getMessage() for record in caplog.records]
    assert len(names) == 5
    assert len(refused) == 4
    assert all("is no table (0.25-1.25 m high, 0.35-3.5 m long" in line for line in refused)
