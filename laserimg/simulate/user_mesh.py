"""Things made from the user's own meshes: OBJ, STL, PLY and GLB files, scaled to a height in metres."""

from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError, MissingExtraError
from laserimg.files import changed_ns
from laserimg.simulate.mesh import mesh_of
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing

SUFFIXES = (".obj", ".stl", ".ply", ".glb")
UPS = ("auto", "y", "z")
MAX_FACES = 2_000_000
MATERIALS = (
    "plastic_light", "plastic_dark", "metal_painted", "paint_white", "paint_dark", "wood", "fabric_light",
    "fabric_dark", "cardboard",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class UserThing:
    """A maker of things from one mesh file; workers get its path, not its triangles.

    Parameters
    ----------
    path : Path
    label : str
        The class the things have in the truth.
    height_m : tuple of float
        Least and greatest height; each thing is scaled, the same in all directions, to one between.
    up : str
        The axis that points up in the file: "y" or "z".
    tag : str
        Label and digest of file and arguments, for names of files made with it.
    """

    path: Path
    label: str
    height_m: tuple[float, float]
    up: str
    tag: str

    def __call__(self, rng: np.random.Generator) -> Thing:
        """Return the mesh at a random height in a random material, centred on z = 0, front towards +x."""
        points, faces = standing(self.path, self.up)
        material = varied(rng, str(rng.choice(MATERIALS)), 0.4)
        return Thing(self.label, mesh_of(points * rng.uniform(*self.height_m), faces, material), self.label)


def user_thing(path: str | Path, label: str, height_m: tuple[float, float], up: str = "auto") -> UserThing:
    """Return a maker of labelled things from a mesh file.

    Parameters
    ----------
    path : str or Path
        OBJ, STL, PLY or GLB.
    label : str
        Class name.
    height_m : tuple of float
        Range of heights in metres to which the mesh is scaled; the file's unit does not matter.
    up : str
        "y", "z", or "auto": y in GLB files, as their format says, z in others.

    Raises
    ------
    MissingExtraError
        Without trimesh.
    ConfigError
        If the file cannot be read as triangles, or an argument is wrong.
    """
    file = Path(path)
    low, high = height_m
    if not 0 < low <= high < np.inf:
        raise ConfigError(f"height {low:g}:{high:g}: two lengths in metres above 0 are needed, as 0.2:0.6")
    if not label.strip():
        raise ConfigError("the class of a mesh needs a name")
    if up not in UPS:
        raise ConfigError(f"up is {up!r}; known: {', '.join(UPS)}")
    axis = ("y" if file.suffix.lower() == ".glb" else "z") if up == "auto" else up
    standing(file, axis)
    digest = sha256(f"{low:g} {high:g} {axis}".encode() + file.read_bytes()).hexdigest()[:8]
    plain = "".join(letter if letter.isalnum() else "_" for letter in label)
    return UserThing(file.resolve(), label, (float(low), float(high)), axis, f"{plain}_{digest}")


def standing(path: Path, up: str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return (n, 3) points, 1 high on z = 0 and centred in x and y, and (m, 3) faces of a mesh file.

    Raises
    ------
    MissingExtraError, ConfigError
        As `user_thing`.
    """
    return _standing(path, up, changed_ns(path))


@lru_cache(maxsize=8)
def _standing(path: Path, up: str, _changed_ns: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    points, faces = _triangles(path)
    # z, x, y of files whose y points up are x, y, z: their front, +z by the GLB format, becomes +x.
    points = points[:, [2, 0, 1]] if up == "y" else points
    low, high = points.min(axis=0), points.max(axis=0)
    if high[2] - low[2] <= 1e-6 * (high - low).max():
        raise ConfigError(f"{path}: the mesh is flat along {up}, its height; --up names another axis")
    middle = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    return (points - middle) / (high[2] - low[2]), faces


def _triangles(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Points that faces use, and the faces."""
    if path.suffix.lower() not in SUFFIXES:
        raise ConfigError(f"{path}: no mesh file; known: {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise ConfigError(f"{path}: no such file")
    try:
        import trimesh
    except ImportError:
        raise MissingExtraError("meshes", "simulate") from None
    if not path.stat().st_size:
        raise ConfigError(f"{path}: is empty")
    try:
        # Readers of broken files raise whatever their parsers raise.
        mesh = trimesh.load(path, force="mesh", process=False, skip_materials=True)
        points, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)  # type: ignore[attr-defined]
    except ImportError as error:
        why = f"broken, or needs the Python module {error.name}, which is not installed"
        raise ConfigError(f"{path}: cannot be read as a mesh: {why}") from error
    except Exception as error:
        raise ConfigError(f"{path}: cannot be read as a mesh: {error or type(error).__name__}") from error
    if not len(faces):
        raise ConfigError(f"{path}: holds no triangles; a mesh with faces is needed")
    if len(faces) > MAX_FACES:
        raise ConfigError(f"{path}: {len(faces)} triangles; make it simpler, at most {MAX_FACES}")
    if faces.min() < 0 or faces.max() >= len(points) or not np.isfinite(points[faces]).all():
        raise ConfigError(f"{path}: triangles with missing or infinite corners")
    used, numbers = np.unique(faces, return_inverse=True)
    return points[used], numbers.reshape(-1, 3).astype(np.int32)
