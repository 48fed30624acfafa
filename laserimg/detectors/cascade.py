"""Haar and LBP cascades, run by OpenCV."""

from dataclasses import dataclass

import cv2
import numpy as np

from laserimg.detectors.window import Hits
from laserimg.evidence import Image
from laserimg.formats.card import Card


@dataclass(frozen=True, eq=False, slots=True)
class CascadeModel:
    """A cascade of OpenCV as a classifier of windows.

    The score is the sum of the last stage (`levelWeights` of `detectMultiScale3`).

    Parameters
    ----------
    name : str
    card : Card
    classifier : cv2.CascadeClassifier
        As `laserimg.cascade.xml.load_cascade` gives it.
    """

    name: str
    card: Card
    classifier: cv2.CascadeClassifier

    def hits(self, image: Image) -> Hits:
        """Return the windows of a gray image that pass every stage."""
        width, height = self.card.window
        if image.shape[0] < height or image.shape[1] < width:
            return Hits(np.empty((0, 2)), np.empty(0))
        boxes, _, weights = self.classifier.detectMultiScale3(
            image,
            scaleFactor=1.1,
            minNeighbors=0,
            minSize=self.card.window,
            maxSize=self.card.window,
            outputRejectLevels=True,
        )
        corners = np.asarray(boxes, np.float64).reshape(-1, 4)[:, :2]
        return Hits(corners, np.asarray(weights, np.float64).ravel())
