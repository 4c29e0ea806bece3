"""Kalibr's ``camchain.yaml``: cameras cam0, cam1 and so on, in metres. T_cn_cnm1 takes the coordinates of the camera
before to this one's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot_app.calibration.exchange.documents import Entry, listed
from rhot_app.calibration.exchange.records import ForeignCamera, Stated, lens_of, radial_tangential, refuse_model
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import inverse
from rhot_app.project import Intrinsics


def read(documents: Sequence[Entry], stated: Stated) -> list[ForeignCamera]:
    """The cameras of one file; the first one is the world. Raises CalibrationError."""
    if len(documents) != 1:
        raise CalibrationError(f"{documents[1].file}: give one camchain file.")
    (chain,) = documents
    stated.refuse_unit(chain, "Kalibr")
    entries = [chain[f"cam{k}"] for k in range(sum(key.startswith("cam") for key in chain.value))]
    topics = [_topic(one) for one in entries]
    names = topics if all(topics) and len(set(topics)) == len(topics) else [one.place for one in entries]
    cameras, pose = [], np.eye(4)
    for k, (name, camera) in enumerate(zip(names, entries, strict=True)):
        pose = camera["T_cn_cnm1"].transform() @ pose if k else pose
        cameras.append(ForeignCamera(name, _read_lens(camera), pose))
    return cameras if len(cameras) > 1 else [ForeignCamera(cameras[0].name, cameras[0].lens)]


def _topic(camera: Entry) -> str:
    """The first part of a camera's topic, "left" of /left/image_raw; empty without one."""
    return camera["rostopic"].text.strip("/").partition("/")[0] if camera.has("rostopic") else ""


def _read_lens(camera: Entry) -> Intrinsics:
    model = camera["camera_model"].text
    distortion = camera["distortion_model"].text if camera.has("distortion_model") else "none"
    for name, known in ((model, ("pinhole",)), (distortion, ("radtan", "none"))):
        if name not in known:
            raise refuse_model(camera, name)
    coefficients = np.zeros(0) if distortion == "none" else camera["distortion_coeffs"].numbers(4)
    width, height = (int(side) for side in camera["resolution"].numbers(2))
    return lens_of(camera, (width, height), camera["intrinsics"].numbers(4), coefficients)


def write(cameras: Sequence[ForeignCamera], unit_m: float) -> dict[str, str]:
    """One file of all cameras. Raises CalibrationError where a lens has more than k1, k2, p1, p2."""
    lines: list[str] = []
    for k, camera in enumerate(cameras):
        lens = camera.lens
        lines += [f"cam{k}:", "  cam_overlaps: []", "  camera_model: pinhole", "  distortion_model: radtan",
                  f"  distortion_coeffs: {listed(radial_tangential(camera, 'Kalibr'))}",
                  f"  intrinsics: {listed(np.array([lens.fx, lens.fy, lens.cx, lens.cy]))}",
                  f"  resolution: [{lens.width}, {lens.height}]", f'  rostopic: "/{camera.name}/image_raw"']
        if k:
            before = cameras[k - 1].camera_from_world
            assert before is not None and camera.camera_from_world is not None
            lines += ["  T_cn_cnm1:", *(f"  - {listed(row)}" for row in camera.camera_from_world @ inverse(before))]
    return {"": "\n".join([*lines, ""])}

