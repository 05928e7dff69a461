"""URDF files mean what the URDF specification says: joints, limits, units, and files only where they may be."""

from pathlib import Path

import numpy as np
import pytest

from pipelines.foreign import ForeignFileError
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.read import MeshFile, read_mesh
from tests.pipelines.importing.mesh_texts import (
    CHAIR,
    TABLE,
    dae_text,
    joint,
    robot,
    vertices_of,
    visual,
    write_obj,
)

BOX = visual("<box size='2 4 6'/>")
SMALL = visual("<box size='.2 .2 .2'/>")


def read(path: Path, text: str, folder: Path | None = None, pose: str = "0", outside: bool = False) -> MeshFile:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return read_mesh(path, Reach(folder or path.parent, outside), pose)


def refusal(path: Path, text: str, folder: Path | None = None) -> str:
    with pytest.raises(ForeignFileError) as caught:
        read(path, text, folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def ends(file: MeshFile) -> np.ndarray:
    """(2, 3) lowest and highest coordinates."""
    return np.stack([file.triangles.vertices.min(axis=0), file.triangles.vertices.max(axis=0)])


@pytest.mark.parametrize(
    ("limit", "low", "high"),
    [
        ("<limit lower='0.1' upper='0.4' effort='1' velocity='1'/>", 0.1, 0.4),
        ("<limit upper='0.4'/>", 0.0, 0.4),
        ("<limit lower='-0.4'/>", -0.4, 0.0),
        ("<limit effort='1' velocity='1'/>", 0.0, 0.0),
        ("", 0.0, 0.0),
    ],
)
def test_limits_that_are_missing_are_zero(tmp_path: Path, limit: str, low: float, high: float) -> None:
    text = robot({"a": "", "b": SMALL}, joint("prismatic", "a", "b", f"<axis xyz='0 0 1'/>{limit}"))
    z = np.array([ends(read(tmp_path / "a.urdf", text, pose=str(k)))[1, 2] - 0.1 for k in range(60)])
    assert (z >= low - 1e-12).all()
    assert (z <= high + 1e-12).all()
    assert np.ptp(z) >= 0.8 * (high - low)
    turned = text.replace("prismatic", "revolute").replace(SMALL, visual("<box size='.2 .2 .2'/>", "1 0 0"))
    middle = np.array([ends(read(tmp_path / "b.urdf", turned, pose=str(k))).mean(axis=0) for k in range(60)])
    angle = np.arctan2(middle[:, 1], middle[:, 0])
    assert (angle >= low - 1e-9).all()
    assert (angle <= high + 1e-9).all()


def test_a_continuous_joint_turns_all_the_way_whatever_its_limits(tmp_path: Path) -> None:
    arm = visual("<box size='.2 .2 .2'/>", "1 0 0")
    text = robot(
        {"a": "", "b": arm}, joint("continuous", "a", "b", "<axis xyz='0 0 2'/><limit lower='0' upper='0'/>")
    )
    middle = np.array([ends(read(tmp_path / "a.urdf", text, pose=str(k))).mean(axis=0) for k in range(100)])
    assert np.hypot(middle[:, 0], middle[:, 1]) == pytest.approx(1.0)
    assert np.bincount(np.floor(np.arctan2(middle[:, 1], middle[:, 0]) / (0.5 * np.pi)).astype(int) + 2).min() > 10


def test_mimic_joints_follow_through_a_chain(tmp_path: Path) -> None:
    def slide(parent: str, child: str, inner: str) -> str:
        return joint("prismatic", parent, child, f"<axis xyz='0 0 1'/><limit lower='0' upper='1'/>{inner}")

    joints = (
        slide("a", "d", "<mimic joint='c' multiplier='-1' offset='4'/>")
        + slide("a", "c", "<mimic joint='b' multiplier='2' offset='1'/>")
        + slide("a", "b", "")
    )
    at = {"b": "0 0 0", "c": "10 0 0", "d": "20 0 0"}
    text = robot({"a": "", **{n: visual("<box size='.2 .2 .2'/>", xyz) for n, xyz in at.items()}}, joints)
    vertices = read(tmp_path / "a.urdf", text).triangles.vertices
    b, c, d = (vertices[np.abs(vertices[:, 0] - x) < 1.0, 2].mean() for x in (0, 10, 20))
    assert 0.0 < b < 1.0
    assert c == pytest.approx(2.0 * b + 1.0)
    assert d == pytest.approx(4.0 - c)
    circle = text.replace("</limit>", "").replace("upper='1'/></joint>", "upper='1'/><mimic joint='d'/></joint>")
    assert "mimics itself" in refusal(tmp_path / "a.urdf", circle)
    assert "mimics 'nobody', which is not there" in refusal(
        tmp_path / "a.urdf", text.replace("joint='b'", "joint='nobody'")
    )


@pytest.mark.parametrize("kind", ["floating", "planar", "fixed"])
def test_bases_that_float_stay_where_their_origin_is(tmp_path: Path, kind: str) -> None:
    inner = "<origin xyz='1 2 3' rpy='0 0 1.5707963267948966'/>"
    file = read(tmp_path / "a.urdf", robot({"world": "", "a": BOX}, joint(kind, "world", "a", inner)))
    assert ends(file) == pytest.approx(np.array([(-1, 1, 0), (3, 3, 6)]))


def test_angles_are_about_fixed_axes_and_solids_have_their_size(tmp_path: Path) -> None:
    quarter = "1.5707963267948966"
    text = robot({"a": visual("<box size='2 4 6'/>", rpy=f"{quarter} 0 {quarter}")})
    assert np.ptp(ends(read(tmp_path / "a.urdf", text)), axis=0) == pytest.approx((6, 2, 4))
    shapes = {"cylinder radius='1' length='3'": (2, 2, 3), "sphere radius='2'": (4, 4, 4)}
    for shape, size in {**shapes, "capsule radius='1' length='3'": (2, 2, 5)}.items():
        file = read(tmp_path / "a.urdf", robot({"a": visual(f"<{shape}/>")}))
        assert np.ptp(ends(file), axis=0) == pytest.approx(size)
        a, b, c = (file.triangles.vertices[file.triangles.faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).min() >= -1e-12  # all faces look outwards


@pytest.mark.parametrize(
    ("asset", "unit"), [("<unit meter='0.0254'/>", 0.0254), ("<unit meter='0.01'/>", 0.01), ("", 1.0)]
)
def test_the_unit_of_a_dae_counts_in_a_urdf_and_its_axis_does_not(tmp_path: Path, asset: str, unit: float) -> None:
    (tmp_path / "a.dae").write_text(dae_text(CHAIR, unit, asset=asset))
    text = robot({"a": visual("<mesh filename='a.dae' scale='1 -1 2'/>")})
    file = read(tmp_path / "a.urdf", text)
    assert ends(file) == pytest.approx(np.array([(0, -0.45, 0), (0.45, 0, 1.8)]), abs=1e-6)
    assert file.notes == ()
    (tmp_path / "a.dae").write_text(dae_text(CHAIR, unit, asset=asset + "<up_axis>Y_UP</up_axis>"))
    file = read(tmp_path / "a.urdf", text)
    assert ends(file)[1, 2] == pytest.approx(1.8)
    assert file.notes == ("a.dae says y up, which a URDF overrules",)


NAMES = [
    "../meshes/a.obj", "package://desk/meshes/a.obj", "package://other_name/meshes/a.obj", "model://desk/meshes/a.obj",
    "..\\meshes\\a.obj", "package://parts/a.obj", "../meshes/./a.obj",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_files_are_found_as_ros_does(tmp_path: Path, name: str) -> None:
    write_obj(tmp_path / "robots" / "desk" / "meshes" / "a.obj", TABLE, up="z")
    write_obj(tmp_path / "parts" / "a.obj", TABLE, up="z")
    (tmp_path / "robots" / "desk" / "package.xml").write_text("<package><name>other_name</name></package>")
    path = tmp_path / "robots" / "desk" / "urdf" / "table.urdf"
    for said in (name, f"  {name} "):
        file = read(path, robot({"a": visual(f'<mesh filename="{said}"/>')}), tmp_path)
        assert same(file.triangles.vertices, vertices_of(TABLE))


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return np.allclose(np.unique(a.round(6), axis=0), np.unique(b.round(6), axis=0))


def test_files_outside_the_folder_need_to_be_allowed(tmp_path: Path) -> None:
    write_obj(tmp_path / "pack" / "a.obj", TABLE, up="z")
    folder = tmp_path / "pack" / "in"
    folder.mkdir()
    outside = tmp_path / "pack" / "a.obj"
    (folder / "link.obj").symlink_to(outside)
    for name in (
        "../a.obj",
        str(outside),
        outside.as_uri(),
        f"file:{outside}",
        "package://pack/a.obj",
        "link.obj",
    ):
        text = robot({"a": visual(f"<mesh filename='{name}'/>")})
        said = refusal(folder / "a.urdf", text)
        assert name in said
        assert "is outside" in said
        assert "--outside-meshes" in said
        assert len(read(folder / "a.urdf", text, outside=True).triangles.faces) == 60
    inside = read(folder / "a.urdf", text.replace("link.obj", outside.as_uri()), tmp_path)
    assert len(inside.triangles.faces) == 60
    for name in ("https://a/b.obj", "package://pack/none.obj", "none.obj", "", "a" * 5000, "."):
        said = refusal(folder / "a.urdf", robot({"a": visual(f"<mesh filename='{name}'/>")}))
        assert "which is not there" in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (robot({"a": visual("<mesh filename='gone.dae'/>") + BOX}), "names gone.dae, which is not there"),
        (robot({"a": "<collision><geometry><box size='1 1 1'/></geometry></collision>"}), "only collision shapes"),
        (robot({"a": visual("<mesh filename='a.urdf'/>")}), "is a mesh of a URDF, but none of .obj"),
        (robot({"a": BOX, "b": BOX}), "2 links hang on nothing, must be one: a, b"),
        (robot({"a": BOX}, joint("fixed", "a", "b")), "names the link 'b', which is not there"),
        (
            robot({"a": BOX, "b": ""}, joint("fixed", "a", "b") + joint("fixed", "b", "a")),
            "0 links hang on nothing",
        ),
        (robot({"a": BOX}, "<joint name='j' type='fixed'/>"), "joint 'j' names the link '', which is not there"),
        (robot({"a": visual("<cylinder radius='1'/>")}), "something lacks what it must have: 'length'"),
        (robot({"a": BOX, "b": ""}, joint("hinge", "a", "b")), "has type 'hinge', known are revolute"),
        (
            robot({"a": BOX, "b": ""}, joint("prismatic", "a", "b", "<limit lower='.2'/>")),
            "its lower limit 0.2 above its upper limit 0; one that is not given is 0",
        ),
        (robot({"a": BOX, "b": ""}, joint("revolute", "a", "b", "<axis xyz='0 0 0'/>")), "an axis without length"),
        (
            robot({"a": BOX, "b": ""}, joint("revolute", "a", "b", "<limit upper='nan'/>")),
            "must be a finite number",
        ),
        (robot({"a": visual("<box size='1 1'/>")}), "must hold three finite numbers"),
        (robot({"a": visual("<box size='${w} 1 1'/>")}), "holds xacro macros"),
        (robot({"a": visual("<mesh filename='$(find desk)/a.obj'/>")}), "holds xacro macros"),
        (
            "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:leg n='1'/></robot>",
            "holds xacro macros: write it as a URDF first",
        ),
        ("<robot><link name='a'><visual><geometry/></visual></link></robot>", "a visual without geometry"),
        ("<sdf version='1.6'/>", "its root is <sdf>, not <robot>"),
        ("<robot>", "no well-formed XML"),
    ],
)
def test_what_is_no_urdf_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    assert said in refusal(tmp_path / "a.urdf", text)


def test_a_blank_line_before_the_declaration_does_no_harm(tmp_path: Path) -> None:
    text = "\n\n<?xml version='1.0' encoding='utf-8'?>\n" + robot({"a": BOX})
    assert len(read(tmp_path / "a.urdf", text).triangles.faces) == 12


def test_a_damaged_part_is_the_parts_fault(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(b"\0" * 90)
    said = refusal(tmp_path / "a.urdf", robot({"a": visual("<mesh filename='part.stl'/>")}))
    assert "part.stl is damaged, or not an STL file" in said
