"""Scans of scenes, with the exact truth."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array, Scan
from laserimg.simulate.cast import Caster
from laserimg.simulate.echoes import Echoes, echoes_along, joined_echoes
from laserimg.simulate.footprint import AROUND, near_edges, rays_around, within_reach
from laserimg.simulate.mesh import joined
from laserimg.simulate.receiver import received
from laserimg.simulate.scanner import Scanner
from laserimg.simulate.scanner.head import beams_shot
from laserimg.simulate.scanner.model import Intensity
from laserimg.simulate.things import Scene


@dataclass(frozen=True, eq=False, slots=True)
class Simulated:
    """A simulated scan and the truth of its pixels.

    The truth is that of the thing that gave the return: of all that a wide beam meets the one whose echo
    is nearest to the measured range, before noise. Behind a pane that is what is seen through it; of a
    mirrored image it is the mirror. Pixels without a return have none.

    Parameters
    ----------
    scan : Scan
    thing : (H, W) array of int32
        Index of the thing; -1 for none.
    truth_range : (H, W) array of float32
        Metres to that thing, without noise, in the middle of the beam unless its rim alone meets it; 0 for
        none.
    truth_normals : (H, W, 3) array of float32
        Of the surface there, in the scanner's frame, towards it; 0 for none.
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
    drawn = _drawn(len(along), rng)
    middle, echoes, share = _echoes(caster, pose[:3, 3], along, scanner, drawn.turn)
    exact, power = _measured(echoes, share, scanner, drawn)
    range_m = _reported_range(exact, power, scanner, drawn)
    reflectance = np.where(range_m > 0, _reported_power(power, exact, scanner.intensity), np.float32(0))
    scan = Scan(range_m.reshape(shape), scanner.directions, reflectance.reshape(shape), pose, scanner.wraps)
    exact = np.where(range_m > 0, exact, np.float32(0))
    face, truth = _truth(middle, echoes, exact, scanner.receiver.weakest, owner)
    hit = face >= 0
    normals = np.where(hit[:, None], caster.normals[face], np.float32(0))
    normals *= -np.copysign(np.float32(1), np.einsum("ij,ij->i", normals, along))[:, None]
    thing = np.where(hit, owner[face], -1).astype(np.int32).reshape(shape)
    return Simulated(scan, thing, truth.reshape(shape), (normals @ turn).reshape(*shape, 3))


class _Drawn(NamedTuple):
    """Chance for every beam, the same whatever the scan sees: nothing shifts when one edge comes or goes."""

    turn: Float32Array
    power: Float32Array
    range: Float32Array
    ring: np.float32


def _drawn(count: int, rng: np.random.Generator) -> _Drawn:
    return _Drawn(
        np.float32(2 * np.pi) * rng.random(count, np.float32),
        rng.standard_normal(count, np.float32),
        rng.standard_normal(count, np.float32),
        np.float32(rng.uniform(0, 2 * np.pi)),
    )


