"""Model files: what is written is read, the same contents are the same bytes, and nothing else is a model."""

import json
import struct
from dataclasses import asdict, replace

import numpy as np
import pytest
import safetensors.numpy

from forests.frames import Intrinsics, LabelTable
from forests.growing import GrowthConfig
from forests.modelfile import FORMAT, ModelFileError, read_model, write_model
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.evidence import TERMS
from forests.oarf.model import ForestTree, OARFModel, Tuning
from forests.oarf.packed import LeafTable, pack_leaves, voting
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model, pack_model, pack_tree, save_model, unpack_model
from forests.oarf.tune import untuned
from forests.records import from_json, to_json
from forests.rwf.config import RWFConfig
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE, pack_inner_nodes
from storage.digested import write_digested

ARRAYS = {
    "depths": np.arange(24, dtype=np.int16).reshape(2, 3, 4),
    "shares": np.linspace(0, 1, 7, dtype=np.float32),
    "marks": np.array([True, False]),
    "nothing": np.zeros((0, 3), np.uint16),
}
METADATA = {"name": "Ä", "scores": [0.1, 2.5e-9, None], "nested": {"b": 1, "a": True}}
LABELS = LabelTable(("head", "trunk"), ("table", "box"), ("head", "neck", "torso"))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.safetensors"


def same(one, two):
    return one.keys() == two.keys() and all(
        a.dtype == two[name].dtype and a.shape == two[name].shape and a.tobytes() == two[name].tobytes()
        for name, a in one.items()
    )


def test_what_is_written_is_read(path):
    write_model(path, "oarf", ARRAYS, METADATA)
    kind, arrays, metadata = read_model(path, "oarf")
    assert (kind, metadata) == ("oarf", METADATA)
    assert same(arrays, ARRAYS)
    assert all(values.flags.writeable for values in arrays.values())
    assert same(safetensors.numpy.load_file(path), ARRAYS)


def test_the_same_contents_are_the_same_bytes(path, tmp_path):
    other = tmp_path / "other"
    write_model(path, "oarf", ARRAYS, METADATA)
    turned = {name: np.asfortranarray(ARRAYS[name]) for name in reversed(ARRAYS)}
    write_model(other, "oarf", turned, {name: METADATA[name] for name in reversed(METADATA)})
    assert other.read_bytes() == path.read_bytes()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["model.safetensors", "other"]


