"""undergrowth train on several corpora: generated and recorded frames learned together, measured once."""

from dataclasses import dataclass

import numpy as np
import pytest
from toy_walker import NAMES, import_recording, write_recording

from forests.frames import DepthFrame
from forests.modelfile import read_model
from forests.oarf.storage import load_model, pack_model
from forests.oarf.train import train as train_oarf
from pipelines.cli import main
from pipelines.corpus import Corpus
from pipelines.corpus.joined import JoinedFrames, open_corpora, sensors_of
from pipelines.corpus.sequence import LABELS, CorpusFrames
from pipelines.errors import CorpusError
from pipelines.models.checkpoints import TreeFolder
from synth.vocabulary import JOINT_NAMES

KNOWN = [name for name in NAMES if name != "torso"]
SMALL = (
    "--n-trees", "2", "--max-frames", "12", "--growth.max-depth", "4", "--growth.n-candidates", "20",
)  # fmt: skip
OARF = (*SMALL, "--n-pixels", "60", "--n-occluder-pixels", "60", "--n-voting-pixels", "100")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """24 frames of 160x120, of which 12 train and 6 val; the torso is unknown."""
    folder = tmp_path_factory.mktemp("recording")
    return Corpus.open(import_recording(folder, folder / "corpus", write_recording(folder, known=KNOWN)))


@pytest.fixture(scope="module")
def head_alone(tmp_path_factory):
    """6 frames of which the head is known; all are test."""
    folder = tmp_path_factory.mktemp("head")
    layout = write_recording(folder, 6, known=["head"])
    return Corpus.open(import_recording(folder, folder / "corpus", layout, splits="test=1"))


@pytest.fixture(scope="module")
def mixed(toy_corpus, recorded, tmp_path_factory):
    """A model of both."""
    out = tmp_path_factory.mktemp("mixed") / "model"
    assert train((toy_corpus, recorded), out) == 0
    return out


def train(corpora, out, *more):
    return main(["train", "oarf", *(str(one.path) for one in corpora), "--out", str(out), *OARF, *more])


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    return err


@dataclass(frozen=True)
class Listed:
    """Frames in a list, the obvious twin of joined ones."""

    frames: list[DepthFrame]
    labels = LABELS

    def __len__(self):
        return len(self.frames)

    def __getitem__(self, place):
        return self.frames[place]


