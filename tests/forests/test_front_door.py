"""The front door: names that come when they are called, one contract for all kinds, one way to open a file."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import forests
from forests.estimate import JointEstimate, JointPredictor, PixelLabeller
from forests.frames import Intrinsics, LabelTable
from forests.kinds import KINDS
from forests.modelfile import ModelFileError, write_model
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import LeafTable, pack_leaves
from forests.oarf.predict import Predictor as OARFPredictor
from forests.oarf.storage import pack_model, save_model
from forests.oarf.tune import untuned
from forests.records import to_json
from forests.rwf.config import RWFConfig
from forests.rwf.evidence import OUTCOMES, TERMS
from forests.rwf.model import ExpertTree, Limbs, RWFModel, WalkPlan
from forests.rwf.predict import Predictor as RWFPredictor
from forests.rwf.storage import save_model as save_walks
from forests.rwf.tables import pack_experts
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE

CAMERA = Intrinsics(100.0, 100.0, 15.5, 11.5)
LABELS = LabelTable(("body",), ("box",), ("neck", "hand"))


def run(code: str) -> str:
    """What a fresh interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(forests.__file__).parents[1],
    )
    return done.stdout.strip()


def test_importing_the_package_loads_nothing_heavy():
    heavy = ("scipy", "cv2", "numba", "numpy")
    assert run(f"import sys, forests; print([name for name in {heavy} if name in sys.modules])") == "[]"


def test_asking_a_forest_needs_neither_opencv_nor_more_of_scipy_than_numba_does():
    code = "import sys, forests.kinds, forests.oarf.predict, forests.oarf.storage, forests.rwf.predict"
    heavy = ("scipy.optimize", "scipy.special", "scipy.stats", "cv2")
    assert run(f"{code}, forests.rwf.storage; print([m for m in {heavy} if m in sys.modules])") == "[]"


def test_every_name_of_the_front_door_is_there():
    assert all(getattr(forests, name).__name__ == name for name in forests.__all__)
    assert set(forests.__all__) <= set(dir(forests))
    with pytest.raises(AttributeError, match="has no attribute 'Forest'"):
        _ = forests.Forest


def single_leaf() -> np.ndarray:
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    return nodes


def regression_forest() -> OARFModel:
    vote, weight = np.zeros((1, 2, 2, 2, 3), np.float32), np.zeros((1, 2, 2, 2), np.float32)
    weight[:, 0, :, 0] = 0.5
    leaves = pack_leaves(LeafTable(np.array([[0.5, 0.5]], np.float32), vote, weight))
    config = OARFConfig(n_trees=1)
    return OARFModel(
        config, LABELS, ClassTable.of(LABELS, config.mode), (ForestTree(single_leaf(), leaves),), untuned(2)
    )


def random_walk_forest() -> RWFModel:
    one = np.ones((1, 1), np.float32)
    tree = ExpertTree(single_leaf(), np.zeros((1, 1, 3), np.float32), one, 0 * one)
    ones, none = np.ones(2, np.float32), np.full(2, -1, np.int32)
    gate = np.tile(np.float32([0, np.inf]), (2, 1, 1))
    n_walks = np.full(2, 2, np.int32)
    plan = WalkPlan(np.arange(2, dtype=np.int32), none, ones, ones, np.zeros(2, np.int32), gate, n_walks, 3)
    limbs = Limbs(none, np.tile(np.float32([0, np.inf]), (2, 1)))
    weights = np.full((len(OUTCOMES), 2, len(TERMS)), np.nan, np.float32)
    config = RWFConfig(n_trees=1, n_clusters=1)
    return RWFModel(config, LABELS, LABELS.joints, pack_experts(((tree,), (tree,))), plan, limbs, weights)


@pytest.fixture(params=sorted(KINDS))
def file(request, tmp_path) -> Path:
    path = tmp_path / "model"
    if request.param == "oarf":
        save_model(path, regression_forest())
    else:
        save_walks(path, random_walk_forest())
    return path


def test_a_model_of_any_kind_is_opened_and_asked_the_same_way(file):
    predictor: JointPredictor = forests.load_model(file)
    depth = np.full((24, 32), 2000, np.uint16)
    for box in (None, (8.0, 4.5, 20.0, 16.25)):
        estimate = predictor.predict(depth, CAMERA, box)
        assert isinstance(estimate, JointEstimate)
        assert np.isfinite(estimate.joints).all()
        assert len(estimate.joints) == len(predictor.joints) == 2
    assert predictor.joints == LABELS.joints
    with pytest.raises(ValueError, match="box"):
        predictor.predict(depth, CAMERA, (20.0, 4.0, 8.0, 16.0))


def test_predictors_say_what_they_need_and_what_they_tell():
    regression, walks = OARFPredictor(regression_forest()), RWFPredictor(random_walk_forest())
    contract: list[JointPredictor] = [regression, walks]
    labeller: PixelLabeller = regression
    assert [each.box_joints for each in contract] == [(), RWFConfig().box_joints]
    assert labeller.classes == ("body", "box")
    assert set(np.unique(labeller.label_pixels(np.full((4, 4), 900, np.uint16), CAMERA))) <= {1, 2}


def test_a_kind_that_is_unknown_is_told_with_those_that_are_known(tmp_path):
    path = tmp_path / "model"
    write_model(path, "heat maps", {}, {})
    with pytest.raises(ModelFileError, match="of kind 'heat maps'; known are oarf, rwf"):
        forests.load_model(path)


def test_a_forest_of_other_settings_is_refused_in_one_sentence(tmp_path):
    """Such as a file from before a setting was renamed."""
    path, model = tmp_path / "model", regression_forest()
    config = to_json(model.config)
    config["n_modes"] = config.pop("n_leaf_votes")
    write_model(path, "oarf", pack_model(model), {"config": config, "labels": to_json(LABELS)})
    with pytest.raises(ModelFileError, match=r"no usable model: OARFConfig is \(.*n_modes.*\), must be") as caught:
        forests.load_model(path)
    assert "\n" not in str(caught.value)
