"""Trains a small forest on a small corpus, keeps it in a file, and finds the joints in a frame it has not seen.

python examples/05_train_forest.py [FOLDER]
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from forests import GrowthConfig, OARFConfig, OcclusionAwareForest, load_model
from pipelines import CorpusFrames, PixelLabels, generate_corpus, overlay
from synth import SceneConfig

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/example_forest")
corpus = generate_corpus(out / "corpus", SceneConfig(camera="kinect_v1_qvga"), n_frames=256, seed=5)
frames, validation, test = (CorpusFrames(corpus, corpus.split(name)) for name in ("train", "val", "test"))

growth = GrowthConfig(max_depth=12, n_candidates=200)
config = OARFConfig(mode="semantic", n_trees=2, n_pixels=300, n_occluder_pixels=300, growth=growth)
OcclusionAwareForest(config).fit(frames, validation).save(out / "forest.safetensors")

predictor = load_model(out / "forest.safetensors")
frame = test[0]
estimate = predictor.predict(frame.depth, frame.camera)
for k, name in enumerate(predictor.joints):
    error = np.linalg.norm(estimate.joints[k] - frame.joints[k])
    state = "hidden" if frame.is_occluded[k] else "seen"
    print(f"{name:11} {state:7} off by {100 * error:5.1f} cm, hidden with {estimate.hidden_probability[k]:.2f}")
pixels = PixelLabels(predictor.label_pixels(frame.depth, frame.camera), predictor.classes)
cv2.imwrite(str(out / "joints.png"), overlay(frame.depth, estimate, predictor.joints, pixels))
