"""A minute of a hand whose bones are known: markers on its skin, moving freely, seen with noise. No cameras."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from scipy.special import erf

from rhot_app.calibration.hand import marker_places as hand_prior
from rhot_app.calibration.hand.bundle_model import Poses, expected
from rhot_app.calibration.hand.marker_places import PALM, MarkerPlace, MarkerTracks
from rhot_app.calibration.hand.shape import MARKERS, HandUnknowns
from rhot_app.estimation.se3 import exp_so3
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, BONES, FINGERS, FLEXIONS
from rhot_node.files import resource_path

TRIAD = tuple(MarkerPlace(f"palm_{k}", PALM, PALM) for k in range(1, 4))
RICH = (*TRIAD, *(MarkerPlace(f"{finger}_{bone}", f, b, painted=b == 2)
                  for f, finger in enumerate(FINGERS) for b, bone in enumerate(BONES[f])))
SIX = (*(MarkerPlace(f"{finger}_tip", f, 2, painted=True) for f, finger in enumerate(FINGERS)),
       MarkerPlace("wrist", PALM, PALM, painted=True))


def base_hand(side: str = "right") -> HandAnatomy:
    return load_hand(resource_path("hands", f"{side}.json"))


def person(seed: int, size: float | None = None, side: str = "right") -> HandAnatomy:
    """Somebody's hand: size and proportions drawn from what is known of adults, or of the given size."""
    rng = np.random.default_rng([seed, 0xB0])
    base = base_hand(side)
    size = float(rng.normal(1.0, hand_prior.SIZE_SD)) if size is None else size
    bones_sd, roots_sd = hand_prior.proportion_sd(), hand_prior.root_proportion_sd()
    fingers = {}
    for k, name in enumerate(FINGERS):
        finger = base.fingers[name]
        bones = size * np.array(finger.bones_mm) * (1.0 + bones_sd[k] * np.clip(rng.normal(size=3), -2, 2))
        root = size * np.array(finger.base_mm) * (1.0 + roots_sd[k] * rng.normal()) + rng.normal(0, 2.0, 3)
        turn = np.array(finger.base_rotation_deg) + rng.normal(0, 3.0, 3)
        fingers[name] = msgspec.structs.replace(
            finger, bones_mm=tuple(bones.tolist()), base_mm=tuple(root.tolist()),
            base_rotation_deg=tuple(turn.tolist()),
            radii_mm=tuple((size * np.array(finger.radii_mm)).tolist()), marker_mm=0.5 * float(bones[2]))
    return msgspec.structs.replace(base, fingers=fingers, name="somebody")


def scaled(hand: HandAnatomy, size: float) -> HandAnatomy:
    """The same hand in another size."""
    fingers = {name: msgspec.structs.replace(
        finger, bones_mm=tuple(size * b for b in finger.bones_mm), base_mm=tuple(size * b for b in finger.base_mm),
        radii_mm=tuple(size * r for r in finger.radii_mm), marker_mm=size * finger.marker_mm)
        for name, finger in hand.fingers.items()}
    return msgspec.structs.replace(hand, fingers=fingers)


@dataclass(frozen=True)
class Sloppiness:
    """How the markers are seen: noise per axis, skin sliding along the bone with full flexion, dropped samples."""

    noise_m: float = 0.4e-3
    skin_m: float = 0.3e-3
    missing: float = 0.02


SLOPPY = Sloppiness()


def free_movement(hand: HandAnatomy, seconds: float, rate_hz: float, seed: int) -> tuple[np.ndarray, Poses]:
    """Times (T,) s and poses of a hand that opens, closes, spreads and turns: each finger in its own rhythm."""
    rng = np.random.default_rng([seed, 0x3A])
    model = build_model(hand)
    times = np.arange(int(seconds * rate_hz)) / rate_hz
    low, high = model.limits.T
    angles = np.empty((len(times), len(ANGLES)))

    def saturated(values: np.ndarray) -> np.ndarray:
        """0..1, resting near both ends, and smooth as hands are."""
        return 0.5 + 0.5 * erf(values)

    def wave(slowest: float = 0.15, fastest: float = 0.6) -> np.ndarray:
        parts = [np.sin(2 * np.pi * rng.uniform(slowest, fastest) * times + rng.uniform(0, 2 * np.pi))
                 for _ in range(2)]
        return saturated(0.9 * sum(parts))

    fist = wave()
    for k, name in enumerate(ANGLES):
        if name.endswith("dip_flexion"):
            angles[:, k] = 2.0 / 3.0 * angles[:, k - 1] + np.radians(8.0) * (wave() - 0.5)
        elif name.endswith("flexion"):
            closing = saturated(4.0 * (0.6 * fist + 0.4 * wave() - 0.5))
            angles[:, k] = 0.95 * high[k] * closing if low[k] > -0.2 else low[k] + (high[k] - low[k]) * wave()
        else:
            angles[:, k] = 0.7 * (low[k] + (high[k] - low[k]) * wave())
    angles = np.clip(angles, low, high)
    turns = np.radians(40.0) * np.stack([wave() - 0.5 for _ in range(3)], axis=1)
    world = np.tile(np.eye(4), (len(times), 1, 1))
    world[:, :3, :3] = [exp_so3(turn) for turn in 2.0 * turns]
    world[:, :3, 3] = 0.1 * np.stack([wave() - 0.5 for _ in range(3)], axis=1) + [0.0, 0.0, 0.6]
    return times, Poses(world, angles)


def record(hand: HandAnatomy, places: tuple[MarkerPlace, ...], seed: int = 1, *, seconds: float = 60.0,
           rate_hz: float = 60.0, sloppiness: Sloppiness = SLOPPY,
           movement: tuple[np.ndarray, Poses] | None = None) -> MarkerTracks:
    """The markers of this hand over a minute."""
    rng = np.random.default_rng([seed, 0xC1])
    times, poses = free_movement(hand, seconds, rate_hz, seed) if movement is None else movement
    right = msgspec.structs.replace(hand, side="right")
    unknowns = HandUnknowns(right, places)
    vector = unknowns.prior.mean.copy()
    worn = vector[MARKERS:unknowns.slides].reshape(-1, 3)
    for k, place in enumerate(places):
        if place.on_palm and not place.painted:
            worn[k] = np.array([[50.0, 15.0, 14.0], [75.0, -5.0, 15.0], [35.0, -20.0, 13.0]])[k % 3] * 1e-3
            worn[k] += rng.normal(0, 4e-3, 3)
        elif not place.painted:
            worn[k] += rng.normal(0, 1.0, 3) * [4e-3, 2e-3, 1.5e-3]
    positions = expected(unknowns, vector, poses)
    for k, place in enumerate(places):  # skin slides over a bent joint; paint all over a bone only stretches
        if not place.on_palm and not place.painted:
            bent = 1.0 - np.cos(poses.angles[:, FLEXIONS[place.finger][place.segment]])
            along = np.zeros_like(vector)
            along[MARKERS + 3 * k] = 1e-3
            positions[:, k] += bent[:, None] * sloppiness.skin_m / 1e-3 * (
                expected(unknowns, vector + along, poses) - expected(unknowns, vector, poses))[:, k]
    positions += rng.normal(0, sloppiness.noise_m, positions.shape)
    positions[rng.random(positions.shape[:2]) < sloppiness.missing] = np.nan
    if hand.side == "left":
        positions[..., 1] *= -1.0
    return MarkerTracks(times, positions, places)


def bones_mm(hand: HandAnatomy) -> np.ndarray:
    """(5, 3) mm."""
    return np.array([hand.fingers[name].bones_mm for name in FINGERS])
