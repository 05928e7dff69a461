"""A forest that workers of a Dask scheduler help to train has the bytes of one trained without, whatever happens."""

import dataclasses
import os
import signal

import pytest

from forests.growing import GrowthConfig
from forests.growing import grow as growing
from forests.oarf.config import OARFConfig
from forests.oarf.storage import save_model as save_oarf
from forests.oarf.train import train as train_oarf
from forests.rwf.config import RWFConfig
from forests.rwf.storage import save_model as save_rwf
from forests.rwf.train import train as train_rwf
from pipelines.cli import main
from pipelines.cluster import crew as crews
from pipelines.cluster import gathering
from pipelines.cluster.crew import ClusterCrew
from pipelines.corpus.joined import FrameChoice
from pipelines.errors import UserError

pytestmark = pytest.mark.filterwarnings("ignore")  # of Dask itself

GROWTH = GrowthConfig(max_depth=8, n_candidates=60, n_finalists=10, min_samples_leaf=4)
OARF = OARFConfig(n_trees=2, n_pixels=60, n_occluder_pixels=30, n_voting_pixels=40, growth=GROWTH)
RWF = RWFConfig(n_trees=1, n_points=15, joints=("neck", "head"), growth=GROWTH)


@pytest.fixture(autouse=True)
def many_pieces(monkeypatch):
    """Small tasks, so that there are many; the workers keep the sizes that they know."""
    monkeypatch.setattr(growing, "SUBTREE_SAMPLES", 400)


@pytest.fixture
def choice(toy_corpus):
    return FrameChoice((toy_corpus.path,), "train")


def trained(tmp_path, name, train, save, choice, config, **settings):
    """Bytes of a model."""
    validation = dataclasses.replace(choice, split="val").frames()
    model = train(choice.frames(), config, validation=validation, **settings)
    save(tmp_path / name, model, {})
    return (tmp_path / name).read_bytes()


@pytest.mark.parametrize("learns_skeleton", [False, True])
def test_a_regression_forest_is_the_same(cluster, choice, tmp_path, learns_skeleton):
    config = dataclasses.replace(OARF, learn_skeleton=learns_skeleton)
    alone = trained(tmp_path, "alone", train_oarf, save_oarf, choice, config)
    with ClusterCrew(cluster, tmp_path / "work", choice) as crew:
        assert trained(tmp_path, "crew", train_oarf, save_oarf, choice, config, crew=crew) == alone
        assert (tmp_path / "work").is_dir()
    assert not (tmp_path / "work").exists()


def test_a_random_walk_forest_is_the_same(cluster, choice, tmp_path):
    config = dataclasses.replace(RWF, learn_skeleton=False)
    alone = trained(tmp_path, "alone", train_rwf, save_rwf, choice, config)
    with ClusterCrew(cluster, tmp_path / "work", choice) as crew:
        assert trained(tmp_path, "crew", train_rwf, save_rwf, choice, config, crew=crew) == alone


def test_a_worker_may_be_killed(cluster, choice, tmp_path):
    config = dataclasses.replace(OARF, learn_skeleton=False)
    alone = trained(tmp_path, "alone", train_oarf, save_oarf, choice, config)
    left = list(cluster._client.run(os.getpid).values())[:1]

    def kill_one(share):
        if share > 0.3 and left:
            os.kill(left.pop(), signal.SIGKILL)

    with ClusterCrew(cluster, tmp_path / "work", choice) as crew:
        settings = {"crew": crew, "on_progress": kill_one}
        assert trained(tmp_path, "crew", train_oarf, save_oarf, choice, config, **settings) == alone
    assert not left
    cluster._client.wait_for_workers(2, timeout=30)


def test_workers_that_read_other_frames_are_refused(cluster, choice, tmp_path, monkeypatch):
    monkeypatch.setattr(crews, "digest_of_frame", lambda frames: "other")
    with (
        ClusterCrew(cluster, tmp_path / "work", choice) as crew,
        pytest.raises(UserError, match=r"the worker tcp://\S+ reads other frames"),
    ):
        crew.gather("composite", 10, 10, 0, lambda n: None)


def test_workers_that_grow_other_trees_are_refused(cluster, choice, tmp_path, monkeypatch):
    training = gathering.gather_some(choice.frames(), "composite", 10, 10, 0, 0)
    crew = ClusterCrew(cluster, tmp_path / "work", choice)
    crew._likeness = dataclasses.replace(crews.likeness_of_growing(), frames="other")
    with crew, crew.sharing(training.samples) as call, pytest.raises(UserError, match="gives other bytes"):
        call(len)


def test_pieces_make_the_whole(choice, tmp_path, monkeypatch):
    monkeypatch.setattr(gathering, "PIECE_FRAMES", 33)
    frames = choice.frames()
    digest = gathering.digest_of_frame(frames)
    job = gathering.GatherJob(tmp_path, choice, len(frames), digest, "composite", 20, 10, 5)
    for number in reversed(range(job.n_pieces)):
        gathering.gather_piece(job, number)
    whole = gathering.gather_some(frames, "composite", 20, 10, 5, 0)
    joined = gathering.joined_pieces(job)
    for record, other in zip(joined[:2], whole[:2], strict=True):
        for a, b in zip(record, other, strict=True):
            assert a.dtype == b.dtype
            assert (a == b).all()
    assert (joined.joints == whole.joints).all()


def test_nets_are_not_trained_on_clusters(toy_corpus, tmp_path, capsys):
    words = ["train", "heatmap", str(toy_corpus.path), "--out", str(tmp_path / "m"), "--scheduler", "local:1"]
    assert main(words) == 1
    assert "nets are trained on one machine" in capsys.readouterr().err
