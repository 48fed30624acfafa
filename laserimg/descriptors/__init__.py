"""Descriptors of objects for a linear classifier: HOG, HONV and 3DHOG of paper 1.

They are plain functions over stacks of images; `laserimg.descriptors.transformers` has them as
scikit-learn transformers.
"""

from laserimg.descriptors.hog import hog
from laserimg.descriptors.hog3d import hog3d
from laserimg.descriptors.honv import honv
from laserimg.descriptors.layout import Layout
from laserimg.descriptors.normal_images import gradient_normals, surface_normals

__all__ = ["Layout", "gradient_normals", "hog", "hog3d", "honv", "surface_normals"]
