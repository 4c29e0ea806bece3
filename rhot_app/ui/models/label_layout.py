"""Where labels go so that they neither cover each other nor leave the picture."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]

_BETWEEN_PX = 2.0


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle by its top-left corner and size, px."""

    x: float
    y: float
    width: float
    height: float

    def overlaps(self, other: Box) -> bool:
        """Whether the two share any area."""
        return (self.x < other.x + other.width and other.x < self.x + self.width
                and self.y < other.y + other.height and other.y < self.y + self.height)

    def nearest(self, point: Point) -> Point:
        """The point of the rectangle that is nearest to `point`."""
        return min(max(point[0], self.x), self.x + self.width), min(max(point[1], self.y), self.y + self.height)

    def covers(self, point: Point, reach: float) -> bool:
        """Whether a mark at `point` that reaches so far to all sides touches it."""
        return (self.x - reach < point[0] < self.x + self.width + reach
                and self.y - reach < point[1] < self.y + self.height + reach)

    def inside(self, width: float, height: float) -> bool:
        """Whether it lies wholly in a picture of that size."""
        return self.x >= 0 and self.y >= 0 and self.x + self.width <= width and self.y + self.height <= height


def place_labels(anchors: list[Point], sizes: list[Point], picture: Point, gap: float) -> list[Box]:
    """A box for each label near its anchor and clear of the other anchors; earlier labels choose first.

    Tried in turn: right, left, above, below, and the same farther away. When nothing is free the first choice is
    taken, covered or not: a label in the wrong place would be worse.
    """
    placed: list[Box] = []
    for own, ((x, y), (width, height)) in enumerate(zip(anchors, sizes, strict=True)):
        others = [anchor for k, anchor in enumerate(anchors) if k != own]
        choices = [box for far in (1.0, 2.0, 3.5)
                   for box in _around(x, y, width, height, far * gap, height * (far - 1))]
        free = (box for box in choices
                if box.inside(*picture) and not any(box.overlaps(other) for other in placed)
                and not any(box.covers(anchor, 0.6 * gap) for anchor in others))
        placed.append(next(free, choices[0]))
    return placed


def _around(x: float, y: float, width: float, height: float, gap: float, rise: float) -> list[Box]:
    middle = y - 0.5 * height
    boxes = [Box(x + gap, middle, width, height), Box(x - gap - width, middle, width, height)]
    if rise:
        boxes += [Box(x + gap, middle + sign * rise, width, height) for sign in (-1, 1)]
        boxes += [Box(x - gap - width, middle + sign * rise, width, height) for sign in (-1, 1)]
    return [*boxes, Box(x - 0.5 * width, y - gap - height, width, height), Box(x - 0.5 * width, y + gap, width, height)]


def place_at_sides(anchors: list[Point], sizes: list[Point], picture: Point, margin: float) -> list[Box]:
    """A box for each label in a column at the left or right edge, for pictures too small to have room between anchors.

    Each column takes the anchors of its half, in their order from top to bottom, so that the lines to them do not
    cross. Labels of one column never overlap as long as the picture is tall enough for them one above the other.
    """
    boxes = [Box(0.0, 0.0, 0.0, 0.0)] * len(anchors)
    by_x = sorted(range(len(anchors)), key=lambda k: anchors[k][0])
    half = (len(by_x) + 1) // 2
    for column, right in ((by_x[:half], False), (by_x[half:], True)):
        column.sort(key=lambda k: anchors[k][1])
        heights = [sizes[k][1] for k in column]
        wanted = [anchors[k][1] - 0.5 * height for k, height in zip(column, heights, strict=True)]
        for k, y in zip(column, _stack(wanted, heights, margin, picture[1] - margin), strict=True):
            width, height = sizes[k]
            boxes[k] = Box(picture[0] - margin - width if right else margin, y, width, height)
    return boxes


def _stack(wanted: list[float], heights: list[float], low: float, high: float) -> list[float]:
    """Upper ends near those `wanted` (in rising order), one below the other, first pushed down and then up."""
    tops: list[float] = []
    floor = low
    for y, height in zip(wanted, heights, strict=True):
        tops.append(max(y, floor))
        floor = tops[-1] + height + _BETWEEN_PX
    ceiling = high
    for k in reversed(range(len(tops))):
        tops[k] = min(tops[k], ceiling - heights[k])
        ceiling = tops[k] - _BETWEEN_PX
    return tops
