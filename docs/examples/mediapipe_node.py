"""A camera and MediaPipe as a node: 21 landmarks of one hand to a RHOT master by UDP (docs/landmarks.md, docs/wire.md).

    python mediapipe_node.py --node-id 1 --camera 0 --model hand_landmarker.task

Run it in an environment of its own with mediapipe (its wheel replaces cv2); it needs nothing of RHOT. You place the
model file. The rig's node has this node id, this machine's address and udp_port, no public_key, and the marker set
landmarks21.
"""

from __future__ import annotations

import argparse
import math
import random
import socket
import struct
import time
import zlib

JOINTS = ("wrist", "thumb_cmc", "thumb_mcp", "thumb_ip", "thumb_tip",
          *(f"{finger}_{joint}" for finger in ("index", "middle", "ring", "little")
            for joint in ("mcp", "pip", "dip", "tip")))
CHECKSUM = zlib.crc32("\n".join(JOINTS).encode())
HEADER, OBSERVATIONS, CANDIDATE = struct.Struct("<4sBBHIQI"), struct.Struct("<qqIIIHHIIBBBB"), struct.Struct("<HH7f")
CLOCK_REPLY, START, ENTRY = struct.Struct("<qqqIB3s"), struct.Struct("<B3s"), struct.Struct("<IHHq")
OBSERVATION_TYPE, CLOCK_REQUEST_TYPE, CLOCK_REPLY_TYPE, START_TYPE, STOP_TYPE = 1, 2, 3, 4, 5
READY, STREAMING = 1, 2


class LandmarkNode:
    """Answers a master's start, stop and clock requests, and sends it landmarks."""

    def __init__(self, node_id: int, port: int = 47800) -> None:
        self.node_id, self.boot_id = node_id, random.getrandbits(32)
        self.session, self.sequence, self.master = 0, 0, None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("", port))
        self.socket.setblocking(False)

    def poll(self) -> None:
        """Answer what has arrived; call it at least every few milliseconds, or clocks are known less well."""
        while True:
            try:
                data, sender = self.socket.recvfrom(2048)
            except BlockingIOError:
                return
            received_ns = time.monotonic_ns()
            if len(data) < HEADER.size or data[:4] != b"RHOT":
                continue
            _, _, kind, flags, node_id, session, sequence = HEADER.unpack_from(data)
            body = data[HEADER.size:]
            if flags:
                continue  # tagged: of a paired node
            if kind == CLOCK_REQUEST_TYPE and node_id == self.node_id and len(body) == 8:
                state = STREAMING if self.session else READY
                header = HEADER.pack(b"RHOT", 1, CLOCK_REPLY_TYPE, 0, self.node_id, self.session, sequence)
                t1_ns = struct.unpack("<q", body)[0]
                self.socket.sendto(header + CLOCK_REPLY.pack(t1_ns, received_ns, time.monotonic_ns(), self.boot_id,
                                                             state, b""), sender)
            elif kind == START_TYPE and session != self.session and len(body) >= START.size:
                for k in range(min(body[0], (len(body) - START.size) // ENTRY.size)):
                    entry_id, port, _, _ = ENTRY.unpack_from(body, START.size + k * ENTRY.size)
                    if entry_id == self.node_id:
                        self.session, self.sequence, self.master = session, 0, (sender[0], port)
            elif kind == STOP_TYPE and session in (0, self.session):
                self.session, self.master = 0, None

    def send(self, frame: int, t_frame_ns: int, size: tuple[int, int], points: list[tuple[float, float]] | None,
             score: float, sigma_px: float) -> None:
        """Send the 21 `points`, px of the raw image with (0, 0) at the centre of its first pixel; None: no hand.

        `t_frame_ns`: mid-exposure, of time.monotonic_ns. `sigma_px`: standard deviation of a point per axis.
        """
        if self.master is None:
            return
        width, height = size
        found = [(k, x, y) for k, (x, y) in enumerate(points or ())
                 if math.isfinite(x + y) and -0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5]
        now_ns = time.monotonic_ns()
        header = HEADER.pack(b"RHOT", 2, OBSERVATION_TYPE, 0, self.node_id, self.session, self.sequence)
        about = OBSERVATIONS.pack(t_frame_ns, now_ns, min(now_ns - t_frame_ns, 2**32 - 1), 0, 0, width, height, frame,
                                  CHECKSUM, len(JOINTS), len(found), 0, 0)
        variance = sigma_px * sigma_px
        said = b"".join(CANDIDATE.pack(k, 0, x, y, 1.0, variance, 0.0, variance, score) for k, x, y in found)
        self.socket.sendto(header + about + said, self.master)
        self.sequence += 1


def main() -> None:
    """Film, find the hand, send its landmarks."""
    parser = argparse.ArgumentParser(description="A camera and MediaPipe as a RHOT node.")
    parser.add_argument("--node-id", type=int, required=True)
    parser.add_argument("--port", type=int, default=47800, help="the node's udp_port (default 47800)")
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--model", required=True, help="MediaPipe's hand landmark model; you place it")
    args = parser.parse_args()

    import cv2
    import mediapipe as mp

    vision = mp.tasks.vision
    detector = vision.HandLandmarker.create_from_options(vision.HandLandmarkerOptions(
        base_options=mp.tasks.BaseOptions(model_asset_path=args.model), running_mode=vision.RunningMode.VIDEO))
    camera, node, frame = cv2.VideoCapture(args.camera), LandmarkNode(args.node_id, args.port), 0
    while True:
        node.poll()
        there, bgr = camera.read()
        t_ns = time.monotonic_ns()  # later than mid-exposure by the camera's delay: see time_offset_s in the rig file
        if not there:
            raise SystemExit(f"Camera {args.camera} gives no images.")
        image = mp.Image(image_format=mp.ImageFormat.SRGB, data=cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB))
        result, height, width = detector.detect_for_video(image, t_ns // 1_000_000), *bgr.shape[:2]
        points, score = None, 0.0
        if result.hand_landmarks:
            points = [(one.x * width - 0.5, one.y * height - 0.5) for one in result.hand_landmarks[0]]
            score = float(result.handedness[0][0].score)
        node.poll()
        node.send(frame, t_ns, (width, height), points, score, sigma_px=0.5)
        frame += 1


if __name__ == "__main__":
    main()
