# SPDX-License-Identifier: BSD-3-Clause
"""Distance of samples from the training samples."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

Array = NDArray[np.float64]

#: Number of training samples that represent all.
REFERENCES = 500
#: Share of held-out samples of the training log that count as inside.
INSIDE = 0.99
#: Number of rows compared with the references at once.
CHUNK = 4096


def references(features: Array, scale: Array) -> Array:
    """Evenly spaced rows of the training features, scaled."""
    rows = np.unique(np.linspace(0, len(features) - 1, REFERENCES).astype(int))
    scaled: Array = features[rows] / scale
    return scaled


def distances(features: Array, scale: Array, reference: Array) -> Array:
    """Distance to the nearest reference, in standard deviations per feature, root mean square."""
    scaled = features / scale
    parts = [
        cdist(scaled[i : i + CHUNK], reference).min(axis=1) for i in range(0, len(scaled), CHUNK)
    ]
    nearest: Array = np.concatenate(parts) / np.sqrt(features.shape[1])
    return nearest


class TrainingRange:
    """Region around the training samples, beyond which a learned part fades out.

    ``scale`` is the standard deviation of the features, ``reference`` are samples divided by it.
    Held-out training samples lie within ``radius``; ``held_out_novelty`` is their distance in
    radii.
    """

    def __init__(self, features: Array, folds: list[Any]) -> None:
        spread = features.std(axis=0)
        self.scale = np.where(spread > 0, spread, 1.0)
        self.reference = references(features, self.scale)
        distance = np.zeros(len(features))
        for train, test in folds:
            near = references(features[train], self.scale)
            distance[test] = distances(features[test], self.scale, near)
        self.radius = max(float(np.quantile(distance, INSIDE)), 1e-6)
        self.held_out_novelty = distance / self.radius

    def novelty(self, features: Array) -> Array:
        """Distance from the training samples in radii: above 1 is outside."""
        return distances(features, self.scale, self.reference) / self.radius


def fade(novelty: Array) -> Array:
    """Share of the learned part that is kept: all inside, nothing beyond two radii."""
    return np.clip(2.0 - novelty, 0.0, 1.0)
