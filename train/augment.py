"""Augments training images and their boxes; every random draw comes from the generator that is passed in.

Geometry is one affine warp per image (stretch, rotation, mirror, zoom, shift), so that nothing is interpolated twice. A rotated box
is bounded by its inscribed ellipse and not by its corners: people fill the ellipse, and corners would make boxes up to 40 % too
large. A mosaic (Bochkovskiy et al., 2020) fills four parts of the canvas with four images.
"""

import cv2
import numpy as np

from . import clutter

VISIBLE = 0.1  # share of a box that must remain for it to count; otherwise its region is ignored
LEAST_SIDE = 9.0  # px
CLOSE = 0.5  # share of the images with people, except mosaics, with a close person, mostly cut by the left or the right edge
CLUTTER = 0.8  # share of the images without people that get drawn objects, and half this share of those with people
DESK = 0.3  # share of the parts without people with a drawn desk in the foreground
ROOM_PART, ROOM_CLUTTER = 0.35, 0.2  # shares of the photos of rooms that are reduced to a part, and that get drawn objects


def angle(rng):
    """Draws the camera roll, degrees: mostly upright, often up to 45, sometimes up to 100."""
    kind = rng.random()
    if kind < 0.55:
        return rng.normal(0, 5)
    return rng.uniform(-45, 45) if kind < 0.9 else rng.uniform(-100, 100)


def matrix(rng, boxes, source, width, height, zoom, theta, cut=False):
    """Returns the affine map from a square image of `source` px onto a width x height canvas; with `cut` its left or right edge
    cuts a person."""
    scale = zoom * np.sqrt(width * height) / source
    before, after = np.exp(rng.uniform(-0.25, 0.35)), np.exp(rng.uniform(-0.4, 0.2))
    cos, sin = np.cos(np.radians(theta)), np.sin(np.radians(theta))
    flip = 1.0 if rng.random() < 0.5 else -1.0
    turn = np.array([[cos, -sin], [sin, cos]])
    linear = scale * np.diag([after**0.5, after**-0.5]) @ turn @ np.diag([flip * before**0.5, before**-0.5])
    # a point of the image, mostly on a person, goes to a random point of the canvas, so that people are cut by every edge
    anchor = rng.uniform(0, source, 2)
    if len(boxes) and (cut or rng.random() < 0.7):
        x0, y0, x1, y1 = boxes[rng.integers(len(boxes)), 1:5] * source
        margin = 0.12 if cut else 0.0  # less than an eighth of a box may contain no visible part of the person
        anchor = np.array([x0, y0]) + rng.uniform(margin, 1 - margin, 2) * (x1 - x0, y1 - y0)
    size = np.array([width, height], float)
    goal = rng.uniform(0, 1, 2) * size
    if cut:  # by the edge on the same side of the image; otherwise the image would have to end within the canvas
        goal[0] = 0 if (linear @ (anchor - source / 2))[0] < 0 else width
    shift = goal - linear @ anchor
    # no unnecessary border: an image larger than the canvas covers it, a smaller one lies within
    corners = linear @ (np.array([[0, 1, 0, 1], [0, 0, 1, 1]]) * source)
    low, high = corners.min(1), corners.max(1)
    bounds = np.sort(np.stack([-low, size - high]), axis=0)
    shift = np.clip(shift, bounds[0], bounds[1])
    return np.column_stack([linear, shift])


def place(boxes, affine, source, region):
    """Returns the boxes on the canvas, clipped at `region` (x0, y0, x1, y1), and the regions to ignore: the remains of people
    nearly outside."""
    if not len(boxes):
        return boxes.reshape(0, 5), np.zeros((0, 4))
    centre = (boxes[:, 1:3] + boxes[:, 3:5]) / 2 * source @ affine[:, :2].T + affine[:, 2]
    half = (boxes[:, 3:5] - boxes[:, 1:3]) / 2 * source
    reach = np.sqrt(half**2 @ (affine[:, :2] ** 2).T)
    whole = np.concatenate([centre - reach, centre + reach], 1)
    low, high = np.maximum(whole[:, :2], region[:2]), np.minimum(whole[:, 2:], region[2:])
    sides = np.maximum(high - low, 0)
    left = sides.prod(1) / (whole[:, 2:] - whole[:, :2]).prod(1)
    inside = sides.min(1) > 0
    good = inside & (left > VISIBLE) & (sides.min(1) > LEAST_SIDE)
    cut = np.concatenate([low, high], 1)
    return np.column_stack([boxes[good, 0], cut[good]]), cut[inside & ~good]


def colour(rng, image):
    """Changes exposure, contrast, white balance, saturation and hue with one linear map, then applies a gamma curve."""
    grey = np.full((3, 3), 1.0) * np.array([0.114, 0.587, 0.299])
    saturation = 0.0 if rng.random() < 0.06 else np.exp(rng.uniform(-0.7, 0.4))
    mix = saturation * np.eye(3) + (1 - saturation) * grey
    hue = rng.uniform(-0.15, 0.15) * np.array([[0, 1, -1], [-1, 0, 1], [1, -1, 0]])
    gains = np.exp(rng.normal(0, 0.07, 3) + rng.normal(-0.05, 0.2))
    linear = np.diag(gains) @ (mix + saturation * hue)
    contrast = np.exp(rng.normal(0, 0.15))
    offset = (1 - contrast) * 128 + rng.normal(0, 8)
    image = cv2.transform(image, np.column_stack([linear * contrast, np.full(3, offset)]).astype(np.float32))
    if rng.random() < 0.4:
        curve = 255 * (np.arange(256) / 255) ** np.exp(rng.normal(0, 0.3))
        image = cv2.LUT(image, curve.astype(np.uint8))
    return image


