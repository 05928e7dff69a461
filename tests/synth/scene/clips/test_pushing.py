"""People of clips who push a stroller: it moves with them on the floor, their hands stay on its handle."""

import numpy as np
import pytest

from synth.bodies.motion.hold import hand_in
from synth.bodies.skeleton import LOWER, UPPER
from synth.scene import ClipSource, SceneConfig
from synth.scene.clips.config import ActWeights
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import CONTACT_NAMES

CONFIG = SceneConfig(
    camera="custom",
    intrinsics=(96, 80, 68.0, 68.0, 47.5, 39.5),
    clip=30,
    fps=15.0,
    room=RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.3),
    people=PeopleConfig(number=(1, 1)),
    splits=SplitShares(1.0, 0.0, 0.0),
    acts=ActWeights(0.0, 0.0, 0.0, 1.0),
)


@pytest.fixture(scope="module")
def source():
    return ClipSource(CONFIG, 6, 30)


@pytest.fixture(scope="module")
def actor(source):
    return source.clip("train", 0).stage.actors[0]


def test_the_hands_stay_on_the_handle(actor):
    sides = [side for side in "lr" if actor.motion.contacts[0, CONTACT_NAMES.index(f"{side}_hand")]]
    assert sides
    for side in sides:
        assert actor.motion.contacts[:, CONTACT_NAMES.index(f"{side}_hand")].all()
        T = [
            np.linalg.inv(item) @ hand_in(actor.subject.body, angles, root, side)
            for item, angles, root in zip(
                actor.T_items, actor.motion.angles, actor.motion.T_world_root, strict=True
            )
        ]
        places = np.array(T)[:, :3, 3]
        assert np.linalg.norm(places - places[0], axis=1).max() < 0.02


def test_the_stroller_rolls_on_the_floor_before_the_person(actor):
    assert np.allclose(actor.T_items[:, 2, 3], 0.0)
    assert np.allclose(actor.T_items[:, 2, :3], (0.0, 0.0, 1.0))
    way = np.hypot(*(actor.T_items[-1] - actor.T_items[0])[:2, 3])
    assert way > 0.3 or "turn" in actor.motion.activity
    low = actor.item.occluder.mesh.vertices[:, 2].min()
    assert abs(low) < 0.01
    ahead = np.einsum("nk,nk->n", actor.T_items[:, :2, 3] - actor.places(), actor.T_items[:, :2, 0])
    assert (ahead > 0.2).all()


def test_the_motion_is_within_limits(actor):
    assert ((actor.motion.angles >= LOWER - 1e-9) & (actor.motion.angles <= UPPER + 1e-9)).all()
    assert np.abs(np.diff(actor.motion.angles, axis=0)).max() < 0.35


def test_frames_show_the_stroller_where_it_is(source, actor):
    for step in (0, 29):
        frame = source.frame(step)
        (item,) = [
            item
            for item in frame.info.objects
            if item.class_name == "stroller" and item.spec_id == actor.item.spec_id
        ]
        assert np.allclose(item.T_world_object, actor.T_items[step * source.clip("train", 0).stage.stride])
        assert frame.info.people[0].seat == 0
        assert frame.people[0].motion.contacts[5:].any()
