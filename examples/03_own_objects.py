"""Makes furniture by hand: a table of given size, a laptop's hinge opened, their distance to a point.

python examples/03_own_objects.py
"""

from dataclasses import replace

import numpy as np

from synth import occluders, solid_distances, translation

rng = np.random.default_rng(0)
table = occluders.sample("table", rng, kind="table", height=0.74)
laptop = occluders.sample("laptop", rng)
print(occluders.to_plain(table))

made = occluders.make(table)
print(f"{made.class_name}: {len(made.mesh.faces)} faces, anchors {[anchor.name for anchor in made.anchors]}")
opened = occluders.make(replace(laptop, hinge_angle=np.radians(120.0)))
print(f"opened laptop is {opened.mesh.vertices[:, 2].max():.2f} m high")

point = np.array([[0.0, 0.0, 1.0]])
print(f"1 m above the floor: {solid_distances(made.solids, translation(0, 0, 0), point)[0]:.2f} m over the table")
