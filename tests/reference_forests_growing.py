"""Slow twins of the growing kernels: one pixel, one feature and one threshold at a time, in plain numpy."""

import numpy as np
from scipy.stats import entropy

from forests.crops import NOTHING
from forests.features import FEATURE_LIMIT_MM, draw_feature
from forests.growing import DIRECTION_ONE
from forests.growing.bins import bin_threshold, inner_range, n_inner_bins


def read(depth, x, y, z_mm, focal, offset):
    """Depth of the pixel at an offset [m] from pixel (x, y) of an image; NOTHING where nothing is or outside."""
    per_metre = [np.float32(f) * np.float32(1000) / np.float32(z_mm) for f in focal]
    column = int(np.floor(np.float32(x + 0.5) + per_metre[0] * np.float32(offset[0])))
    row = int(np.floor(np.float32(y + 0.5) + per_metre[1] * np.float32(offset[1])))
    inside = 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1]
    return int(depth[row, column]) if inside and depth[row, column] else int(NOTHING)


def feature_value(depth, x, y, z_mm, focal, feature):
    """The cut difference of the two probes [mm]."""
    first, second = (read(depth, x, y, z_mm, focal, offset) for offset in (feature[:2], feature[2:]))
    return int(np.clip(first - second, -FEATURE_LIMIT_MM, FEATURE_LIMIT_MM))


def crop_images(crops):
    """Every crop as an image."""
    return [
        crops.pixels[start : start + width * height].reshape(height, width)
        for start, width, height in zip(crops.start, crops.width, crops.height, strict=True)
    ]


def feature_values(crops, samples, members, feature):
    """(n,) values of the members."""
    images = crop_images(crops)
    return np.array(
        [
            feature_value(
                images[samples.frame[s]], samples.x[s], samples.y[s], samples.z_mm[s],
                crops.intrinsics[samples.frame[s], :2], feature,
            )
            for s in members
        ],
        np.int32,
    )  # fmt: skip


def information_gain(classes, goes_right):
    """Equation 3, with scipy's entropy."""

    def weighted(part):
        return 0.0 if len(part) == 0 else len(part) / len(classes) * entropy(np.bincount(part))

    return entropy(np.bincount(classes)) - weighted(classes[goes_right]) - weighted(classes[~goes_right])


def deviation_fall(directions, goes_right):
    """Fall of the summed squared deviation from the mean, of unit vectors."""
    unit = directions / DIRECTION_ONE

    def deviation(part):
        return 0.0 if len(part) == 0 else float(((part - part.mean(axis=0)) ** 2).sum())

    return deviation(unit) - deviation(unit[goes_right]) - deviation(unit[~goes_right])


def best_split(crops, samples, gain_of, members, number, config, seed, tree):
    """(gain, feature, threshold) of the best of all candidates and thresholds."""
    best = (0.0, None, None)
    n_inner = n_inner_bins(len(members), config.n_thresholds)
    feature = np.empty(4, np.float32)
    for candidate in range(config.n_candidates):
        draw_feature(seed, tree, number, candidate, config.max_offset_m, feature)
        values = feature_values(crops, samples, members, feature)
        low, high = inner_range.py_func(values)
        for number_of_bin in range(n_inner + 1):
            threshold = bin_threshold(number_of_bin, low, high, n_inner)
            goes_right = values > threshold
            fewest = min(goes_right.sum(), (~goes_right).sum())
            if fewest < config.min_samples_leaf:
                continue
            gain = gain_of(goes_right)
            if gain > best[0] + 1e-6:
                best = (gain, feature.copy(), threshold)
    return best


def descend(crops, samples, nodes):
    """(n,) leaf of every sample, one decision at a time."""
    images = crop_images(crops)
    leaves = np.empty(len(samples.frame), np.int64)
    for s, frame in enumerate(samples.frame):
        number = 0
        while nodes["leaf"][number] < 0:
            node = nodes[number]
            focal = crops.intrinsics[frame, :2]
            feature = np.concatenate([node["u"], node["v"]])
            value = feature_value(images[frame], samples.x[s], samples.y[s], samples.z_mm[s], focal, feature)
            number = node["left"] + int(value > node["threshold"])
        leaves[s] = nodes["leaf"][number]
    return leaves


def hint_of(crops, samples, s, feature, hint):
    """What a node asks of a sample's hints: whether a probe hits a class, or a fact; 2000 and 0 for yes and no."""
    frame = samples.frame[s]
    if hint < 0:
        return int(crops.facts[frame][-hint - 1])
    start, width, height = crops.start[frame], crops.width[frame], crops.height[frame]
    classes = crops.classes[start : start + width * height].reshape(height, width)
    per_metre = [
        np.float32(f) * np.float32(1000) / np.float32(samples.z_mm[s]) for f in crops.intrinsics[frame, :2]
    ]
    column = int(np.floor(np.float32(samples.x[s] + 0.5) + per_metre[0] * np.float32(feature[0])))
    row = int(np.floor(np.float32(samples.y[s] + 0.5) + per_metre[1] * np.float32(feature[1])))
    inside = 0 <= row < height and 0 <= column < width
    return FEATURE_LIMIT_MM * int(inside and classes[row, column] == hint)


def descend_with_hints(crops, samples, nodes, hints):
    """(n,) leaf of every sample of a tree that asks for hints too, one decision at a time."""
    images = crop_images(crops)
    leaves = np.empty(len(samples.frame), np.int64)
    for s, frame in enumerate(samples.frame):
        number = 0
        while nodes["leaf"][number] < 0:
            node, focal = nodes[number], crops.intrinsics[frame, :2]
            feature = np.concatenate([node["u"], node["v"]])
            if hints[number]:
                value = hint_of(crops, samples, s, feature, int(hints[number]))
            else:
                value = feature_value(images[frame], samples.x[s], samples.y[s], samples.z_mm[s], focal, feature)
            number = node["left"] + int(value > node["threshold"])
        leaves[s] = nodes["leaf"][number]
    return leaves
