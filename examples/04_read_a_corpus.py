"""Generates a small corpus and reads it as numpy arrays, frames, and frames as a sensor would give them.

python examples/04_read_a_corpus.py [FOLDER]
"""

import sys
from pathlib import Path

from pipelines import generate_corpus
from synth import SceneConfig

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/example_corpus")
corpus = generate_corpus(out, SceneConfig(camera="kinect_v1_qvga"), n_frames=10, seed=5)
train = corpus.split("train")
depth, joints = corpus.arrays("depth", train), corpus.arrays("joints", train)
print(f"depth {depth.shape} {depth.dtype} mm, joints {joints.shape} {joints.dtype} m")
for frame in corpus.frames("test", sensor="kinect_v1"):
    n_occluded = int((frame.joint_state == 1).sum())
    print(f"frame {frame.info.index}: {frame.info.scene_family}, {n_occluded} joints behind objects")
