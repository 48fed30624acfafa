"""Which class is an object? HOG, HONV and 3DHOG with a linear support vector machine (paper 1)."""

from laserimg.classify.clouds import ObjectCloud
from laserimg.classify.model import ObjectModel, Verdict, load_model, save_model
from laserimg.classify.recipe import Recipe, describe_cloud, describe_images
from laserimg.classify.scores import ClassTable, class_table
from laserimg.classify.views import ObjectImages, crop_of_pixels, crop_of_scan, views_of_cloud

__all__ = [
    "ClassTable",
    "ObjectCloud",
    "ObjectImages",
    "ObjectModel",
    "Recipe",
    "Verdict",
    "class_table",
    "crop_of_pixels",
    "crop_of_scan",
    "describe_cloud",
    "describe_images",
    "load_model",
    "save_model",
    "views_of_cloud",
]
