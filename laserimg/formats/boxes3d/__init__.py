"""Labels of scans as oriented boxes in metres: KITTI, SUSTech POINTS, Argoverse 2."""

from laserimg.formats.boxes3d.beside import labels_beside
from laserimg.formats.boxes3d.model import Box3D, CameraView, Labels3D

__all__ = ["Box3D", "CameraView", "Labels3D", "labels_beside"]
