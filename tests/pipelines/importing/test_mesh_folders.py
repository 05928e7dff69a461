"""A folder becomes a library: models are called by their paths, parts of URDFs are none, up axes are told."""

import logging
import os
from pathlib import Path

import numpy as np
import pytest

from pipelines.commands.importing.meshes import MeshSettings
from pipelines.errors import UserError
from pipelines.importing.index import read_index
from pipelines.importing.listing import listed, mesh_files
from pipelines.importing.meshfiles.reach import Reach
from synth.occluders.meshlib import MeshLibrary, read_library
from tests.pipelines.importing.mesh_texts import (
    CHAIR,
    LEGS,
    TABLE,
    dae_text,
    glb,
    gltf_tree,
    robot,
    visual,
    write_obj,
)

CHEST = [((0.0, 0.0, 0.0), (1.0, 0.4, 0.4))]


def imported(folder: Path, **settings: object) -> MeshLibrary:
    return MeshSettings(folder, folder / "lib", **settings).library()  # type: ignore[arg-type]


def what(library: MeshLibrary) -> dict[str, tuple[str, str]]:
    return {model.name: (model.class_name, model.split) for model in library.models}


def three(folder: Path) -> None:
    """`model.obj` in each folder, as ShapeNet, 3D-FUTURE or YCB have it."""
    for name in ("a", "b", "c"):
        write_obj(folder / name / "model.obj", CHEST)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("sign", [",", ";", "\t"])
@pytest.mark.parametrize("slash", ["/", "\\"])
def test_rows_are_keyed_by_the_path(tmp_path: Path, encoding: str, sign: str, slash: str) -> None:
    three(tmp_path)
    lines = [
        ["File", "note", "Class", "split"],
        [f"a{slash}model.obj", "gr\u00fcn", "box", "train"],
        [f".{slash}b{slash}model.obj", "", "bag", "test"],
        [f"c{slash}model.obj", "", "bin", "val"],
    ]
    text = "\r\n".join(sign.join(line) for line in lines) + "\r\n\r\n"
    (tmp_path / "index.csv").write_bytes(text.encode(encoding))
    found = what(imported(tmp_path, index=tmp_path / "index.csv"))
    assert found == {
        "a/model": ("other", "train"), "b/model": ("suitcase", "test"), "c/model": ("other", "val"),
    }  # fmt: skip


def test_paths_may_begin_at_the_index_or_be_ends_that_only_one_file_has(tmp_path: Path) -> None:
    three(tmp_path / "models" / "x")
    write_obj(tmp_path / "models" / "d" / "only.obj", CHEST)
    (tmp_path / "index.csv").write_text(
        f"file,class\nmodels/x/a/model.obj,box\nb/model.obj,bag\nonly.obj,bag\n{tmp_path}/models/x/c/model.obj,bin\n"
    )
    found = imported(tmp_path / "models", index=tmp_path / "index.csv")
    assert {name: class_name for name, (class_name, _) in what(found).items()} == {
        "x/a/model": "other", "x/b/model": "suitcase", "d/only": "suitcase", "x/c/model": "other",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("model.obj,box", r"line 2: model.obj may be any of 3 files \(.*a/model.obj, "),
        ("d/model.obj,box", "line 2: it lists d/model.obj, which is not in"),
        ("d" * 300 + ".obj,box", "which is not in"),
        ("a/model.obj,box\na/model.obj,bag", "line 3: it lists a/model.obj again, with other values"),
        ("index.csv,box", "lists index.csv, which is of a kind that is not read"),
    ],
)
def test_a_row_that_fits_no_file_or_several_is_an_error(tmp_path: Path, rows: str, said: str) -> None:
    three(tmp_path)
    (tmp_path / "index.csv").write_text(f"file,class\n{rows}\n")
    with pytest.raises(UserError, match=said):
        imported(tmp_path, index=tmp_path / "index.csv")


@pytest.mark.parametrize("content", [b"", b"\n\n", b"name\na\n", b"\xff\xfe\x00", b"\x00" * 9])
def test_an_index_that_is_none_is_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "index.csv").write_bytes(content)
    with pytest.raises(UserError) as caught:
        read_index(tmp_path / "index.csv")
    assert str(tmp_path / "index.csv") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_an_index_each_folder_is_a_model_of_its_own_split(tmp_path: Path) -> None:
    three(tmp_path)
    for k in range(30):
        (tmp_path / f"m{k}").symlink_to(tmp_path / "a")  # not followed
    found = what(imported(tmp_path, class_name="other", test=("b/*",), train=("c/model",)))
    assert found.keys() == {"a/model", "b/model", "c/model"}
    assert found["b/model"][1] == "test"
    assert found["c/model"][1] == "train"


