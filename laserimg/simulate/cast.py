"""Rays against meshes: distance, normal and face of the first hit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import MissingExtraError
from laserimg.simulate.mesh import Mesh

# Faces that mirror this share are smooth: rays go on from them. Below it the mirrored image of a thing
# has less than a tenth of the thing's own power.
SMOOTH_SHARE = 0.3


@dataclass(frozen=True, eq=False, slots=True)
class Hits:
    """First hits of n rays.

    Parameters
    ----------
    distance : (n,) array of float32
        Metres; infinity where nothing was hit.
    normal : (n, 3) array of float32
        Unit, against the ray; 0 where nothing was hit.
    cosine : (n,) array of float32
        Of the incidence.
    face : (n,) array of int32
        -1 where nothing was hit.
    """

    distance: NDArray[np.float32]
    normal: NDArray[np.float32]
    cosine: NDArray[np.float32]
    face: NDArray[np.int32]


class Caster:
    """A mesh with its bounding volume hierarchy, made once.

    Attributes
    ----------
    mesh : Mesh
    normals : (m, 3) array of float32
        Unit vectors of the faces, outwards.
    smooth : (m,) array of bool
        Faces from which rays go on: panes and mirrors.

    Raises
    ------
    MissingExtraError
        Without Embree.
    """

    def __init__(self, mesh: Mesh) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError:
            raise MissingExtraError("simulated scans", "simulate") from None
        corners = mesh.vertices[mesh.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        self.mesh = mesh
        self.smooth = (mesh.transmission > 0) | (mesh.specular >= SMOOTH_SHARE)
        self.normals = (cross / np.maximum(length, 1e-20)).astype(np.float32)
        self._scene: Any = EmbreeScene()
        # By vertices and faces: a third faster than by the corners of each face.
        faces = np.ascontiguousarray(mesh.faces, np.int32)
        TriangleMesh(self._scene, mesh.vertices.astype(np.float32), faces)

    def __call__(self, origins: ArrayLike, directions: ArrayLike) -> Hits:
        """Return the first hits of rays from (3,) or (n, 3) origins along (n, 3) unit vectors."""
        along = np.ascontiguousarray(directions, np.float32)
        start = np.ascontiguousarray(np.broadcast_to(np.asarray(origins, np.float32), along.shape))
        found = self._scene.run(start, along, output=True)
        face = np.asarray(found["primID"], np.int32)
        hit = face >= 0
        distance = np.where(hit, np.asarray(found["tfar"], np.float32), np.float32(np.inf))
        normal = np.where(hit[:, None], self.normals[face], np.float32(0))
        cosine = np.einsum("ij,ij->i", normal, along)
        normal *= -np.copysign(np.float32(1), cosine)[:, None]
        return Hits(distance, normal, np.abs(cosine), face)
