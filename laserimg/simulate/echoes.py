"""Echoes along thin rays: what every surface on the way sends back, through panes and off mirrors."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.scan import Float32Array
from laserimg.simulate.cast import Caster, Hits

# Phong exponents. Panes are seen within a few degrees of their normal (Foster, Sun, Park and Kuipers,
# "VisAGGE: Visible angle grid for glass environments", ICRA 2013): at 3 degrees the lobe of a smooth
# surface has fallen to a hundredth. That of paint and plastic is 10 degrees wide: our assumption.
SMOOTH_LOBE, GLOSSY_LOBE = 1000, 50
# Both faces of two panes and what is behind, and one more.
MAX_SURFACES = 6
# So far from a face the ray starts again, not to meet it twice.
STEP_M = 1e-4


@dataclass(frozen=True, eq=False, slots=True)
class Echoes:
    """The k echoes of a set of rays.

    Parameters
    ----------
    ray : (k,) array of int32
    distance : (k,) array of float32
        Metres along the whole way out.
    power : (k,) array of float32
        1 for white seen straight on at 1 m.
    face : (k,) array of int32
        What is seen in the ray's direction: for a mirrored image the mirror.
    seen_m : (k,) array of float32
        How far that face is.
    """

    ray: NDArray[np.int32]
    distance: Float32Array
    power: Float32Array
    face: NDArray[np.int32]
    seen_m: Float32Array


@dataclass(frozen=True, eq=False, slots=True)
class _Rays:
    """Rays on their way; `share` is what is left of their power, `mirror` -1 before they meet one."""

    number: NDArray[np.int32]
    start: NDArray[np.floating]
    along: Float32Array
    way_m: Float32Array
    share: Float32Array
    mirror: NDArray[np.int32]
    mirror_m: Float32Array


_Record = TypeVar("_Record", _Rays, Hits)


def echoes_along(caster: Caster, origins: ArrayLike, directions: Float32Array) -> Echoes:
    """Return the echoes of rays from (3,) or (n, 3) origins along (n, 3) unit vectors.

    The power of a diffuse surface is its reflectance times the cosine of incidence over the range
    squared: the range equation for targets larger than the beam, without the air (Hoefle and Pfeifer
    2007, doi:10.1016/j.isprsjprs.2007.05.008). The mirrored share adds a lobe (Phong 1975,
    doi:10.1145/360825.360839). From smooth surfaces the ray goes on, through them or mirrored, the way
    that carries more; a share is lost on the way out and again on the way back.
    """
    rays, found = _rays(origins, directions), []
    while len(rays.number) and len(found) < MAX_SURFACES:
        hits = caster(rays.start, rays.along)
        met = hits.face >= 0
        if not met.all():
            rays, hits = _chosen(rays, met), _chosen(hits, met)
        mirrored = _mirrored(caster, hits)
        found.append(_echoes(caster, rays, hits, mirrored))
        smooth = np.flatnonzero(caster.smooth[hits.face])
        rays = _sent_on(caster, _chosen(rays, smooth), _chosen(hits, smooth), mirrored[smooth])
    return joined_echoes(found) if found else _no_echoes()


def joined_echoes(parts: Sequence[Echoes]) -> Echoes:
    """Return the echoes of all parts."""
    names = [one.name for one in fields(Echoes)]
    return Echoes(*(np.concatenate([getattr(echoes, name) for echoes in parts]) for name in names))


def _no_echoes() -> Echoes:
    number, metres = np.empty(0, np.int32), np.empty(0, np.float32)
    return Echoes(number, metres, metres, number, metres)


def _rays(origins: ArrayLike, directions: Float32Array) -> _Rays:
    count = len(directions)
    start = np.broadcast_to(np.asarray(origins, np.float32), directions.shape)
    none, whole = np.zeros(count, np.float32), np.ones(count, np.float32)
    return _Rays(
        np.arange(count, dtype=np.int32), start, directions, none, whole, np.full(count, -1, np.int32), none
    )


def _chosen(record: _Record, which: NDArray) -> _Record:
    return type(record)(*(getattr(record, one.name)[which] for one in fields(record)))


def _mirrored(caster: Caster, hits: Hits) -> Float32Array:
    """Mirrored share; that of panes grows with the angle as Fresnel's (Schlick 1994,
    doi:10.1111/1467-8659.1330233).
    """
    share = caster.mesh.specular[hits.face]
    pane = np.flatnonzero(caster.mesh.transmission[hits.face] > 0)
    share[pane] += (1 - share[pane]) * (1 - hits.cosine[pane]) ** 5
    return share


def _echoes(caster: Caster, rays: _Rays, hits: Hits, mirrored: Float32Array) -> Echoes:
    sent: Float32Array = caster.mesh.reflectance[hits.face] * hits.cosine
    shiny = np.flatnonzero(mirrored)
    # White sends back 1 / pi of the power a steradian; a lobe of exponent n, (n + 2) / (2 pi).
    lobe = np.where(caster.smooth[hits.face[shiny]], np.float32(SMOOTH_LOBE), np.float32(GLOSSY_LOBE))
    back = np.maximum(2 * hits.cosine[shiny] ** 2 - 1, 0)
    sent[shiny] += mirrored[shiny] * (lobe / 2 + 1) * back**lobe * hits.cosine[shiny]
    way = rays.way_m + hits.distance
    power = rays.share * sent * np.maximum(way, np.float32(STEP_M)) ** np.float32(-2)
    is_image = rays.mirror >= 0
    face = np.where(is_image, rays.mirror, hits.face)
    return Echoes(rays.number, way, power, face, np.where(is_image, rays.mirror_m, way))


def _sent_on(caster: Caster, rays: _Rays, hits: Hits, mirrored: Float32Array) -> _Rays:
    """The rays from the smooth surfaces they met, through them or mirrored."""
    # The share that passes is given for rays straight on: what is mirrored more at an angle, passes less.
    straight = 1 - caster.mesh.specular[hits.face]
    passed = caster.mesh.transmission[hits.face] * (1 - mirrored) / np.maximum(straight, 1e-6)
    turns = mirrored > passed
    along = rays.along + np.where(turns, 2 * hits.cosine, np.float32(0))[:, None] * hits.normal
    start = rays.start + hits.distance[:, None] * rays.along + np.float32(STEP_M) * along
    way = rays.way_m + hits.distance
    first = turns & (rays.mirror < 0)
    return _Rays(
        rays.number,
        start,
        along,
        way,
        rays.share * np.where(turns, mirrored, passed) ** 2,
        np.where(first, hits.face, rays.mirror),
        np.where(first, way, rays.mirror_m),
    )
