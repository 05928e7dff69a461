"""Messages reach those who asked for their class, whatever others do."""

from pipelines.online.bus import Bus
from pipelines.online.messages import Notice, Skip
from pipelines.online.notices import Notices


def test_messages_reach_those_who_asked_in_order():
    bus, got = Bus(), []
    bus.subscribe(Skip, lambda message: got.append(("first", message)))
    bus.subscribe(object, lambda message: got.append(("all", message)))
    bus.subscribe(Notice, lambda message: got.append(("notice", message)))
    skip = Skip(0, 1, "walks", "far")
    bus.publish(skip)
    assert got == [("first", skip), ("all", skip)]


def test_a_listener_that_raises_is_told_and_the_others_still_hear():
    bus, heard, notices = Bus(), [], []

    def broken(message):
        raise RuntimeError("no disk")

    bus.subscribe(Skip, broken)
    bus.subscribe(Skip, heard.append)
    bus.subscribe(Notice, notices.append)
    bus.publish(Skip(0, 1, "walks", "far"))
    assert len(heard) == 1
    assert "no disk" in notices[0].sentence


def test_each_cause_is_told_once_and_counted(caplog):
    notices = Notices()
    for _ in range(3):
        notices.take(Notice("time", "time ran backwards"))
    notices.take(Notice("box", "a box was empty"))
    assert [record.getMessage() for record in caplog.records] == [
        "warning: time ran backwards",
        "warning: a box was empty",
    ]
    assert notices.summary() == ["time: 3 times in all"]