def test_a_write_that_fails_leaves_the_old_file(path):
    write_model(path, "oarf", ARRAYS, METADATA)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"array words is <U5; a model file holds F64, F32"):
        write_model(path, "oarf", {"words": np.array(["a", "words"])}, {})
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_model(path, "oarf", ARRAYS, {"score": float("nan")})
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def rewritten(path, **changes):
    """The file with other values in our metadata, the digest kept."""
    arrays = safetensors.numpy.load_file(path)
    with safetensors.safe_open(path, "np") as file:
        document = json.loads(file.metadata()["undergrowth"])
    path.write_bytes(safetensors.numpy.save(arrays, {"undergrowth": json.dumps(document | changes)}))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda p: p.unlink(), "there is no model file"),
        (lambda p: (p.unlink(), p.mkdir()), "is a folder, not a model file"),
        (lambda p: p.write_bytes(b""), "not in the safetensors format"),
        (lambda p: p.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(500)), "not in the safetensors format"),
        (lambda p: p.write_bytes(struct.pack("<Q", 2**62) + b"{}"), "not in the safetensors format"),
        (lambda p: p.write_bytes(struct.pack("<Q", 4000) + b"{}"), "is truncated, or no model file"),
        (lambda p: p.write_bytes(struct.pack("<Q", 4) + b"[[[["), "its header is no JSON"),
        (lambda p: p.write_bytes(struct.pack("<Q", 10**6) + b"[" * 10**6), "its header is no JSON"),
        (lambda p: p.write_bytes(p.read_bytes()[:-5]), "is damaged or truncated"),
        (lambda p: p.write_bytes(p.read_bytes()[:100]), "is truncated, or no model file"),
        (lambda p: p.write_bytes(p.read_bytes() + b"more"), "is damaged or truncated"),
        (lambda p: p.write_bytes(p.read_bytes()[:-1] + b"\x07"), "its digest does not match its contents"),
        (lambda p: p.write_bytes(safetensors.numpy.save(ARRAYS)), "no undergrowth model: it lacks the metadata"),
        (lambda p: p.write_bytes(safetensors.numpy.save(ARRAYS, {"undergrowth": "[]"})), "lacks the metadata"),
        (lambda p: p.write_bytes(safetensors.numpy.save(ARRAYS, {"undergrowth": "{" * 9**5})), "lacks the"),
        (
            lambda p: rewritten(p, format_version=99),
            f"has format version 99; .* reads version 1 and {FORMAT.version}",
        ),
        (lambda p: rewritten(p, kind="rwf"), "holds a model of kind 'rwf', must be 'oarf'"),
        (lambda p: rewritten(p, kind=None), "its metadata is incomplete"),
        (lambda p: rewritten(p, metadata=[]), "its metadata is incomplete"),
        (lambda p: rewritten(p, metadata={"seed": 1}), "its digest does not match its contents"),
        (lambda p: rewritten(p, metadata={"seed": float("inf")}), "its digest does not match its contents"),
    ],
)
def test_every_other_file_is_refused_in_one_sentence(path, spoil, message):
    write_model(path, "oarf", ARRAYS, METADATA)
    spoil(path)
    with pytest.raises(ModelFileError, match=message) as caught:
        read_model(path, "oarf")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def mutations(original, n, seed):
    """Flipped bits, cuts, insertions, removals, and edits of the header's text."""
    rng = np.random.default_rng(seed)
    n_header = int.from_bytes(original[:8], "little")
    for _ in range(n):
        data = bytearray(original)
        place = int(rng.integers(len(data)))
        match rng.integers(6):
            case 0:
                data[place] ^= 1 << int(rng.integers(8))
            case 1:
                del data[place:]
            case 2:
                data[place:place] = rng.bytes(int(rng.integers(1, 20)))
            case 3:
                del data[place : place + int(rng.integers(1, 20))]
            case 4:
                data[8 + int(rng.integers(n_header))] = int(rng.choice(list(b'0123456789"{}[]:,\\ -eIF')))
            case _:
                data[: 1 + place % 8] = rng.bytes(1 + place % 8)
        yield bytes(data)


def test_a_damaged_file_loads_the_same_or_is_refused(path):
    write_model(path, "oarf", ARRAYS, METADATA)
    original = path.read_bytes()
    n_same = 0
    with path.open("r+b", buffering=0) as file:
        for data in mutations(original, 3000, seed=5):
            file.seek(0)
            file.truncate(file.write(data))
            try:
                kind, arrays, metadata = read_model(path)
            except ModelFileError:
                continue
            assert (kind, metadata) == ("oarf", METADATA)
            assert same(arrays, ARRAYS)
            n_same += 1
    assert n_same < 300


def small_tree(seed):
    """Seven nodes, four leaves, random tables."""
    rng = np.random.default_rng(seed)
    nodes = np.zeros(7, NODE_DTYPE)
    nodes["u"], nodes["v"] = rng.normal(size=(2, 7, 2))
    nodes["threshold"], nodes["left"], nodes["leaf"] = 100, [1, 3, 5, 3, 4, 5, 6], [-1, -1, -1, 0, 1, 2, 3]
    nodes[3:]["u"] = nodes[3:]["v"] = 0
    nodes["threshold"][3:] = LEAF_THRESHOLD
    probability = rng.dirichlet(np.full(4, 0.3), size=4).astype(np.float32)
    weight = -np.sort(-(rng.random((4, 2, 3, 2), np.float32) ** 2), axis=-1)
    weight[0, 1], weight[1, :, 2, 1] = 0, 1e-6
    vote = rng.normal(size=(4, 2, 3, 2, 3)).astype(np.float32) * (weight > 0)[..., None]
    return nodes, LeafTable(probability, vote.astype(np.float32), weight)


