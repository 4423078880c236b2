"""Decodes the six raw maps of one image into boxes: the same formulas, suppression and fusion as in the Rust engine, in NumPy."""

import numpy as np

SIDE = 352


def sigmoid(x):
    return 1 / (1 + np.exp(-x))


def blob(image, side=SIDE):
    """Converts an image (uint8, blue green red) to the network input [1, 3, side, side]: plain stretch, values in [0, 1]."""
    import cv2
    if image.shape[:2] != (side, side):
        image = cv2.resize(image.astype(np.float32), (side, side), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None], np.float32) / np.float32(255)


def iou(box, boxes):
    low, high = np.maximum(box[:2], boxes[:, :2]), np.minimum(box[2:], boxes[:, 2:])
    shared = np.maximum(high - low, 0).prod(1)
    area = lambda b: (b[..., 2:] - b[..., :2]).prod(-1)
    return shared / (area(box) + area(boxes) - shared + 1e-9)


def decode(outputs, anchors, wanted, least=0.3, suppress=0.5, fuse=0.7):
    """Returns the boxes [n, 4] (corners, relative) of class number `wanted` and their scores, best first.

    outputs: reg, obj, cls at the fine, then at the coarse grid, each [1, channels, rows, columns]; anchors in px of the input.
    """
    found = []
    for grid, sizes in enumerate(np.asarray(anchors, float).reshape(2, 3, 2)):
        reg, obj, cls = (np.asarray(map, float)[0] for map in outputs[3 * grid:3 * grid + 3])
        rows, columns = obj.shape[1:]
        stride = SIDE / 22 * (grid + 1)
        power = np.exp(cls - cls.max(0))
        share = np.where(cls.argmax(0) == wanted, power[wanted] / power.sum(0), 0)
        score = sigmoid(obj) * share
        for anchor, y, x in zip(*np.where(score > least)):
            t = sigmoid(reg[4 * anchor:4 * anchor + 4, y, x])
            centre = (2 * t[:2] - 0.5 + (x, y)) * stride
            half = (2 * t[2:]) ** 2 * sizes[anchor] / 2
            low, high = (centre - half) / (columns * stride, rows * stride), (centre + half) / (columns * stride, rows * stride)
            found.append((score[anchor, y, x], *low, *high))
    found = np.array(sorted(found, reverse=True)).reshape(-1, 5)[:300]
    kept, fused = [], []
    scores, boxes = found[:, 0], found[:, 1:]
    alive = np.ones(len(found), bool)
    for index in range(len(found)):
        if alive[index]:
            overlap = iou(boxes[index], boxes)
            overlap[index] = 1  # a box without area agrees with itself, too
            kept.append(index)
            fused.append(np.average(boxes, axis=0, weights=scores * (overlap > fuse)))
            alive &= overlap <= suppress
    return np.clip(np.array(fused).reshape(-1, 4), 0, 1), scores[kept]
