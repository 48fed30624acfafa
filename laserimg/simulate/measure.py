"""Scans of scenes, with the exact truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array, Scan
from laserimg.simulate.cast import Caster
from laserimg.simulate.mesh import joined
from laserimg.simulate.scanner import Scanner
from laserimg.simulate.things import Scene


@dataclass(frozen=True, eq=False, slots=True)
class Simulated:
    """A simulated scan and the truth of its pixels.

    Parameters
    ----------
    scan : Scan
    thing : (H, W) array of int32
        Index of the thing the beam's centre meets; -1 for none.
    truth_range : (H, W) array of float32
        Metres without noise; 0 for none.
    truth_normals : (H, W, 3) array of float32
        In the scanner's frame, towards it; 0 for none.
    """

    scan: Scan
    thing: NDArray[np.int32]
    truth_range: Float32Array
    truth_normals: Float32Array


def simulated(scene: Scene, scanner_index: int, scanner: Scanner, seed: int) -> Simulated:
    """Return a scan from one of the scene's places: white noise, rounding and limits; thin beams.

    Reflectance is that of the material times the cosine of incidence over the range squared, 1 for white
    seen straight on at 1 m: the range equation for targets larger than the beam (Hoefle and Pfeifer 2007,
    doi:10.1016/j.isprsjprs.2007.05.008), without the air.

    Raises
    ------
    MissingExtraError
        Without Embree.
    ScanError
        If no beam has a return.
    """
    meshes = [thing.mesh for thing in scene.things]
    owner = np.repeat(np.arange(len(meshes), dtype=np.int32), [len(mesh.faces) for mesh in meshes])
    pose = scene.scanners[scanner_index]
    shape, turn = scanner.directions.shape[:2], pose[:3, :3]
    whole = joined(meshes)
    hits = Caster(whole)(pose[:3, 3], scanner.directions.reshape(-1, 3) @ turn.T)
    hit = hits.face >= 0
    truth = np.where(hit, hits.distance, np.float32(0))
    noisy = truth + np.random.default_rng(seed).normal(0, scanner.noise_m, truth.shape)
    rounded = np.round(noisy / scanner.step_m) * scanner.step_m
    kept = hit & (rounded >= scanner.min_range_m) & (rounded <= scanner.max_range_m)
    range_m = np.where(kept, rounded, 0).astype(np.float32).reshape(shape)
    cosine = np.abs(np.einsum("ij,ij->i", hits.normal, scanner.directions.reshape(-1, 3) @ turn.T))
    strength = whole.reflectance[hits.face] * cosine / np.maximum(truth, scanner.min_range_m) ** 2
    reflectance = np.where(kept, strength, 0).astype(np.float32).reshape(shape)
    scan = Scan(range_m, scanner.directions, reflectance, pose, scanner.wraps)
    normals = (hits.normal @ turn).astype(np.float32).reshape(*shape, 3)
    thing = np.where(hit, owner[hits.face], -1).astype(np.int32).reshape(shape)
    return Simulated(scan, thing, truth.reshape(shape), normals)