def _echoes(
    caster: Caster, origin: NDArray[np.float64], along: Float32Array, scanner: Scanner, turn: Float32Array
) -> tuple[Echoes, Echoes, Float32Array]:
    """Echoes of beams' middles; of all thin rays, `ray` being the beam; and what share of a beam a ray is."""
    middle, width = echoes_along(caster, origin, along), scanner.directions.shape[1]
    ends = _deepest(middle, scanner)
    edges = near_edges(ends, 3 * scanner.noise.white_m, scanner.wraps)
    edges = within_reach(edges, ends, scanner.directions, scanner.beam, scanner.wraps)
    edge = np.flatnonzero(edges).astype(np.int32)
    around = echoes_along(
        caster, *rays_around(origin, along[edge], along_row(along, edge, width), scanner.beam, turn[edge])
    )
    share = np.ones(len(along), np.float32)
    share[edge] = 1 / (AROUND + 1)
    return middle, joined_echoes([middle, replace(around, ray=edge[around.ray // AROUND])]), share


def _measured(
    echoes: Echoes, share: Float32Array, scanner: Scanner, drawn: _Drawn
) -> tuple[Float32Array, Float32Array]:
    """Range before noise and power of each beam; 0 and 0 for no return."""
    noise = np.maximum(1 + np.float32(scanner.noise.power) * drawn.power, 0)
    power = echoes.power * (share * noise)[echoes.ray]
    return received(echoes.ray, echoes.distance, power, len(share), scanner.receiver)


def along_row(along: Float32Array, beam: NDArray[np.integer], width: int) -> Float32Array:
    """Return the way from some beams to the next of their row; the last has that of the one before."""
    start = beam - (beam % width == width - 1)
    return along[start + 1] - along[start]


def _deepest(middle: Echoes, scanner: Scanner) -> Float32Array:
    """Where each beam's middle ends: behind panes; infinity for nowhere."""
    ends = np.full(scanner.directions.shape[:2], np.inf, np.float32)
    # Farther surfaces come later.
    ends.ravel()[middle.ray] = middle.distance
    return ends


def _reported_range(
    exact: Float32Array, power: Float32Array, scanner: Scanner, drawn: _Drawn
) -> Float32Array:
    """Ranges with noise, rounded and within limits; 0 for none."""
    noise, weakest = scanner.noise, scanner.receiver.weakest
    weakness = np.float32(weakest) / np.maximum(power, np.float32(weakest))
    spread = np.sqrt(noise.white_m**2 + (noise.weakest_m**2 - noise.white_m**2) * weakness)
    wave = np.float32(2 * np.pi / noise.ring_period_m) * exact + drawn.ring
    noisy = exact + spread * drawn.range
    noisy += np.float32(2**0.5 * noise.ring_m) * np.sin(wave)
    rounded = np.round(noisy / np.float32(scanner.step_m)) * np.float32(scanner.step_m)
    kept = (exact > 0) & (rounded >= scanner.min_range_m) & (rounded <= scanner.max_range_m)
    return np.where(kept, rounded, np.float32(0))


def _reported_power(power: Float32Array, range_m: Float32Array, intensity: Intensity) -> Float32Array:
    value = intensity.scale * (power * range_m**intensity.made_up) ** intensity.exponent
    return np.minimum(np.round(value), intensity.top).astype(np.float32)


def _truth(
    middle: Echoes, echoes: Echoes, range_m: Float32Array, weakest: float, owner: NDArray[np.int32]
) -> tuple[NDArray[np.int32], Float32Array]:
    """Face and range of the thing that each beam measured; -1 and 0 for beams without a return."""
    face, seen_m = _nearest(middle, range_m, weakest)
    nearest, nearest_m = _nearest(echoes, range_m, weakest)
    by_rim = (face < 0) | (owner[face] != owner[nearest])
    return np.where(by_rim, nearest, face), np.where(by_rim, nearest_m, seen_m)


def _nearest(echoes: Echoes, range_m: Float32Array, weakest: float) -> tuple[NDArray[np.int32], Float32Array]:
    """Face and range of the echo nearest to each beam's range, if strong enough, else of the strongest."""
    face, seen_m = np.full(len(range_m), -1, np.int32), np.zeros(len(range_m), np.float32)
    could_be = echoes.power * (AROUND + 1) >= weakest
    off = np.abs(echoes.distance - range_m[echoes.ray])
    rank = np.where(could_be, off, np.float32(1e6) / (echoes.power + np.float32(1e-9)))
    least = np.full(len(range_m), np.inf, np.float32)
    np.minimum.at(least, echoes.ray, rank)
    chosen = np.flatnonzero((rank == least[echoes.ray]) & (range_m[echoes.ray] > 0))
    face[echoes.ray[chosen]], seen_m[echoes.ray[chosen]] = echoes.face[chosen], echoes.seen_m[chosen]
    return face, seen_m
