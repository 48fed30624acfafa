"""How good detections are against truth: average precision, curves, confusion."""

from laserimg.evaluate.confusion import Confusion, confusion
from laserimg.evaluate.curves import Counts, Curve
from laserimg.evaluate.scores import BANDS_M, IOUS, Evaluation, evaluate

__all__ = ["BANDS_M", "IOUS", "Confusion", "Counts", "Curve", "Evaluation", "confusion", "evaluate"]