@pytest.fixture
def model():
    config = OARFConfig(n_trees=2, growth=GrowthConfig(max_depth=3))
    tuning = Tuning(
        np.array([0.3, 0.6, np.inf], np.float32),
        np.array([0.05, 0.06, 0.08], np.float32),
        np.arange(3 * len(TERMS), dtype=np.float32).reshape(3, -1),
        untuned(3).hidden_weights,
    )
    trees = tuple(ForestTree(nodes, pack_leaves(table)) for nodes, table in map(small_tree, (1, 2)))
    return OARFModel(config, LABELS, ClassTable.of(LABELS, "semantic"), trees, tuning)


def test_a_saved_forest_is_the_one_in_memory_to_the_byte(model, path):
    save_model(path, model, {"corpus": {"digest": "0"}})
    loaded = load_model(path)
    assert (loaded.config, loaded.labels, loaded.classes) == (model.config, model.labels, model.classes)
    assert same(asdict(loaded.tuning), asdict(model.tuning))
    for one, two in zip(loaded.trees, model.trees, strict=True):
        assert np.array_equal(one.nodes, two.nodes)
        assert one.leaves.shape == two.leaves.shape
        assert same(pack_tree(one), pack_tree(two._replace(leaves=voting(two.leaves, model.tuning.max_offset_m))))
        assert 0 < len(one.leaves.weight) < len(two.leaves.weight)
    assert read_model(path).metadata["corpus"] == {"digest": "0"}
    first = path.read_bytes()
    save_model(path, loaded, {"corpus": {"digest": "0"}})
    assert path.read_bytes() == first


def test_rounding_changes_a_leaf_table_once_and_by_no_more_than_its_steps():
    _, table = small_tree(3)
    packed = pack_leaves(table)
    kept = packed.unpacked()
    has_weight = kept.weight > 0
    assert np.array_equal(has_weight, np.rint(table.weight * 32767) > 0)
    assert np.abs(kept.weight - table.weight).max() <= 0.51 / 32767
    assert np.abs(kept.vote - table.vote)[has_weight].max() <= 0.51e-3
    assert not kept.vote[~has_weight].any()
    assert np.abs(kept.probability - table.probability).max() < 1e-5
    again = pack_leaves(kept)
    assert again[:2] == packed[:2]
    assert all(a.tobytes() == b.tobytes() for a, b in zip(again[2:], packed[2:], strict=True))


DEPTH = np.random.default_rng(0).integers(1000, 3000, (20, 30)).astype(np.uint16)
CAMERA = Intrinsics(30.0, 30.0, 14.5, 9.5)


def test_a_loaded_forest_can_be_asked(model, path):
    save_model(path, model)
    one, two = (Predictor(item).predict(DEPTH, CAMERA) for item in (model, load_model(path)))
    assert one.proposals.tobytes() == two.proposals.tobytes()
    assert one.probability.tobytes() == two.probability.tobytes()
    assert np.isfinite(one.joints[1:]).all()


