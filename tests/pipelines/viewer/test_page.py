"""The page has a time line, says what the planner chose, and asks a forest for votes."""

import numpy as np
import pytest

pytest.importorskip("viser", reason="viser is not installed")

from forests.estimate import JointVotes
from pipelines.errors import UserError
from pipelines.online.messages import NS
from pipelines.viewer.moments import LiveShow
from pipelines.viewer.page import Page, choices, plan_words
from pipelines.viewer.votes import VoteView
from tests.pipelines.online.test_system import frame_at, system_of
from tests.pipelines.online.walkers import detected, walk
from tests.pipelines.viewer.toy_show import CAMERA, JOINTS, ToyShow


class Teller:
    """Votes at (0, 0, 2) m whatever it is asked."""

    joints, box_joints = JOINTS, ()

    def predict(self, depth, camera, box=None):
        raise NotImplementedError

    def joint_votes(self, joint, depth, camera, box=None):
        self.asked = joint, int((depth > 0).sum()), box
        place = np.array([[0.0, 0.0, 2.0]], np.float32)
        one = np.ones(1, np.float32)
        return JointVotes(np.repeat(place, 8, axis=0), np.repeat(one, 8), np.zeros(8, bool), place, one)


@pytest.fixture
def page():
    shown = Page(ToyShow(), 0, VoteView(Teller(), is_cut_out=True))
    yield shown
    shown.close()
    assert shown._show.is_closed


def test_the_time_line_says_which_moment_is_shown(page):
    page.draw()
    assert page._words.content == "the toy at 0"
    page.time.value = 4
    page.draw()
    assert page._words.content == "the toy at 4"
    assert page.colours.options == ("depth", "left side")


def test_the_planner_is_quoted():
    plan = ToyShow().moment(0).plan
    assert plan_words(plan) == "asked about: walks 1 (2.0 of 20.0 ms)\n\n- 1 skipped: too far away for the module"
    assert choices(plan) == {1: "asked: walks", 3: "too far away for the module"}
    assert plan_words(None) == "no planner"


def test_votes_are_those_of_the_chosen_joint(page):
    page.draw()
    assert page._counted.content == ""
    assert page.person.options == ("1", "3")
    page.joint.value = "torso"
    page.draw()
    assert page._counted.content == "8 votes; modes: 1"
    assert page._votes._predictor.asked == (2, 96 * 128, None)


def test_a_model_without_votes_is_refused():
    class Silent:
        joints, box_joints = (), ()

    with pytest.raises(UserError, match="Silent casts no votes"):
        VoteView(Silent(), is_cut_out=True)


def test_a_person_of_a_room_is_cut_out_with_a_box_about_the_shoulders():
    teller = Teller()
    teller.box_joints = ("head",)
    moment = ToyShow().moment(2)
    moment.depth[:] = 2000  # person 1 stands there
    told = VoteView(teller, is_cut_out=False).votes(moment, 1, "head")
    assert len(told.points) == 8
    joint, n_pixels, (left, top, right, bottom) = teller.asked
    assert joint == 0
    assert 0 < n_pixels < moment.depth.size
    u = CAMERA.fx * -moment.persons[0].place[1] / 2.0 + CAMERA.cx
    assert left < u < right
    assert top < bottom < CAMERA.cy + 20
    assert VoteView(teller, is_cut_out=False).votes(moment, 9, "head") is None


def test_an_image_that_cannot_be_read_is_told_in_its_place(page):
    def broken(number):
        raise UserError("a chunk is damaged")

    page._show.moment = broken
    page.draw()
    assert page._words.content == "moment 0 cannot be shown: a chunk is damaged"


def test_a_live_show_keeps_the_last_moments_and_completes_the_newest():
    rng = np.random.default_rng(5)
    told = list(detected(walk(rng, n_people=2, n_frames=8), rng, missed=0.0, false=0.0))
    system, _ = system_of(told)
    show = LiveShow()
    system.bus.subscribe(object, show.take)
    for k in range(8):
        system.step(frame_at(k))
    assert len(show) == 8
    moment = show.moment(7)
    assert moment.words == f"{told[7].stamp / NS:.2f} s"
    assert {one.track_id for one in moment.persons} == {1, 2}
    assert {arrow.track_id for arrow in moment.arrows} == {1, 2}
    assert len(moment.plan.requests) == 2
    assert not show.moment(0).persons
    assert show.moment(99).words == moment.words


def test_who_is_at_the_end_of_a_live_time_line_stays_there(page):
    page.time.value = 4
    page._grow(5, 9)
    assert (page.time.max, page.time.value) == (8, 8)
    page.time.value = 3
    page._grow(9, 12)
    assert (page.time.max, page.time.value) == (11, 3)
