"""What each term on the screen means, in one or two sentences: the tooltips."""

from __future__ import annotations

TERMS: dict[str, str] = {
    "condition": "The state of the whole rig in one word: IDLE, SEARCHING, TRACKING, PARTIAL, LOST or FAULT.",
    "state rate": "How many hand states per second the engine publishes.",
    "rig": "The rig file: cameras, lenses, marker set, hand and filters.",
    "node": "A small computer with a camera. It finds the markers in its picture and sends their places.",
    "node rate": "Frames per second that arrive from this node.",
    "lost": "Frames that were not used since the start, shown when they are more than one in a hundred. The hint of "
            "the card says why.",
    "dropped": "Datagrams that arrived and were rejected, with the reason.",
    "clock": "How well the node's clock is known: the true offset lies within this bound of the estimate. "
             "1 ms at 1 m/s is 1 mm.",
    "marker": "A coloured spot on the hand: five painted fingertips and a wrist band.",
    "jitter": "How much a marker trembles: rms over the last second of its raw position, motion removed by third "
              "differences. It includes depth, which is the noisiest direction. There is no figure below about ten "
              "states per second.",
    "latency": "How long each stage took for one state: median (p50) and 99th percentile (p99) of the last two "
               "seconds. Bands are stacked medians; the lines are the whole way of each state.",
    "budget": "11.1 ms is one frame at 90 fps, the rate the thesis aims at.",
    "detect": "From the frame being available on the node to the datagram being sent.",
    "network": "From the node's send to the receive time of the master's kernel, by the estimated clocks.",
    "pair": "Waiting until both cameras have seen a time after the state's instant.",
    "triangulate": "From two pixels to a point in space.",
    "filter": "The 1-euro filter before and after depth.",
    "solve": "From points to the hand's joints.",
    "publish": "From the finished state to the clients.",
    "rate": "States per second and frames per second of each node; bars show lost datagrams per second.",
    "fingertip difference": "How far the fingertips of the two runs are apart at the same instant, in mm. p50 and p95 "
                            "are over the whole recording.",
    "measured": "Seen by enough cameras at this instant. Drawn solid.",
    "inferred": "Follows from what is measured through the hand model, or from a half-hidden sight. "
                "Drawn translucent.",
    "guessed": "The images do not determine it: the last or the most natural value. Drawn hatched.",
    "flexion": "Bending towards the palm, in degrees; 0 is a straight finger.",
    "abduction": "Spreading towards the thumb's side, in degrees.",
    "CMC": "Carpometacarpal joint: the thumb's base, at the wrist.",
    "MCP": "Metacarpophalangeal joint: the knuckle.",
    "PIP": "Proximal interphalangeal joint: the middle joint of a finger.",
    "DIP": "Distal interphalangeal joint: the last joint of a finger.",
    "IP": "Interphalangeal joint: the last joint of the thumb.",
    "covariance": "An ellipsoid of three sigma holds the true place with 97 % probability.",
    "worst axis": "Standard deviation (one sigma) of the place along the axis in which it is known worst, in mm.",
    "palm": "How well the palm's place and turn are known: standard deviations along the worst axes.",
    "hand size": "Estimated size of the hand as a factor on every length of the rig's hand (Calibrate, Tracker).",
    "epipolar error": "How far the two cameras' rays miss each other, in pixels. Above one pixel, check calibration.",
}


def tip(term: str) -> str:
    """Tooltip of a term; raises KeyError for a term that has no explanation, so that none is forgotten."""
    return TERMS[term]