def changed(arrays, name, place, value):
    out = arrays[name].copy()
    out[place] = value
    return arrays | {name: out}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda a: {n: v for n, v in a.items() if n != "tree1.threshold"}, "array threshold is missing"),
        (
            lambda a: a | {"tree0.probe": a["tree0.probe"].astype(np.float64)},
            r"probe is float64 \(3, 4\), must be",
        ),
        (lambda a: a | {"tree0.vote": a["tree0.vote"][:-1]}, r"array vote is int16 \(\d+, 3\), must be int16"),
        (lambda a: a | {"tree0.has_vote": a["tree0.has_vote"][:-1]}, "array has_vote is uint8"),
        (lambda a: changed(a, "tree0.is_leaf", 0, 0b11110000), "children do not follow it"),
        (lambda a: changed(a, "tree0.is_leaf", 0, 0b01100110), "children do not follow it"),
        (lambda a: changed(a, "tree0.is_leaf", 0, 0b01111010), "children do not follow it"),
        (lambda a: changed(a, "tree0.is_leaf", 0, 0b00011111), "set beyond them"),
        (lambda a: a | {"tree0.is_leaf": np.zeros(2, np.uint8)}, "nodes are 2 bytes"),
        (lambda a: changed(a, "tree0.probe", 1, np.nan), "within 100.0 m"),
        (lambda a: changed(a, "tree0.probe", 1, 1e30), "within 100.0 m"),
        (lambda a: changed(a, "tree0.vote", 1, -32768), "within 32000 mm"),
        (lambda a: changed(a, "tree0.weight", 1, -1), "not below 0"),
        (lambda a: changed(a, "tree0.probability", 0, 0), "do not sum to 1"),
        (lambda a: changed(a, "tuning.bandwidth_m", 0, np.nan), "bandwidth_m"),
        (lambda a: changed(a, "tuning.max_offset_m", 0, 0.0), "max_offset_m"),
        (lambda a: changed(a, "tuning.within_weights", (0, 1), np.nan), "not finite"),
        (
            lambda a: a | {"tuning.within_weights": np.zeros((3, 1), np.float32)},
            "tuning.within_weights is float32",
        ),
    ],
)
def test_no_file_makes_a_kernel_read_beyond_an_array(model, path, spoil, message):
    """The digest fits: such a file was made so."""
    metadata = {"config": to_json(model.config), "labels": to_json(model.labels)}
    write_model(path, "oarf", spoil(pack_model(model)), metadata)
    with pytest.raises(ModelFileError, match=message) as caught:
        load_model(path)
    assert str(caught.value).startswith(f"{path} holds no usable model: ")


def test_a_forest_of_any_numbers_is_refused_or_answers(model, path):
    """Random values in random places, the digest made to fit: finite joints or none, never a crash."""
    rng = np.random.default_rng(7)
    arrays, metadata = pack_model(model), {"config": to_json(model.config), "labels": to_json(model.labels)}
    n_asked = 0
    for _ in range(150):
        name = str(rng.choice(sorted(arrays)))
        values = np.frombuffer(rng.bytes(arrays[name].itemsize), arrays[name].dtype)[0]
        near = arrays[name].dtype.type(rng.integers(0, 9))
        place = tuple(rng.integers(arrays[name].shape))
        write_model(path, "oarf", changed(arrays, name, place, rng.choice([values, near])), metadata)
        try:
            loaded = load_model(path)
        except ModelFileError:
            continue
        estimate = Predictor(loaded).predict(DEPTH, CAMERA)
        is_found = estimate.confidence > 0
        assert np.isfinite(estimate.joints[is_found]).all()
        n_asked += 1
    assert 10 < n_asked < 140


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"config": None}, r"OARFConfig is \(NoneType\), must be \(mode, n_trees"),
        ({"config": {"mode": "semantic", "colour": 1}}, r"OARFConfig is \(colour, mode\)"),
        ({"n_trees": "2"}, "OARFConfig.n_trees is '2', must be int"),
        ({"n_trees": True}, "OARFConfig.n_trees is True, must be int"),
        ({"n_trees": 3}, "array threshold is missing"),
        ({"n_leaf_votes": 2**40}, "n_leaf_votes=1099511627776 must be in 1..100"),
        ({"n_leaf_votes": 50}, "array has_vote is uint8"),
        ({"mode": "baseline"}, "array has_class is uint8"),
        ({"mode": ["semantic"]}, "OARFConfig.mode is"),
        ({"growth": {"depth": 3}}, "GrowthConfig is"),
        ({"leaf_bandwidth_m": 10**400}, "too large for a float"),
        ({"labels": {"parts": [], "occluders": [], "joints": []}}, "needs at least one body part"),
        ({"labels": {"parts": [1], "occluders": [], "joints": []}}, "LabelTable.parts is 1, must be str"),
    ],
)
def test_metadata_that_does_not_fit_is_refused(model, path, change, message):
    config, labels = to_json(model.config), to_json(model.labels)
    if "config" in change or "labels" in change:
        metadata = {"config": config, "labels": labels} | change
    else:
        metadata = {"config": config | change, "labels": labels}
    write_model(path, "oarf", pack_model(model), metadata)
    with pytest.raises(ModelFileError, match=message):
        load_model(path)


