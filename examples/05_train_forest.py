"""Trains a small forest on a small corpus, keeps it in a file, and finds the joints in a frame it has not seen.

python examples/05_train_forest.py [FOLDER]
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model, save_model
from forests.oarf.train import train
from pipelines.commands.generate import GenerateSettings, generate
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.drawing.skeletons import PixelLabels, overlay
from synth.scene import SceneConfig

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/example_forest")
settings = GenerateSettings(out / "corpus", frames=256, seed=5, scene=SceneConfig(camera="kinect_v1_qvga"))
generate(settings.out, settings.order())
corpus = Corpus.open(settings.out)
frames, validation, test = (CorpusFrames(corpus, corpus.split(name)) for name in ("train", "val", "test"))

growth = GrowthConfig(max_depth=12, n_candidates=200)
config = OARFConfig(mode="semantic", n_trees=2, n_pixels=300, n_occluder_pixels=300, growth=growth)
save_model(out / "forest.safetensors", train(frames, config, validation=validation))

model = load_model(out / "forest.safetensors")
predictor = Predictor(model)
frame = test[0]
estimate = predictor.predict(frame.depth, frame.camera)
for k, name in enumerate(model.labels.joints):
    error = np.linalg.norm(estimate.joints[k] - frame.joints[k])
    state = "hidden" if frame.is_occluded[k] else "seen"
    print(f"{name:11} {state:7} off by {100 * error:5.1f} cm, hidden with {estimate.hidden_probability[k]:.2f}")
pixels = PixelLabels(predictor.label_pixels(frame.depth, frame.camera), model.classes.names)
cv2.imwrite(str(out / "joints.png"), overlay(frame.depth, estimate, model.labels.joints, pixels))
