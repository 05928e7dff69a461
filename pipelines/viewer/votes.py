"""The votes of a model for a joint of somebody in a moment."""

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.estimate import JointPredictor, JointVotes, VoteTeller
from forests.finder.cutting import cut_axis
from forests.finder.floor import Floor
from pipelines.errors import UserError
from pipelines.online.detecting import floor_of_pose
from pipelines.online.given import placed
from pipelines.online.messages import TrackedPersons
from pipelines.viewer.moments import Moment


class VoteView:
    """Asks a model why it believes what it believes.

    Attributes:
        joints: Names of the joints that it answers.
        is_cut_out: Whether images show one person and nothing else of a room, so that nobody is cut out.
    """

    def __init__(self, predictor: JointPredictor, is_cut_out: bool) -> None:
        """Takes a model.

        Raises:
            UserError: It does not tell votes.
        """
        if not isinstance(predictor, VoteTeller):
            raise UserError(f"a {type(predictor).__name__} casts no votes; forests do")
        self._predictor, self._needs_box = predictor, bool(predictor.box_joints)
        self.joints = predictor.joints
        self.is_cut_out = is_cut_out

    def votes(self, moment: Moment, track_id: int, joint: str) -> JointVotes | None:
        """The votes for a joint of somebody, camera frame; None if the image shows nothing of them.

        Args:
            moment: When.
            track_id: Whose.
            joint: Its name.
        """
        if moment.depth is None:
            return None
        asked = (moment.depth, None) if self.is_cut_out else self._person(moment, track_id)
        if asked is None or not asked[0].any():
            return None
        depth, box = asked
        return self._predictor.joint_votes(
            self.joints.index(joint), depth, moment.camera, box if self._needs_box else None
        )

    @staticmethod
    def _person(moment: Moment, track_id: int) -> tuple[NDArray[np.uint16], Box | None] | None:
        """Somebody cut out of the image, as modules see them, and the box around head and shoulders."""
        frame = moment.frame
        assert frame is not None
        told = placed(TrackedPersons(0, "", moment.persons), frame, moment.T_floor_camera)
        seen = [one for one in told.persons if one.detection is not None]
        own = [k for k, one in enumerate(seen) if one.track_id == track_id]
        if not own:
            return None
        axes = np.array([one.detection.axis for one in seen if one.detection is not None])
        found = seen[own[0]].detection
        assert found is not None
        floor: Floor | None = floor_of_pose(moment.T_floor_camera) if moment.T_floor_camera[2, 3] > 0 else None
        return cut_axis(frame.depth, frame.camera, axes, own[0], floor), found.upper_body