def test_settings_that_a_file_of_an_earlier_version_lacks_take_their_defaults(model, path):
    config = to_json(model.config)
    del config["max_samples"]
    write_model(path, "oarf", pack_model(model), {"config": config, "labels": to_json(model.labels)})
    assert load_model(path).config == model.config


def version_1(model):
    """The arrays of a forest as files of version 1 held them."""
    arrays = {name: values for name, values in pack_model(model).items() if not name.startswith("tree")}
    for number, tree in enumerate(model.trees):
        arrays |= {f"tree{number}.{name}": values for name, values in pack_tree(tree).items()}
    return arrays


def test_a_forest_of_version_1_answers_the_same(model, path):
    metadata = {"config": to_json(model.config), "labels": to_json(model.labels)}
    write_digested(path, replace(FORMAT, version=1), "oarf", version_1(model), metadata)
    before = load_model(path)
    assert all(same(pack_tree(one), pack_tree(two)) for one, two in zip(before.trees, model.trees, strict=True))
    save_model(path, before)
    one, two = (Predictor(item).predict(DEPTH, CAMERA) for item in (before, load_model(path)))
    assert one.proposals.tobytes() == two.proposals.tobytes()


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda a: changed(a, "tree0.left", 0, 0), "children do not follow it"),
        (lambda a: changed(a, "tree0.left", 2, 2**31 - 1), "children do not follow it"),
        (lambda a: changed(a, "tree0.left", 2, 3), "must be the child of one other"),
        (lambda a: changed(a, "tree0.leaf", 3, 2), r"leaves must be numbered 0\.\.3"),
        (lambda a: changed(a, "tree0.leaf", 1, -2), "neither a leaf nor a decision"),
        (lambda a: changed(a, "tree0.threshold", 4, 7), "a leaf leads elsewhere"),
        (lambda a: changed(a, "tree0.offsets", 1, np.nan), "offsets are not finite"),
        (lambda a: changed(a, "tree0.offsets", 1, 1e30), "within 100.0 m"),
    ],
)
def test_no_file_of_version_1_makes_a_kernel_read_beyond_an_array(model, spoil, message):
    metadata = {"config": to_json(model.config), "labels": to_json(model.labels)}
    with pytest.raises(ValueError, match=message):
        unpack_model(spoil(version_1(model)), metadata)


def test_trees_that_are_not_breadth_first_are_not_packed():
    nodes, _ = small_tree(1)
    nodes["leaf"][3:] = [1, 0, 2, 3]
    with pytest.raises(ValueError, match="breadth first"):
        pack_inner_nodes(nodes)


def test_metadata_of_a_model_cannot_be_overwritten(model, path):
    with pytest.raises(ValueError, match="must not name labels"):
        save_model(path, model, {"labels": {}})


@pytest.mark.parametrize("config", [OARFConfig(seed=7, mode="baseline"), RWFConfig(joints=("head",))])
def test_configs_travel_as_json(config):
    assert from_json(type(config), json.loads(json.dumps(to_json(config)))) == config
    assert from_json(type(config), to_json(replace(config, n_trees=9))).n_trees == 9
