"""Draws objects other than people into images: dark and light slabs, sheets with lines, jars of pens, blobs, and desks with
screens.

Photos of people contain few desks, screens and shelves; a network trained on them alone detects upright coloured objects and large
dark ones as people. The shapes are simple on purpose: none of them resembles a person.
"""

import cv2
import numpy as np


def paint(rng):
    """Returns a random colour; half of all objects are grey or nearly grey."""
    value = rng.choice([rng.uniform(0, 60), rng.uniform(0, 255), rng.uniform(190, 255)])
    spread = rng.choice([6.0, 90.0])
    return tuple(np.clip(value + rng.uniform(-spread, spread, 3), 0, 255).tolist())


def slab(rng, image, centre, size):
    """Draws a rotated rectangle, sometimes in perspective, with a rim: screens, boxes, books, shelves."""
    turn = np.radians(rng.normal(0, 12))
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (1 + rng.normal(0, 0.08, (4, 2)))
    corners = np.rint(centre + (corners * size / 2) @ axes).astype(np.int32)
    cv2.fillConvexPoly(image, corners, paint(rng), cv2.LINE_AA)
    if rng.random() < 0.6:
        cv2.polylines(image, [corners], True, paint(rng), int(rng.integers(1, 6)), cv2.LINE_AA)
    return corners


def sheet(rng, image, centre, size):
    """Draws a slab with lines: pages, keyboards, racks."""
    a, b, c, d = slab(rng, image, centre, size).astype(float)
    colour, rows = paint(rng), int(rng.integers(2, 14))
    for row in (np.arange(rows) + 0.5) / rows:
        start, end = a + (d - a) * row, b + (c - b) * row
        left, right = rng.uniform(0.02, 0.2), rng.uniform(0.5, 0.98)
        at = lambda share: np.rint(start + (end - start) * share).astype(int).tolist()
        cv2.line(image, at(left), at(right), colour, int(rng.integers(1, 4)), cv2.LINE_AA)


def jar(rng, image, centre, size):
    """Draws a bundle of coloured sticks in a vessel: pens, tools, bottles, cables."""
    foot = centre + (0, 0.1 * size[1])
    for _ in range(rng.integers(2, 12)):
        tip = centre + rng.uniform(-0.5, 0.5, 2) * size * (1, 0.3) - (0, 0.4 * size[1])
        base = foot + rng.uniform(-0.3, 0.3, 2) * size * (1, 0.2)
        colour, width = paint(rng), max(1, int(size[0] * rng.uniform(0.04, 0.2)))
        cv2.line(image, np.rint(base).astype(int).tolist(), np.rint(tip).astype(int).tolist(), colour, width, cv2.LINE_AA)
    slab(rng, image, foot + (0, 0.2 * size[1]), size * (0.8, 0.5))


def blob(rng, image, centre, size):
    """Draws an ellipse, shaded by a second one: cups, lamps, fruit, wheels, bags."""
    angle = float(rng.uniform(0, 180))
    for share in (1.0, rng.uniform(0.4, 0.9)):
        axes = np.maximum(size * share / 2, 1).astype(int).tolist()
        cv2.ellipse(image, np.rint(centre).astype(int).tolist(), axes, angle, 0, 360, paint(rng), -1, cv2.LINE_AA)


def screen(rng, image, centre, size):
    """Draws a dark or bright slab in a rim on a foot, sometimes with windows on it."""
    foot = centre + (0, 0.62 * size[1])
    blob(rng, image, foot, size * (rng.uniform(0.2, 0.5), 0.25))
    edge = size * rng.uniform(1.02, 1.15)
    slab(rng, image, centre, edge)
    corners = np.rint(centre + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size / 2).astype(np.int32)
    cv2.fillConvexPoly(image, corners, paint(rng) if rng.random() < 0.4 else (float(rng.uniform(0, 50)),) * 3, cv2.LINE_AA)
    for _ in range(rng.integers(0, 4) if rng.random() < 0.4 else 0):
        sheet(rng, image, centre + rng.uniform(-0.25, 0.25, 2) * size, size * rng.uniform(0.2, 0.5, 2))


def desk(rng, image):
    """Returns a copy of an image without people with a desk in the foreground that fills much of it, as in the view of a robot in
    an office."""
    image, side = np.ascontiguousarray(image).copy(), image.shape[0]
    top = rng.uniform(-0.2, 0.7) * side
    slab(rng, image, np.array([0.5 * side, 0.5 * (top + 1.3 * side)]), np.array([1.8 * side, 1.3 * side - top]))
    for x in np.sort(rng.uniform(-0.1, 1.1, rng.integers(0, 4))):
        size = side * rng.uniform(0.25, 0.9) * np.array([1, rng.uniform(0.55, 0.85)])
        screen(rng, image, np.array([x * side, top + rng.uniform(-0.4, 0.6) * size[1]]), size)
    for _ in range(rng.integers(0, 4)):
        size = side * rng.uniform(0.1, 0.6) * np.array([1, rng.uniform(0.25, 0.8)])
        sheet(rng, image, np.array([rng.uniform(0, side), rng.uniform(max(top, 0), 1.1 * side)]), size)
    light = cv2.resize(np.exp(rng.normal(0, 0.2, (5, 5))).astype(np.float32), (side, side), interpolation=cv2.INTER_CUBIC)
    return cv2.multiply(image, cv2.merge([light] * 3), dtype=cv2.CV_8U)


def hides(centre, size, boxes):
    """Returns whether an object would cover more than a fifth of any person; boxes [n, 4] in px."""
    low, high = np.maximum(centre - 0.6 * size, boxes[:, :2]), np.minimum(centre + 0.6 * size, boxes[:, 2:])
    return (np.maximum(high - low, 0).prod(1) > 0.2 * (boxes[:, 2:] - boxes[:, :2]).prod(1)).any()


def cover(rng, image, boxes):
    """Returns a copy of the square image with all people in `boxes` (relative) hidden."""
    image = np.ascontiguousarray(image).copy()
    for low, high in boxes[:, 1:5].reshape(-1, 2, 2) * image.shape[0]:
        (slab, sheet)[rng.integers(2)](rng, image, (low + high) / 2, (high - low) * rng.uniform(1.4, 1.8, 2))
    return image


def strew(rng, image, boxes):
    """Returns a copy of the square image with up to 16 objects, the larger ones first, beside the people in `boxes` (relative).
    Images with people need them too, or drawn objects would indicate that there are no people."""
    image = np.ascontiguousarray(image).copy()
    count = int(rng.integers(2, 17))
    sides = np.sort(np.exp(rng.uniform(np.log(0.06), np.log(0.8), count)))[::-1] * image.shape[0]
    for side in sides:
        thing = (slab, sheet, jar, blob)[rng.integers(4)]
        centre, size = rng.uniform(0, image.shape[0], 2), side * np.exp(rng.normal(0, 0.35, 2))
        if not hides(centre, size, boxes[:, 1:5] * image.shape[0]):
            thing(rng, image, centre, size)
    return image
