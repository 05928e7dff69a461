"""What is learned about skeletons as arrays of a model file, beside those of any kind of forest."""

from collections.abc import Mapping

import numpy as np

from forests.modelfile import take_array
from forests.skeleton.features import n_features, trunk_of
from forests.skeleton.kinematics import mirrored_joints, parents_first, parents_of
from forests.skeleton.model import OUTCOMES, PERSON_TERMS, TERMS, Rules, SkeletonModel
from forests.skeleton.network import Network
from forests.skeleton.prior import BodyPrior
from forests.skeleton.proposal import n_outputs
from storage.digested import Contents

_PREFIX = "skeleton."
_MOST_SIZES = 64


def pack_skeleton(model: SkeletonModel | None) -> dict[str, np.ndarray]:
    """Arrays of a model file; none of none."""
    if model is None:
        return {}
    prior = {name: getattr(model.prior, name) for name in ("log_length", "deviation", "log_size", "length_m")}
    arrays = prior | {f"network.{name}": values for name, values in model.network._asdict().items()}
    arrays |= {
        "person_weights": model.person_weights,
        "weights": model.weights,
        "rules": np.array(model.rules, np.float32),
    }
    return {_PREFIX + name: values for name, values in arrays.items()}


def unpack_skeleton(arrays: Mapping[str, np.ndarray], joints: tuple[str, ...]) -> SkeletonModel | None:
    """Undoes `pack_skeleton`, checked so that no kernel can read beyond an array; None where there is none.

    Args:
        arrays: Of the model file.
        joints: Names of the joints that the forest answers.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    if not any(name.startswith(_PREFIX) for name in arrays):
        return None
    n = len(joints)

    def take(name: str, *shape: int | None) -> np.ndarray:
        return take_array(arrays, _PREFIX + name, np.float32, shape)

    parent = parents_of(joints)
    prior = BodyPrior(
        parent,
        parents_first(parent),
        mirrored_joints(joints),
        take("log_length", n),
        take("deviation", n),
        take("log_size", None),
        take("length_m", n, 2),
    )
    if not (1 <= len(prior.log_size) <= _MOST_SIZES and np.isfinite(prior.log_size).all()):
        raise ValueError(f"the sizes of people must be 1..{_MOST_SIZES} finite numbers")
    if not (np.isfinite(prior.log_length).all() and (prior.deviation > 0).all()):
        raise ValueError("the lengths of limbs must be finite, their deviations above 0")
    if not ((prior.length_m[:, 0] >= 0) & (prior.length_m[:, 0] <= prior.length_m[:, 1])).all():
        raise ValueError("a limb's length ends before it begins")
    weights = take("weights", len(OUTCOMES), n, len(TERMS))
    if np.isinf(weights).any():
        raise ValueError("the weights of a joint's probability are not finite")
    person_weights = take("person_weights", len(PERSON_TERMS))
    if np.isinf(person_weights).any():
        raise ValueError("the weights of a person's probability are not finite")
    rules = take("rules", len(Rules._fields))
    if not (np.isfinite(rules).all() and rules[-1] > 0):
        raise ValueError("the rules for choosing candidates must be finite, their reach above 0 m")
    return SkeletonModel(
        prior,
        trunk_of(joints),
        _network(take, n),
        Rules(*(float(value) for value in rules)),
        weights,
        person_weights,
    )


def without_skeleton(contents: Contents) -> Contents:
    """A model file's contents without what is learned about skeletons: the forest answers joint by joint."""
    kept = {name: values for name, values in contents.arrays.items() if not name.startswith(_PREFIX)}
    return contents._replace(arrays=kept)


def _network(take, n_joints: int) -> Network:  # type: ignore[no-untyped-def]
    n_hidden = len(take("network.b1", None))
    n_in, n_out = (n_features(n_joints), n_outputs(n_joints)) if n_hidden else (0, 0)
    shapes = ((n_in, n_hidden), (n_hidden,), (n_hidden, n_hidden), (n_hidden,), (n_hidden, n_out), (n_out,))
    named = zip(Network._fields, shapes, strict=True)
    network = Network(*(take(f"network.{name}", *shape) for name, shape in named))
    if not all(np.isfinite(values).all() for values in network):
        raise ValueError("the network's weights are not finite")
    return network
