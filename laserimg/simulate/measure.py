"""Scans of scenes, with the exact truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array, Scan
from laserimg.simulate.cast import Caster
from laserimg.simulate.echoes import Echoes, echoes_along
from laserimg.simulate.footprint import AROUND, near_edges, rays_around
from laserimg.simulate.mesh import joined
from laserimg.simulate.receiver import received
from laserimg.simulate.scanner import Scanner
from laserimg.simulate.scanner.head import beams_shot
from laserimg.simulate.scanner.model import Intensity
from laserimg.simulate.things import Scene


@dataclass(frozen=True, eq=False, slots=True)
class Simulated:
    """A simulated scan and the truth of its pixels.

    The truth is that of the beam's middle: of the surface that gave the return, or would have sent
    back most. Behind a pane that is what is seen through it; of a mirrored image it is the mirror.

    Parameters
    ----------
    scan : Scan
    thing : (H, W) array of int32
        Index of the thing; -1 for none.
    truth_range : (H, W) array of float32
        Metres without noise; 0 for none.
    truth_normals : (H, W, 3) array of float32
        In the scanner's frame, towards it; 0 for none.
    """

    scan: Scan
    thing: NDArray[np.int32]
    truth_range: Float32Array
    truth_normals: Float32Array


@dataclass(frozen=True, eq=False, slots=True)
class Stage:
    """A scene ready to be scanned from all its places.

    Parameters
    ----------
    caster : Caster
        Of all things together.
    owner : (m,) array of int32
        Index of the thing that each face belongs to.
    """

    caster: Caster
    owner: NDArray[np.int32]


def staged(scene: Scene) -> Stage:
    """Return the stage of a scene.

    Raises
    ------
    MissingExtraError
        Without Embree.
    """
    meshes = [thing.mesh for thing in scene.things]
    owner = np.repeat(np.arange(len(meshes), dtype=np.int32), [len(mesh.faces) for mesh in meshes])
    return Stage(Caster(joined(meshes)), owner)


def simulated(
    scene: Scene,
    scanner_index: int,
    scanner: Scanner,
    seed: int | np.random.SeedSequence,
    stage: Stage | None = None,
) -> Simulated:
    """Return a scan from one of the scene's places.

    Thin rays find where edges are; there each beam is seven rays, whose echoes run into pulses as in
    the scanner's receiver: mixed pixels. Too weak pulses are no return.

    Parameters
    ----------
    scene : Scene
    scanner_index : int
        Of the scene's places.
    scanner : Scanner
    seed : int or SeedSequence
        Of the noise.
    stage : Stage, optional
        Of the scene, by `staged`, when it is scanned several times.

    Raises
    ------
    MissingExtraError
        Without Embree.
    ScanError
        If no beam has a return.
    """
    stage = stage or staged(scene)
    caster, owner = stage.caster, stage.owner
    pose, shape = scene.scanners[scanner_index], scanner.directions.shape[:2]
    turn = pose[:3, :3].astype(np.float32)
    rng = np.random.default_rng(seed)
    along = beams_shot(scanner.directions, scanner.head, rng).reshape(-1, 3) @ turn.T
    middle = echoes_along(caster, pose[:3, 3], along)
    exact, power = _measured(caster, pose[:3, 3], along, middle, scanner, rng)
    range_m = _reported_range(exact, power, scanner, rng)
    reflectance = np.where(range_m > 0, _reported_power(power, exact, scanner.intensity), np.float32(0))
    scan = Scan(range_m.reshape(shape), scanner.directions, reflectance.reshape(shape), pose, scanner.wraps)
    face, truth = _truth(middle, exact, scanner.receiver.weakest)
    hit = face >= 0
    normals = np.where(hit[:, None], caster.normals[face], np.float32(0))
    normals *= -np.copysign(np.float32(1), np.einsum("ij,ij->i", normals, along))[:, None]
    thing = np.where(hit, owner[face], -1).astype(np.int32).reshape(shape)
    return Simulated(scan, thing, truth.reshape(shape), (normals @ turn).reshape(*shape, 3))


def _measured(
    caster: Caster,
    origin: NDArray[np.float64],
    along: Float32Array,
    middle: Echoes,
    scanner: Scanner,
    rng: np.random.Generator,
) -> tuple[Float32Array, Float32Array]:
    """Range before noise and power of each beam; 0 and 0 for no return."""
    edge = np.flatnonzero(near_edges(_deepest(middle, scanner), *_edge_sizes(scanner), scanner.wraps))
    turns = rng.uniform(0, 2 * np.pi, len(edge)).astype(np.float32)
    around = echoes_along(
        caster, *rays_around(origin, along[edge], _along_row(along, edge, scanner), scanner.beam, turns)
    )
    share = np.ones(len(along), np.float32)
    share[edge] = 1 / (AROUND + 1)
    beam = np.concatenate([middle.ray, edge[around.ray // AROUND]])
    power = np.concatenate([middle.power, around.power]) * share[beam]
    noise = 1 + np.float32(scanner.noise.power) * rng.standard_normal(len(along), np.float32)
    power *= np.maximum(noise, 0)[beam]
    distance = np.concatenate([middle.distance, around.distance])
    return received(beam, distance, power, len(along), scanner.receiver)


def _along_row(along: Float32Array, beam: NDArray[np.intp], scanner: Scanner) -> Float32Array:
    """From some beams to the next of their row; from the last of a row as from the one before."""
    width = scanner.directions.shape[1]
    start = beam - (beam % width == width - 1)
    return along[start + 1] - along[start]


def _deepest(middle: Echoes, scanner: Scanner) -> Float32Array:
    """Where each beam's middle ends: behind panes; infinity for nowhere."""
    ends = np.full(scanner.directions.shape[:2], np.inf, np.float32)
    # Farther surfaces come later.
    ends.ravel()[middle.ray] = middle.distance
    return ends


