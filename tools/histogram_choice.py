"""Which library finds splits fastest: SciPy, NumPy, numba, or scikit-learn's trees of histograms.

    python tools/histogram_choice.py

One round of boosting on binned features: for every feature the weights of its samples are summed by bin and
class and the best split is judged. numba is not a dependency; without it its rows are left out.
"""

import time
from collections.abc import Callable

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor

from laserimg.cascade.histograms import HAAR, Binned, gains

FEATURES, SAMPLES = 4000, 3000


def seconds(call: Callable[[], object], repeats: int = 7) -> float:
    """Return the least of some times, after one call that is not counted."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def numba_gains() -> Callable | None:
    """Return a compiled search over all features on all cores, or None without numba."""
    try:
        import numba
    except ImportError:
        return None

    @numba.njit(parallel=True, fastmath=True)
    def search(codes, weights, targets, bins):
        best = np.zeros(len(codes))
        for feature in numba.prange(len(codes)):
            mass, moment = np.zeros(bins), np.zeros(bins)
            for sample in range(codes.shape[1]):
                place = codes[feature, sample] % bins
                mass[place] += weights[sample]
                moment[place] += weights[sample] * targets[sample]
            total, total_moment = mass.sum(), moment.sum()
            left, left_moment = 0.0, 0.0
            for place in range(bins - 1):
                left += mass[place]
                left_moment += moment[place]
                right, rest = total - left, total_moment - left_moment
                if left > 1e-6 * total and right > 1e-6 * total:
                    gain = left_moment**2 / left + rest**2 / right
                    best[feature] = max(best[feature], gain)
        return best

    return search


def main() -> None:
    """Print a row for each library."""
    rng = np.random.default_rng(0)
    positive = np.arange(SAMPLES) % 3 == 0
    values = rng.normal(size=(FEATURES, SAMPLES)) + 0.3 * positive
    codes = np.clip(values * 8 + 32, 0, HAAR.bins - 1).astype(np.uint8)
    codes += (positive * HAAR.bins).astype(np.uint8)
    weights, targets = rng.random(SAMPLES), np.where(positive, 1.0, -1.0)
    weights /= weights.sum()

    print(f"{FEATURES} features, {SAMPLES} samples, {HAAR.bins} bins, milliseconds a round")
    print(f"NumPy bincount            {1e3 * seconds(lambda: gains(codes, HAAR, weights, targets)):7.1f}")
    start = time.perf_counter()
    table = Binned.of(codes, HAAR)
    made = time.perf_counter() - start
    expected = table.gains(weights, targets)
    print(
        f"SciPy sparse product      {1e3 * seconds(lambda: table.gains(weights, targets)):7.1f}"
        f"   and once {1e3 * made:.0f} for the table"
    )
    search = numba_gains()
    if search is not None:
        start = time.perf_counter()
        found = search(codes, weights, targets, HAAR.bins)
        compiled = time.perf_counter() - start
        np.testing.assert_allclose(found, expected, rtol=1e-3)
        each = seconds(lambda: search(codes, weights, targets, HAAR.bins))
        print(f"numba, all cores          {1e3 * each:7.1f}   and once {1e3 * compiled:.0f} to compile")
    few, many = (
        seconds(
            lambda rounds=rounds: HistGradientBoostingRegressor(
                max_iter=rounds, max_leaf_nodes=2, max_bins=HAAR.bins, early_stopping=False
            ).fit((codes % HAAR.bins).T, targets, weights),
            repeats=2,
        )
        for rounds in (5, 25)
    )
    print(
        f"scikit-learn's histograms {1e3 * (many - few) / 20:7.1f}"
        f"   and once {1e3 * (few - (many - few) / 4):.0f} to bin"
    )


if __name__ == "__main__":
    main()