def test_a_class_may_be_a_folders_name(tmp_path: Path) -> None:
    write_obj(tmp_path / "Suitcase" / "17" / "model.obj", CHEST)
    write_obj(tmp_path / "box__red" / "bag__model.obj", CHEST)
    assert what(imported(tmp_path, test=("*",))) == {
        "Suitcase/17/model": ("suitcase", "test"), "box__red/model": ("suitcase", "test"),
    }  # fmt: skip


def test_names_that_meet_are_told_apart(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("box__a.obj", "bag__a.obj", "bin__b.obj"):
        write_obj(tmp_path / name, CHEST)
    (tmp_path / "bin__b.glb").write_bytes(glb(gltf_tree(CHEST)))
    caplog.set_level("WARNING", "pipelines")
    assert {m.name for m in imported(tmp_path).models} == {"bag__a", "box__a", "b"}
    assert "bin__b.obj has the name of bin__b.glb, which is imported" in caplog.text
    (tmp_path / "index.csv").write_text("file,class\nbin__b.obj,box\nbin__b.glb,box\n")
    names = {m.name for m in imported(tmp_path, index=tmp_path / "index.csv").models}
    assert names == {"bag__a", "box__a", "b.obj", "b.glb"}


def test_names_that_are_not_utf_8_are_read_and_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = tmp_path / "in"
    write_obj(folder / "one.obj", CHEST)
    (folder / "one.obj").rename(folder / os.fsdecode(b"K\xe4fig.obj"))
    (folder / os.fsdecode(b"\xff.stl")).write_bytes(b"no")
    (folder / "index.csv").write_bytes("file,class\nK\u00e4fig.obj,box\n".encode("cp1252"))
    caplog.set_level("INFO", "pipelines")
    out = tmp_path / "lib"
    settings = MeshSettings(folder, out, class_name="other", index=folder / "index.csv")
    assert settings.run() == 0
    assert [model.name for model in read_library(out).models] == [r"K\xe4fig"]
    caplog.text.encode("utf-8")
    assert r"\xff.stl" in caplog.text


# Parts of URDFs


def desk(
    folder: Path, names: str = "meshes/visual.obj", collision: str = "package://desk/meshes/hull.obj"
) -> None:
    write_obj(folder / "meshes" / "visual.obj", TABLE, up="z")
    write_obj(folder / "meshes" / "hull.obj", [((0, 0, 0), (1.4, 0.8, 0.74))], up="z")
    hull = f"<collision><geometry><mesh scale='1 1 1' filename='{collision}'/></geometry></collision>"
    (folder / "table__desk.urdf").write_text(robot({"a": visual(f'<mesh\n filename="{names}"/>') + hull}))


def test_meshes_that_a_urdf_names_are_its_parts(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    desk(tmp_path / "desk")
    write_obj(tmp_path / "desk" / "meshes" / "visual_low.obj", TABLE)
    write_obj(tmp_path / "lone.obj", TABLE)
    caplog.set_level("INFO", "pipelines")
    (table, lone) = imported(tmp_path, class_name="table").models
    assert (table.name, lone.name) == ("desk/desk", "lone")
    assert table.role == "table"
    assert "2 meshes are parts of URDF files" in caplog.text
    assert "visual_low.obj lies among the parts of desk/table__desk.urdf" in caplog.text
    (tmp_path / "index.csv").write_text(
        "file,class\ndesk/meshes/visual_low.obj,table\ndesk/meshes/hull.obj,table\n"
    )
    names = [m.name for m in imported(tmp_path, class_name="table", index=tmp_path / "index.csv").models]
    assert names == ["desk/meshes/visual_low", "desk/desk", "lone"]


def test_parts_of_a_urdf_that_is_refused_are_no_models_either(tmp_path: Path) -> None:
    desk(tmp_path / "desk", collision="../desk/meshes/hull.obj")
    path = tmp_path / "desk" / "table__desk.urdf"
    path.write_text(path.read_text()[:-20])
    with pytest.raises(UserError, match="none of the 3 files"):
        imported(tmp_path, class_name="table")


def test_a_urdf_is_never_imported_as_its_hull(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    desk(tmp_path / "desk", names="package://desk/meshes/gone.obj")
    write_obj(tmp_path / "table__good.obj", TABLE)
    caplog.set_level("WARNING", "pipelines")
    assert [m.name for m in imported(tmp_path).models] == ["good"]
    assert "desk.urdf names package://desk/meshes/gone.obj, which is not there" in caplog.text


def test_parts_in_the_folder_itself_do_not_hide_its_other_files(tmp_path: Path) -> None:
    write_obj(tmp_path / "leg.obj", TABLE, up="z")
    write_obj(tmp_path / "other.obj", TABLE)
    (tmp_path / "a.urdf").write_text(robot({"a": visual("<mesh filename='leg.obj'/>")}))
    (tmp_path / ".hidden.obj").write_text("")
    (tmp_path / "__MACOSX").mkdir()
    (tmp_path / "__MACOSX" / "b.obj").write_text("")
    listing = listed(tmp_path, mesh_files(tmp_path), (), Reach(tmp_path))
    assert set(listing.names.values()) == {"a", "other"}
    assert {path.name for path in listing.parts} == {"leg.obj"}


# Up axes and limits


def refused(folder: Path, caplog: pytest.LogCaptureFixture) -> str:
    caplog.set_level("INFO", "pipelines")
    with pytest.raises(UserError, match="can be used"):
        imported(folder)
    return caplog.records[-1].getMessage()


@pytest.mark.parametrize("kind", ["obj", "glb", "dae"])
def test_what_is_too_large_upright_is_not_laid_on_its_back(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    tall = [((0.0, 0.0, 0.0), (0.9, 0.5, 1.6))]  # a secretaire; on its back it would be 0.5 m high
    if kind == "obj":
        write_obj(tmp_path / "desk__a.obj", tall)
    elif kind == "glb":
        (tmp_path / "desk__a.glb").write_bytes(glb(gltf_tree(tall)))
    else:
        (tmp_path / "desk__a.dae").write_text(dae_text(tall, asset="<unit meter='1'/><up_axis>Z_UP</up_axis>"))
    line = refused(tmp_path, caplog)
    assert "it is 1.6 m high, at most 1.25 m" in line
    assert "up it would fit, which --up or an index must say" in line


def test_a_model_says_each_limit_that_it_breaks(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    write_obj(tmp_path / "chair__a.obj", [((0, 0, 0), (5.0, 0.1, 0.5))])
    assert refused(tmp_path, caplog).endswith("it is 5 m long, at most 2.8 m, 0.1 m deep, at least 0.28 m")


def test_a_cabinet_stays_upright_and_is_an_obstacle_without_a_level_top(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    write_obj(tmp_path / "desk__cabinet.obj", [((0, 0, 0), (1.2, 0.4, 1.22))])
    caplog.set_level("INFO", "pipelines")
    (model,) = imported(tmp_path).models
    assert (model.frame, model.role, model.anchors) == ("m, y up", "obstacle", ())
    assert np.ptp(model.vertices, axis=0)[2] == pytest.approx(1.22)


def test_an_axis_that_nobody_states_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    write_obj(tmp_path / "table__usual.obj", TABLE)
    caplog.set_level("INFO", "pipelines")
    imported(tmp_path)
    assert "m, y up (assumed), table" in caplog.text
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
    caplog.clear()
    imported(tmp_path, up="y")
    assert "m, y up, table" in caplog.text
    write_obj(tmp_path / "table__usual.obj", TABLE, up="z")
    caplog.clear()
    (model,) = imported(tmp_path).models
    assert model.frame == "m, z up"
    (record,) = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert "warning: z up is guessed from its level surfaces, such files mostly have y up" in record.getMessage()
    write_obj(tmp_path / "table__usual.obj", CHAIR, up="z")
    (tmp_path / "table__usual.obj").rename(tmp_path / "chair__lying.obj")
    caplog.clear()
    (model,) = imported(tmp_path).models
    assert model.frame == "m, y up"  # size alone lays nothing down, nor stands it up
    assert "with z up it would be more like a chair; --up or an index tells" in caplog.text


def test_limits_of_a_lift_and_units_hold_through_to_the_library(tmp_path: Path) -> None:
    slide = "<joint name='l' type='prismatic'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>{}</joint>"
    (tmp_path / "in" / "meshes").mkdir(parents=True)
    for name, part in (("legs", LEGS), ("top", TABLE[:1])):
        asset = "<unit name='inch' meter='0.0254'/><up_axis>Z_UP</up_axis>"
        (tmp_path / "in" / "meshes" / f"{name}.dae").write_text(dae_text(part, 0.0254, asset=asset))
    links = {"a": visual("<mesh filename='meshes/legs.dae'/>"), "b": visual("<mesh filename='meshes/top.dae'/>")}
    (tmp_path / "in" / "table__fixed.urdf").write_text(
        robot(links, slide.format("<limit effort='1' velocity='1'/>"))
    )
    (tmp_path / "in" / "table__lift.urdf").write_text(robot(links, slide.format("<limit upper='.1'/>")))
    heights = {m.name: m.occluder.anchor("top").T_object_anchor[2, 3] for m in imported(tmp_path / "in").models}
    assert heights["fixed"] == pytest.approx(0.74, abs=1e-5)
    assert 0.74 < heights["lift"] < 0.84


def test_meshes_outside_the_folder_come_with_the_option(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    write_obj(tmp_path / "meshes" / "a.obj", TABLE, up="z")
    (tmp_path / "urdf").mkdir()
    (tmp_path / "urdf" / "table__a.urdf").write_text(robot({"a": visual("<mesh filename='../meshes/a.obj'/>")}))
    assert "is outside" in refused(tmp_path / "urdf", caplog)
    assert [m.name for m in imported(tmp_path / "urdf", outside_meshes=True).models] == ["a"]
    assert [m.name for m in imported(tmp_path).models] == ["urdf/a"]