def _edge_sizes(scanner: Scanner) -> tuple[float, tuple[int, int]]:
    """The least jump that shows, and how many more rows and columns than the next a beam covers."""
    row, column = scanner.directions.shape[0] // 2, scanner.directions.shape[1] // 2
    middle, below, right = scanner.directions[[row, row + 1, row], [column, column, column + 1]]
    radius = scanner.beam.divergence_rad / 2
    columns = int(radius / np.linalg.norm(middle - right))
    rows = int(radius * scanner.beam.height / np.linalg.norm(middle - below))
    return 3 * scanner.noise.white_m, (rows, columns)


def _reported_range(
    exact: Float32Array, power: Float32Array, scanner: Scanner, rng: np.random.Generator
) -> Float32Array:
    """Ranges with noise, rounded and within limits; 0 for none."""
    noise, weakest = scanner.noise, scanner.receiver.weakest
    weakness = np.float32(weakest) / np.maximum(power, np.float32(weakest))
    spread = np.sqrt(noise.white_m**2 + (noise.weakest_m**2 - noise.white_m**2) * weakness)
    wave = np.float32(2 * np.pi / noise.ring_period_m) * exact + np.float32(rng.uniform(0, 2 * np.pi))
    noisy = exact + spread * rng.standard_normal(exact.shape, np.float32)
    noisy += np.float32(2**0.5 * noise.ring_m) * np.sin(wave)
    rounded = np.round(noisy / np.float32(scanner.step_m)) * np.float32(scanner.step_m)
    kept = (exact > 0) & (rounded >= scanner.min_range_m) & (rounded <= scanner.max_range_m)
    return np.where(kept, rounded, np.float32(0))


def _reported_power(power: Float32Array, range_m: Float32Array, intensity: Intensity) -> Float32Array:
    value = intensity.scale * (power * range_m**intensity.made_up) ** intensity.exponent
    return np.minimum(np.round(value), intensity.top).astype(np.float32)


def _truth(middle: Echoes, exact: Float32Array, weakest: float) -> tuple[NDArray[np.int32], Float32Array]:
    """Face and range of the surface that each beam's middle shows."""
    face, seen_m = np.full(len(exact), -1, np.int32), np.zeros(len(exact), np.float32)
    # Of several surfaces the one nearest to the measured range, if it is strong enough to be it; of a beam
    # without a return the strongest. Weak ones come last.
    several = np.flatnonzero(np.bincount(middle.ray, minlength=len(exact))[middle.ray] > 1)
    ray, power = middle.ray[several], middle.power[several]
    could_be = (exact[ray] > 0) & (power * (AROUND + 1) >= weakest)
    rank = np.where(could_be, np.abs(middle.distance[several] - exact[ray]), 1e6 / (power + 1e-9))
    last = several[np.argsort(-rank)]
    face[middle.ray], seen_m[middle.ray] = middle.face, middle.seen_m
    face[middle.ray[last]], seen_m[middle.ray[last]] = middle.face[last], middle.seen_m[last]
    return face, seen_m
