"""Generates a small corpus and reads it as numpy arrays, frames, and frames as a sensor would give them.

python examples/04_read_a_corpus.py [FOLDER]
"""

import sys
from pathlib import Path

from pipelines.commands.generate import GenerateSettings, generate
from pipelines.corpus import Corpus
from synth.scene import SceneConfig

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/example_corpus")
settings = GenerateSettings(out, frames=10, seed=5, scene=SceneConfig(camera="kinect_v1_qvga"))
generate(out, settings.order())

corpus = Corpus.open(out)
train = corpus.split("train")
depth, joints = corpus.arrays("depth", train), corpus.arrays("joints", train)
print(f"depth {depth.shape} {depth.dtype} mm, joints {joints.shape} {joints.dtype} m")
for frame in corpus.frames("test", sensor="kinect_v1"):
    n_occluded = int((frame.joint_state == 1).sum())
    print(f"frame {frame.info.index}: {frame.info.scene_family}, {n_occluded} joints behind objects")