def spoil(rng, image):
    """Adds the errors of a cheap moving camera: motion and focus blur, coarse pixels, noise, JPEG."""
    kind = rng.random()
    if kind < 0.12:
        length, direction = int(rng.integers(3, 10)), rng.uniform(0, np.pi)
        kernel = np.zeros((length, length), np.float32)
        end = (length - 1) / 2 * np.array([np.cos(direction), np.sin(direction)])
        middle = np.full(2, (length - 1) / 2)
        cv2.line(kernel, np.rint(middle - end).astype(int).tolist(), np.rint(middle + end).astype(int).tolist(), 1.0)
        image = cv2.filter2D(image, -1, kernel / kernel.sum())
    elif kind < 0.2:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.5, 1.8))
    elif kind < 0.28:
        small = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        image = cv2.resize(small, image.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    if rng.random() < 0.15:
        noise = rng.normal(0, rng.uniform(2, 14), image.shape[:2] + (1,) if rng.random() < 0.5 else image.shape)
        image = np.clip(image + noise, 0, 255).astype(np.uint8)
    if rng.random() < 0.1:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(25, 80))])[1], cv2.IMREAD_COLOR)
    return image


def erase(rng, image):
    """Hides part of the scene behind a plain patch, as furniture does (Zhong et al., 2020)."""
    height, width = image.shape[:2]
    w, h = rng.uniform(0.08, 0.35, 2) * (width, height)
    x, y = rng.uniform(0, width - w), rng.uniform(0, height - h)
    image[int(y):int(y + h), int(x):int(x + w)] = rng.integers(0, 256, 3)


def without_people(rng, image, boxes):
    """Returns a square part of a square image without people, or else the image with all people hidden, so that the network learns
    the other objects too."""
    for _ in range(12):
        share = rng.uniform(0.25, 0.8)
        low = rng.uniform(0, 1 - share, 2)
        apart = (boxes[:, 3:5] <= low) | (boxes[:, 1:3] >= low + share)
        if apart.any(1).all():
            (x, y), side = (low * image.shape[0]).astype(int), int(share * image.shape[0])
            return image[y:y + side, x:x + side], boxes[:0]
    return clutter.cover(rng, image, boxes), boxes[:0]


def sample(rng, draw, side, mosaic=0.35, strength=1.0, empty=0.5, rooms=False):
    """Returns an image of side x side px, its boxes [n, 5] (class, corners, px) and regions to ignore [m, 4].

    `draw(rng)` returns an image and its relative boxes. `strength` 0 leaves the image unchanged, 1 augments it fully. A share `empty`
    of the images is reduced to a part without people. `rooms`: the images are photos without people, which show enough objects of
    their own.
    """
    border = [(114, 114, 114), (0, 0, 0), tuple(int(v) for v in rng.integers(0, 256, 3))][rng.choice(3, p=[0.5, 0.3, 0.2])]
    canvas = np.empty((side, side, 3), np.uint8)
    x, y = (rng.uniform(0.3, 0.7, 2) * side).astype(int) if rng.random() < mosaic else (side, side)
    spans = [((x0, x1), (y0, y1)) for y0, y1 in ((0, y), (y, side)) for x0, x1 in ((0, x), (x, side)) if x1 > x0 and y1 > y0]
    found, ignored = [], []
    for (x0, x1), (y0, y1) in spans:
        image, boxes = draw(rng)
        if rng.random() < (strength * ROOM_PART if rooms else empty):
            image, boxes = without_people(rng, image, boxes)
            if rng.random() < strength * DESK:
                image = clutter.desk(rng, image)
        if rng.random() < strength * (ROOM_CLUTTER if rooms else CLUTTER * (0.5 if len(boxes) else 1)):
            image = clutter.strew(rng, image, boxes)
        single = len(spans) == 1
        zoom = np.exp(rng.uniform(np.log(0.65), np.log(2.3))) if single else np.exp(rng.uniform(np.log(0.8), np.log(1.8)))
        zoom *= (352 / side) ** 0.3
        cut = False
        if single and len(boxes) and rng.random() < strength * CLOSE:
            height = rng.choice(boxes[:, 4] - boxes[:, 2])
            zoom = np.clip(np.exp(rng.uniform(np.log(0.7), np.log(2.0))) / height, 0.65, 3.0)
            cut = rng.random() < 0.8
        affine = matrix(rng, boxes, image.shape[0], x1 - x0, y1 - y0, zoom, strength * angle(rng), cut)
        canvas[y0:y1, x0:x1] = cv2.warpAffine(image, affine, (x1 - x0, y1 - y0), flags=cv2.INTER_LINEAR, borderValue=border)
        affine[:, 2] += (x0, y0)
        good, bad = place(boxes, affine, image.shape[0], np.array([x0, y0, x1, y1], float))
        found.append(good)
        ignored.append(bad)
    if rng.random() < 0.8:
        canvas = colour(rng, canvas)
    if rng.random() < 0.1:
        erase(rng, canvas)
    canvas = spoil(rng, canvas)
    return np.ascontiguousarray(canvas), np.concatenate(found), np.concatenate(ignored)
