"""Time of the descriptors and of leave-one-out, as ratios in one run.

    python tools/descriptor_speed.py

Images of 64 x 64 pixels, a stack of 128; the best of several runs. scikit-image is compared where it
is installed.
"""

import time
from collections.abc import Callable

import cv2
import numpy as np

from laserimg.classify.validation import leave_one_out
from laserimg.descriptors import hog, hog3d, honv, surface_normals

COUNT, SIDE = 128, 64


def best_ms(run: Callable[[], object], repeats: int = 7) -> float:
    """Return the shortest time of an image in milliseconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times) / COUNT * 1000


def ball() -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, h, w, 3) of a ball seen from 5 m, and what is the ball."""
    y, x = np.mgrid[-0.25 : 0.25 : SIDE * 1j, -0.25 : 0.25 : SIDE * 1j]
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = rays[..., 2] * 5
    inside = along**2 - 24
    known = inside > 0
    points = rays * (along - np.sqrt(np.maximum(inside, 0)))[..., None] * known[..., None]
    return np.repeat(points[None], COUNT, 0).astype(np.float32), np.repeat(known[None], COUNT, 0)


def print_descriptors() -> None:
    """Print the time of each descriptor beside HOG of OpenCV and scikit-image."""
    images = np.random.default_rng(0).random((COUNT, SIDE, SIDE)).astype(np.float32)
    gray = (images * 255).astype(np.uint8)
    points, known = ball()
    normals = surface_normals(points, known)
    opencv = cv2.HOGDescriptor((SIDE, SIDE), (16, 16), (8, 8), (8, 8), 18)
    theirs = best_ms(lambda: [opencv.compute(image) for image in gray])
    rows = {
        "cv2.HOGDescriptor": theirs,
        "hog": best_ms(lambda: hog(images)),
        "normals": best_ms(lambda: surface_normals(points, known)),
        "honv": best_ms(lambda: honv(normals)),
        "hog3d": best_ms(lambda: hog3d(images, normals)),
        "hog3d, interpolated": best_ms(lambda: hog3d(images, normals, votes="interpolated")),
    }
    try:
        from skimage.feature import hog as skimage_hog
    except ImportError:
        pass
    else:
        sizes = {"pixels_per_cell": (8, 8), "cells_per_block": (2, 2), "orientations": 18}
        rows["skimage.hog"] = best_ms(lambda: [skimage_hog(image, **sizes) for image in images], 1)
    for name, milliseconds in rows.items():
        print(f"{name:22}{milliseconds:8.3f} ms   {milliseconds / theirs:6.2f} x cv2.HOGDescriptor")


def print_leave_one_out() -> None:
    """Print the time of leave-one-out for objects and numbers as many as in paper 1."""
    random = np.random.default_rng(0)
    labels = np.repeat(["Building", "Car", "Human", "Tree", "Pole"], [103, 104, 124, 131, 28])
    # Objects of a class have a product of about 0.7, those of two classes 0.5, as real ones have.
    middles = random.normal(size=(5, 15876)) * 0.45 + random.normal(size=15876) * 0.7
    vectors = middles[np.unique(labels, return_inverse=True)[1]] + 0.55 * random.normal(size=(490, 15876))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    start = time.perf_counter()
    leave_one_out(vectors, labels)
    print(f"leave-one-out of 490 x 15876, 5 classes: {time.perf_counter() - start:.2f} s")


if __name__ == "__main__":
    print_descriptors()
    print_leave_one_out()
