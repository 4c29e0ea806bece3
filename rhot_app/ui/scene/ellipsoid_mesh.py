"""Ellipsoids that say how well places are known: three standard deviations about joints, fingertips and markers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.skeleton import JOINTS, TIP_ROLES
from rhot_app.state import HandState, Knowledge
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.frames import to_display
from rhot_app.ui.scene.hand_mesh import TIPS, PosedMesh
from rhot_app.ui.scene.meshes import Faces, repeat_faces, sphere
from rhot_node.markers import MarkerSet

Array = NDArray[np.float64]
Colours = NDArray[np.uint8]

SIGMAS = 3.0
"""An ellipsoid of three standard deviations holds a place in space in 97 of 100 cases."""

LARGEST_M = 0.06
"""No half axis is drawn longer: a guess that may be anywhere would hide everything."""

LARGER = 10
"""The other choice beside true size: a good place is known to a millimetre, which is too small to see from afar."""

_ALPHA, _GUESSED_ALPHA = 90, 26
"""How solid: the ellipsoid of a guess is large, so that only its rim may stand out from the hand inside."""

_FINGER_M = 0.009
"""Half the breadth of a finger: an ellipsoid that is larger than what it belongs to is fainter by as much."""

_INNER = np.array([k for k in range(len(JOINTS)) if k not in TIPS])
_TIPS = np.array(TIPS)


@dataclass(frozen=True, slots=True)
class EllipsoidChoice:
    """Which ellipsoids are drawn, and how many times as large as they are."""

    joints: bool = True
    fingertips: bool = True
    markers: bool = True
    factor: int = 1

    @property
    def any(self) -> bool:
        """Whether there is anything to draw."""
        return self.joints or self.fingertips or self.markers


class EllipsoidMesh:
    """16 inner joints, 5 fingertips, then the rig's markers. Fingertips have their marker's colour.

    `cut` says whether the last `pose` drew any smaller than it is.
    """

    def __init__(self, markers: MarkerSet, scheme: Scheme) -> None:
        self._sphere = sphere(10, 2)
        roles = [marker.role for marker in markers.markers]
        self._tip_markers = np.array([role in TIP_ROLES for role in roles], bool)
        painted = {marker.role: marker.display_rgb for marker in markers.markers}
        rows = [rgb_of(scheme.accent)] * len(_INNER)
        rows += [painted.get(role, rgb_of(scheme.accent)) for role in TIP_ROLES]
        rows += [marker.display_rgb for marker in markers.markers]
        count = len(self._sphere.vertices)
        self.faces: Faces = repeat_faces(self._sphere.faces, count, len(rows))
        self._colours: Colours = np.repeat(np.array([(*rgb, _ALPHA) for rgb in rows], np.uint8), count, axis=0)
        self._solid = np.ones(len(rows))
        self.cut = False

    def pose(self, state: HandState, choice: EllipsoidChoice) -> PosedMesh:
        """The ellipsoids at `state`; what is not chosen or not known collapses to a point."""
        places = np.concatenate([state.joint_positions[_INNER], state.fingertip_positions, state.marker_positions])
        covariances = np.concatenate([state.joint_covariances[_INNER], state.fingertip_covariances,
                                      state.marker_covariances])
        known = np.isfinite(covariances).all(axis=(1, 2)) & np.isfinite(places).all(axis=1)
        shown = known & self._chosen(state, choice)
        values, axes = np.linalg.eigh(np.where(shown[:, None, None], covariances, 0.0))
        semi = choice.factor * SIGMAS * np.sqrt(np.maximum(values, 1e-12))
        self.cut = bool((semi[shown] > LARGEST_M).any())
        semi = np.minimum(semi, LARGEST_M)
        self._solid = np.clip(_FINGER_M / semi.max(axis=1), _GUESSED_ALPHA / _ALPHA, 1.0)
        vertices, normals = self._stretched(axes, semi)
        centres = np.where(shown[:, None], places, 0.0)[:, None]
        vertices = centres + shown[:, None, None] * vertices
        knowledge = np.concatenate([state.joint_knowledge[_INNER], state.joint_knowledge[_TIPS],
                                    state.marker_knowledge]).astype(np.uint8)
        return PosedMesh(to_display(vertices.reshape(-1, 3)), to_display(normals.reshape(-1, 3)),
                         np.repeat(knowledge, len(self._sphere.vertices)))

    def colours(self, posed: PosedMesh) -> Colours:
        """(N, 4) bytes of the ellipsoids posed last: fainter where they are large or guessed."""
        shown = self._colours.copy()
        shown[:, 3] = np.repeat(np.rint(_ALPHA * self._solid), len(self._sphere.vertices))
        shown[posed.knowledge == Knowledge.GUESSED, 3] = _GUESSED_ALPHA
        return shown

    def _chosen(self, state: HandState, choice: EllipsoidChoice) -> NDArray[np.bool_]:
        """Which are wanted. A painted fingertip is one place: its marker's ellipsoid would flicker in the tip's own."""
        estimated = bool(np.isfinite(state.fingertip_covariances).any())
        markers = np.full(len(state.marker_ids), choice.markers)
        if choice.fingertips and estimated:
            markers &= ~self._tip_markers
        return np.concatenate([np.full(len(_INNER), choice.joints), np.full(len(_TIPS), choice.fingertips), markers])

    def _stretched(self, axes: Array, semi: Array) -> tuple[Array, Array]:
        """Vertices and unit normals, each (N, V, 3), of spheres stretched by `semi` (N, 3) along `axes` (N, 3, 3)."""
        local = self._sphere.vertices
        vertices = local @ (axes * semi[:, None, :]).transpose(0, 2, 1)
        normals = local @ (axes / semi[:, None, :]).transpose(0, 2, 1)
        return vertices, normals / np.linalg.norm(normals, axis=2, keepdims=True)
