"""The page: a time line over moments, what is shown of them, and whose votes for which joint."""

import threading
import time
from collections import Counter, defaultdict
from typing import Any

from forests.estimate import JointVotes
from pipelines.errors import UserError
from pipelines.online.messages import OrientationResult, Plan, TrackSkeleton
from pipelines.viewer import drawing
from pipelines.viewer.moments import Moment, Show
from pipelines.viewer.votes import VoteView

NOBODY = "nobody"
"""Chosen where there is no person."""
IDLE_S = 0.02
"""The page looks so often whether something has changed [s]."""


class Page:
    """Shows moments in a browser.

    Attributes:
        address: Where a browser finds it.
        time: The time line: its value is the number of the moment.
        is_playing: Its check box.
        colours: What the colours of the cloud tell.
        joint: Whose votes are shown, if a model is asked.
        person: Likewise.
    """

    def __init__(self, show: Show, port: int = 8080, votes: VoteView | None = None) -> None:
        """Serves the page on this machine alone; `run` or `start` keeps it up to date.

        Args:
            show: What is shown.
            port: Of this machine; 0 = any.
            votes: A model that is asked about joints.

        Raises:
            UserError: viser is not installed.
        """
        try:
            import viser
        except ImportError:
            raise UserError(
                "the viewer needs viser, which is not installed; install it with: pip install 'undergrowth[viewer]'"
            ) from None
        self._show, self._votes = show, votes
        self._server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
        self.address = f"http://127.0.0.1:{self._server.get_port()}"
        self._is_stale, self._is_open = True, True
        self._thread: threading.Thread | None = None
        self._is_aimed = False
        self._server.gui.configure_theme(dark_mode=True, show_logo=False)
        self._server.scene.set_up_direction("+z")
        self._server.scene.add_grid("/floor", width=16.0, height=16.0, plane="xy")
        self._build(self._server.gui)

    def _build(self, gui: Any) -> None:
        with gui.add_folder("time"):
            self.time = gui.add_slider("moment", min=0, max=max(len(self._show) - 1, 1), step=1, initial_value=0)
            self.is_playing = gui.add_checkbox("play", False)
            self._words = gui.add_markdown("nothing yet")
        with gui.add_folder("show"):
            self.colours = gui.add_dropdown("colours", (drawing.DEPTH,))
            self._is_shown = {
                name: gui.add_checkbox(name, True)
                for name in ("cloud", "people", "skeletons", "headings", "floor")
            }
        widgets = [self.time, self.colours, *self._is_shown.values()]
        if self._votes is not None:
            with gui.add_folder("votes"):
                self.joint = gui.add_dropdown("joint", ("none", *self._votes.joints))
                self.person = gui.add_dropdown("person", (NOBODY,))
                self._counted = gui.add_markdown("")
            widgets += [self.joint, self.person]
        with gui.add_folder("planner"):
            self._planned = gui.add_markdown("no planner")
        for widget in widgets:
            widget.on_update(self._touch)

    def _touch(self, _: object = None) -> None:
        self._is_stale = True

    def run(self) -> None:
        """Keeps the page up to date until `close`, or until it is interrupted."""
        begun, first = time.monotonic(), int(self.time.value)
        n_known = len(self._show)
        while self._is_open:
            n = len(self._show)
            if n != n_known:
                self._grow(n_known, n)
                n_known = n
            if self.is_playing.value and n:
                number = (first + int((time.monotonic() - begun) * self._show.fps)) % n
                if number != self.time.value:
                    self.time.value = number
            else:
                begun, first = time.monotonic(), int(self.time.value)
            if self._is_stale and n:
                self.draw()
            time.sleep(IDLE_S)

    def start(self) -> None:
        """Does the same beside whatever else goes on."""
        self._thread = threading.Thread(target=self.run, name="undergrowth page", daemon=True)
        self._thread.start()

    def take(self, message: object) -> None:
        """Hears from a system that runs that the last moment may have changed."""
        if isinstance(message, Plan | TrackSkeleton | OrientationResult):
            self._is_stale = True

    def close(self) -> None:
        """Serves no more, and closes what was shown."""
        self._is_open = False
        if self._thread is not None:
            self._thread.join(5.0)
        self._server.stop()
        self._show.close()

    def _grow(self, n_before: int, n: int) -> None:
        """Lengthens the time line; who was at its end stays there."""
        is_at_end = self.time.value >= n_before - 1
        self.time.max = max(n - 1, 1)
        if is_at_end:
            self.time.value = n - 1
        self._is_stale = True

    def draw(self) -> None:
        """Shows the moment that the time line is at."""
        self._is_stale = False
        number = min(int(self.time.value), len(self._show) - 1)
        try:
            moment = self._show.moment(number)
        except UserError as error:
            self._words.content = f"moment {number} cannot be shown: {error}"
            return
        with self._server.atomic():
            self._offer(moment)
            self._draw_scene(moment)
            self._words.content = moment.words
            self._planned.content = plan_words(moment.plan)
            self._draw_votes(moment)

    def _offer(self, moment: Moment) -> None:
        """Brings what can be chosen up to date."""
        colours = (drawing.DEPTH, *moment.labels)
        if tuple(self.colours.options) != colours:
            self.colours.options = colours
        if self._votes is not None:
            people = tuple(str(one.track_id) for one in moment.persons) or (NOBODY,)
            if tuple(self.person.options) != people:
                chosen = self.person.value
                self.person.options = people
                self.person.value = chosen if chosen in people else people[0]
        if not self._is_aimed:
            self._aim(moment)

    def _aim(self, moment: Moment) -> None:
        """Looks at the first moment from above the camera."""
        T = moment.T_floor_camera
        eye, ahead = T[:3, 3], T[:3, 2]
        level = ahead * (1.0, 1.0, 0.0)
        self._server.initial_camera.position = tuple((eye - 0.8 * level + (0.0, 0.0, 0.5)).tolist())
        self._server.initial_camera.look_at = tuple((eye + 3.0 * level - (0.0, 0.0, 0.4)).tolist())
        self._is_aimed = True

    def _draw_scene(self, moment: Moment) -> None:
        scene, is_shown = self._server.scene, {name: box.value for name, box in self._is_shown.items()}
        if is_shown["cloud"]:
            drawing.draw_cloud(scene, moment, moment.labels.get(self.colours.value))
        else:
            drawing.hide(scene, "/cloud")
        drawing.draw_people(scene, moment.persons if is_shown["people"] else (), choices(moment.plan))
        drawing.draw_skeletons(scene, moment.skeletons if is_shown["skeletons"] else ())
        drawing.draw_arrows(scene, moment.persons, moment.arrows if is_shown["headings"] else ())
        self._server.scene.add_grid("/floor", width=16.0, height=16.0, plane="xy", visible=is_shown["floor"])

    def _draw_votes(self, moment: Moment) -> None:
        if self._votes is None:
            return
        found: JointVotes | None = None
        if self.joint.value != "none" and self.person.value != NOBODY:
            found = self._votes.votes(moment, int(self.person.value), self.joint.value)
        drawing.draw_votes(self._server.scene, found, moment.T_floor_camera)
        shares = "" if found is None else ", ".join(f"{share:.2g}" for share in found.share)
        self._counted.content = "" if found is None else f"{len(found.points)} votes; modes: {shares}"


def choices(plan: Plan | None) -> dict[int, str]:
    """What stands beside a person's number: what was asked about them, or why nothing was."""
    if plan is None:
        return {}
    asked: dict[int, list[str]] = defaultdict(list)
    for one in plan.requests:
        asked[one.track_id].append(one.module)
    said = {skip.track_id: skip.reason for skip in plan.skips}
    return said | {track_id: "asked: " + ", ".join(modules) for track_id, modules in asked.items()}


def plan_words(plan: Plan | None) -> str:
    """A plan in words."""
    if plan is None:
        return "no planner"
    asked = ", ".join(f"{one.module} {one.track_id}" for one in plan.requests) or "nobody"
    reasons = Counter(skip.reason for skip in plan.skips)
    skipped = "".join(f"\n- {n} skipped: {reason}" for reason, n in reasons.most_common())
    spent = f"{plan.spent_s * 1e3:.1f} of {plan.budget_s * 1e3:.1f} ms"
    return f"asked about: {asked} ({spent})\n{skipped}"