def listed(corpora, split, n, sensors=(None, None)):
    numbers = [one.split(split) for one in corpora]
    chosen = [own if len(own) <= n else own[np.arange(n) * len(own) // n] for own in numbers]
    parts = map(CorpusFrames, corpora, chosen, sensors)
    return Listed([part[k] for part in parts for k in range(len(part))])


def same(a, b):
    names = ("depth", "label", "body_depth", "body_label", "joints", "is_occluded")
    return all(np.array_equal(getattr(a, name), getattr(b, name), equal_nan=name == "joints") for name in names)


def learned_the_same(path, frames, validation):
    """Whether a model holds what training with its config on these frames gives."""
    twin = pack_model(train_oarf(frames, load_model(path).config, validation=validation))
    arrays = read_model(path).arrays
    return arrays.keys() == twin.keys() and all(
        np.array_equal(arrays[name], values, equal_nan=True) for name, values in twin.items()
    )


def test_joined_frames_are_the_corpora_one_after_the_other(toy_corpus, recorded):
    first, last = CorpusFrames(toy_corpus, np.array([7, 3])), CorpusFrames(recorded, np.array([0, 5, 9]))
    nothing = CorpusFrames(toy_corpus, np.empty(0, np.int64))
    joined = JoinedFrames((nothing, first, nothing, last, nothing))
    assert len(joined) == 5
    alone = [first[0], first[1], last[0], last[1], last[2]]
    assert all(same(joined[k], frame) for k, frame in enumerate(alone))
    assert [joined[k].depth.shape for k in (1, 2)] == [(48, 64), (120, 160)]
    assert [joined[k].camera.fx for k in (1, 2)] == [60.0, 142.0]
    for place in (-1, 5):
        with pytest.raises(IndexError, match=f"frame {place} is not in 0..4"):
            joined[place]


def test_several_corpora_train_what_a_list_of_their_frames_does(mixed, toy_corpus, recorded):
    corpora, sensors = (toy_corpus, recorded), ("random", None)
    assert learned_the_same(mixed, *(listed(corpora, split, 12, sensors) for split in ("train", "val")))


def test_the_model_names_its_corpora_in_order_and_counts_frames_of_each(mixed, toy_corpus, recorded):
    metadata = read_model(mixed).metadata
    assert metadata["corpus"] == [toy_corpus.digest, recorded.digest]
    assert metadata["n_frames"] == {"train": 12 + 12, "val": 12 + 6}


def test_a_joint_that_one_corpus_tells_is_learned_from_it(mixed, recorded, tmp_path, capsys):
    torso = JOINT_NAMES.index("torso")
    assert all((tree.leaves.unpacked().weight[:, :, torso] > 0).any() for tree in load_model(mixed).trees)
    alone = tmp_path / "alone"
    assert train((recorded,), alone) == 0
    assert not any((tree.leaves.unpacked().weight[:, :, torso] > 0).any() for tree in load_model(alone).trees)
    assert "are not learned: torso" in capsys.readouterr().out


def test_training_goes_on_in_the_same_order_of_corpora_alone(
    mixed, toy_corpus, recorded, tmp_path, monkeypatch, capsys
):
    save = TreeFolder.save

    def save_and_stop(self, tree, grown):
        save(self, tree, grown)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(TreeFolder, "save", save_and_stop)
        assert train((toy_corpus, recorded), tmp_path / "m") == 130
    capsys.readouterr()
    for others in ((recorded, toy_corpus), (toy_corpus,)):
        assert train(others, tmp_path / "m") == 1
        assert "holds trees trained with other settings: corpus is [" in error_line(capsys)
    assert train((toy_corpus, recorded), tmp_path / "m", "--threads", "2") == 0
    assert "continuing after 1 finished trees" in capsys.readouterr().out
    assert (tmp_path / "m").read_bytes() == mixed.read_bytes()


def test_random_walk_forests_learn_from_both(toy_corpus, recorded, tmp_path, capsys):
    words = ["train", "rwf", str(recorded.path), str(toy_corpus.path), "--n-points", "20", *SMALL]
    assert main([*words, "--out", str(tmp_path / "m")]) == 0
    assert "are not learned" not in capsys.readouterr().out
    metadata = read_model(tmp_path / "m").metadata
    assert metadata["corpus"] == [recorded.digest, toy_corpus.digest]
    assert metadata["scores"] is not None


def test_the_sensor_measures_generated_frames_alone(toy_corpus, recorded, tmp_path, capsys):
    assert sensors_of((recorded, toy_corpus), "kinect_v1") == (None, "kinect_v1")
    assert sensors_of((recorded, toy_corpus), None) == (None, None)
    assert sensors_of((recorded,), "ideal") == ("ideal",)
    assert sensors_of((recorded,), "random") == (None,)
    assert sensors_of((recorded, toy_corpus), "random") == (None, "random")
    assert train((toy_corpus, recorded), tmp_path / "m", "--sensor", "kinect_v1") == 0
    told = capsys.readouterr().out
    assert f"the noise of kinect_v1 is not added to the recorded frames of {recorded.path}" in told
    assert read_model(tmp_path / "m").metadata["sensor"] == "kinect_v1"
    corpora, sensors = (toy_corpus, recorded), ("kinect_v1", None)
    assert learned_the_same(tmp_path / "m", *(listed(corpora, split, 12, sensors) for split in ("train", "val")))
    assert not learned_the_same(tmp_path / "m", *(listed(corpora, split, 12) for split in ("train", "val")))


@pytest.mark.parametrize("command", ["train", "evaluate", "predict", "inspect", "export"])
def test_a_second_sensor_on_recorded_frames_is_one_line(command, mixed, recorded, tmp_path, capsys):
    path, model, out = str(recorded.path), str(mixed), tmp_path / "out"
    words = {
        "train": ["train", "oarf", path, "--out", str(out)],
        "evaluate": ["evaluate", model, path],
        "predict": ["predict", model, "--corpus", path, "--frame", "0", "1", "--out", str(tmp_path)],
        "inspect": ["inspect", path, "--out", str(out)],
        "export": ["export", path, "--to", "coco", "--out", str(out)],
    }[command]
    assert main([*words, "--sensor", "kinect_v1"]) == 1
    assert f"sensor='kinect_v1' cannot be applied: {path} holds recorded frames" in error_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_an_ideal_sensor_leaves_recorded_frames_as_they_are(recorded):
    assert (recorded.arrays("depth", sensor="ideal") == recorded.arrays("depth")).all()
    with pytest.raises(CorpusError, match="sensor 'radar' is unknown"):
        recorded.check_sensor("radar")


def test_a_corpus_is_named_once(toy_corpus, recorded, tmp_path, capsys):
    assert train((toy_corpus, recorded, toy_corpus), tmp_path / "m") == 1
    assert f"{toy_corpus.path} and {toy_corpus.path} are the same corpus; give it only once" in error_line(capsys)
    (tmp_path / "link").symlink_to(toy_corpus.path)
    with pytest.raises(CorpusError, match="are the same corpus"):
        open_corpora((toy_corpus.path, tmp_path / "link"))


def test_every_corpus_must_have_something_to_learn(toy_corpus, head_alone, tmp_path, capsys):
    assert train((toy_corpus, head_alone), tmp_path / "m") == 1
    assert f"{head_alone.path} has no frames of the split train" in error_line(capsys)
    folder = tmp_path / "bare"
    folder.mkdir()
    bare = import_recording(folder, folder / "corpus", write_recording(folder, 4, known=[]), splits="train=1")
    assert train((toy_corpus, Corpus.open(bare)), tmp_path / "m") == 1
    assert f"{bare} cannot be used for training: no joint is known in its training frames" in error_line(capsys)


def test_no_corpus_ends_with_code_2(tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        train((), tmp_path / "m")
    assert caught.value.code == 2
    assert "corpora" in capsys.readouterr().err
