"""Why a cluster is taken for its class: which part of the description speaks for it, and by how much."""

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.model import ObjectModel
from laserimg.classify.scores import UNKNOWN
from laserimg.descriptors import Layout


def parts_of(model: ObjectModel) -> dict[str, slice]:
    """Return what each stretch of a description tells, in the order of the description."""
    recipe, layout = model.recipe, Layout()
    what = recipe.appearance
    first = f"edges of {what} on the surface" if recipe.features.startswith("3dhog") else "shape"
    parts = {first: slice(0, layout.honv_length)}
    if recipe.features.endswith("+hog"):
        parts[what] = slice(layout.honv_length, layout.honv_length + layout.hog_length)
    if recipe.size:
        parts["size"] = slice(recipe.length - 3, recipe.length)
    return parts


def reasons(model: ObjectModel, vectors: NDArray, decisions: NDArray, labels: list[str]) -> list[str]:
    """Return a sentence for each of n clusters.

    The decision values of a linear classifier are sums, so that the distance of the best class from
    the second is a part from the shape, one from the reflectance and one from the size. The
    constant goes with the size, whose logarithms have no zero of their own.

    Parameters
    ----------
    model : ObjectModel
    vectors : (n, d) array
    decisions : (n, k) array
        Of `ObjectModel.decide`.
    labels : list of str
        What each is taken for.
    """
    order = np.argsort(-decisions, axis=1)
    best, second = order[:, 0], order[:, 1]
    apart = np.take_along_axis(decisions, order[:, :2], axis=1) @ [1.0, -1.0]
    parts = parts_of(model)
    shares = {name: _shares(model, vectors[:, part], part, best, second) for name, part in parts.items()}
    constant = model.bias[best].astype(np.float64) - model.bias[second]
    name = "size" if model.recipe.size else "constant"
    shares[name] = shares.get(name, 0.0) + constant
    sentences = []
    for row, label in enumerate(labels):
        one, other = model.labels[best[row]], model.labels[second[row]]
        each = sorted(((values[row], name) for name, values in shares.items()), reverse=True)
        told = ", ".join(f"{name} {value:+.2f}" for value, name in each)
        if label == UNKNOWN:
            sentences.append(f"{one} or {other}: only {apart[row]:.2f} apart ({told})")
        else:
            sentences.append(f"{one} rather than {other} by {apart[row]:.2f}: {told}")
    return sentences


def _shares(
    model: ObjectModel, values: NDArray, part: slice, best: NDArray[np.intp], second: NDArray[np.intp]
) -> NDArray[np.float64]:
    weights = model.weights[:, part].astype(np.float64)
    products = np.asarray(values, np.float64) @ weights.T
    rows = np.arange(len(products))
    return products[rows, best] - products[rows, second]
