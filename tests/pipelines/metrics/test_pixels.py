"""Confusion matrices of pixels by hand and against scikit-learn."""

import numpy as np
import pytest
from sklearn.metrics import balanced_accuracy_score, confusion_matrix

from pipelines.metrics import (
    Confusion,
    count_pixels,
)


class TestPixels:
    names = ("head", "arm", "table", "laptop")

    def confusion(self, label, given, classes):
        counts = count_pixels(np.array(label, np.uint8), np.array(given, np.uint8), 4, len(classes))
        return Confusion(counts, self.names, classes, 2)

    def test_by_hand(self):
        label = [[1, 1, 2, 3, 3, 4, 0, 2]]
        given = [[1, 2, 2, 3, 1, 3, 1, 0]]
        found = self.confusion(label, given, self.names)
        assert found.counts.sum() == 6
        assert found.part_accuracy == 0.75
        assert found.occluder_accuracy == 0.25
        assert found.class_accuracy == 0.5
        assert found.object_recall == pytest.approx(2 / 3)
        assert found.body_recall == 1.0

    def test_one_class_of_occluders_is_right_for_all(self):
        found = self.confusion([[1, 2, 3, 4]], [[1, 2, 3, 3]], ("head", "arm", "occluder"))
        assert found.occluder_accuracy == found.object_recall == found.class_accuracy == 1.0

    def test_without_occluder_classes_objects_are_wrong(self):
        found = self.confusion([[1, 2, 3, 4]], [[1, 2, 1, 2]], ("head", "arm"))
        assert np.isnan(found.occluder_accuracy)
        assert (found.object_recall, found.part_accuracy, found.class_accuracy) == (0.0, 1.0, 0.5)

    def test_equals_scikit_learn(self):
        rng = np.random.default_rng(0)
        label, given = rng.integers(1, 5, (2, 30, 40))
        found = self.confusion(label, given, self.names)
        np.testing.assert_array_equal(found.counts, confusion_matrix(label.ravel(), given.ravel()))
        assert found.class_accuracy == pytest.approx(balanced_accuracy_score(label.ravel(), given.ravel()))

    def test_nothing_to_label_has_no_accuracy(self):
        found = self.confusion([[0, 0]], [[0, 0]], self.names)
        assert np.isnan([found.part_accuracy, found.class_accuracy, found.object_recall]).all()

    def test_a_class_that_is_not_there_is_refused(self):
        with pytest.raises(ValueError, match="class 4"):
            self.confusion([[1]], [[5]], self.names)
