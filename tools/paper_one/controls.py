"""What objects are taken for without any image: by their size alone, and by their global shape."""

import numpy as np

from laserimg.classify.recipe import size_numbers

TREES = 500


def shape_numbers(points: np.ndarray) -> np.ndarray:
    """Return 12 numbers of the shape of a cloud (n, 3), z up.

    Log of height, length and breadth; of the covariance with eigenvalues l1 >= l2 >= l3 the linearity,
    planarity, scattering, omnivariance, entropy and share of l3 (Weinmann et al. 2015,
    doi:10.1016/j.isprsjprs.2015.01.016); how upright the first and the last axis are; and how far up
    the cloud its mean is, in its height.
    """
    values, axes = np.linalg.eigh(np.cov(points.T))
    share = np.maximum(values[::-1] / max(values.sum(), 1e-12), 1e-9)
    height = max(float(np.ptp(points[:, 2])), 1e-3)
    return np.array([
        *size_numbers(points),
        (share[0] - share[1]) / share[0],
        (share[1] - share[2]) / share[0],
        share[2] / share[0],
        np.cbrt(share.prod()),
        -float((share * np.log(share)).sum()),
        share[2],
        abs(axes[2, 2]),
        abs(axes[2, 0]),
        (points[:, 2].mean() - points[:, 2].min()) / height,
    ])  # fmt: skip


def by_size(clouds: list[np.ndarray], labels: np.ndarray) -> np.ndarray:
    """Return the class (n,) of every object by an RBF machine on three size numbers, without it."""
    from sklearn.model_selection import LeaveOneOut, cross_val_predict
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    sizes = np.stack([size_numbers(cloud) for cloud in clouds])
    machine = make_pipeline(StandardScaler(), SVC(C=10))
    return cross_val_predict(machine, sizes, labels, cv=LeaveOneOut())


def by_shape(clouds: list[np.ndarray], labels: np.ndarray, seed: int = 0) -> np.ndarray:
    """Return the class (n,) of every object by those trees of a random forest that were grown without it."""
    from sklearn.ensemble import RandomForestClassifier

    shapes = np.stack([shape_numbers(cloud) for cloud in clouds])
    forest = RandomForestClassifier(TREES, oob_score=True, random_state=seed).fit(shapes, labels)
    return forest.classes_[forest.oob_decision_function_.argmax(axis=1)]
