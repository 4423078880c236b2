#!/usr/bin/env python3
"""Writes tests/golden.json: the results of ONNX Runtime for the official COCO weights, for comparison.

python3 make_golden.py DATA_FOLDER > golden.json     (pip: onnxruntime, opencv-python-headless, numpy)

resize: samples of procedural images resized by OpenCV, blue, green, red in [0, 1]
raw:    procedural inputs, exact in float32; sums and samples of the six outputs
boxes:  photos and video frames; resize by OpenCV on float pixels, decoding and suppression written here in numpy
"""
import json
import pathlib
import sys

import cv2
import numpy as np
import onnxruntime

SIDE = 352
ANCHORS = {22: [(12.64, 19.39), (37.88, 51.48), (55.71, 138.31)], 11: [(126.91, 78.23), (131.57, 214.55), (279.92, 258.87)]}
SCORE, IOU = 0.1, 0.4
FILES = [f"persons/images/{n:05}.webp" for n in (0, 12, 345, 700, 1200, 1801, 2400, 3000)]
FRAMES = [("rgbd/bonn_crowd_dev/rgb", 120), ("rgbd/bonn_crowd_dev/rgb", 300), ("rgbd/bonn_crowd_dev/rgb", 450), ("rgbd/tum_fr1_xyz_dev/rgb", 100)]


def procedural(kind):
    index = np.arange(3 * SIDE * SIDE, dtype=np.uint64)
    if kind == "noise":
        value = (index * 2654435761 % 2**32) >> 24
    else:
        c, y, x = index // SIDE**2, index // SIDE % SIDE, index % SIDE
        value = (x * (c + 1) + y * 3 // 2 + c * 50) % 256
    return (value.astype(np.float32) / np.float32(255)).reshape(1, 3, SIDE, SIDE)


def resized(width, height):
    y, x, c = np.mgrid[0:height, 0:width, 0:3]
    image = ((x * 7 + y * 13 + c * 31 + x * y % 17 * 5) % 256).astype(np.float32)[:, :, ::-1]
    blob = cv2.resize(image, (SIDE, SIDE), interpolation=cv2.INTER_LINEAR).transpose(2, 0, 1) / np.float32(255)
    flat = blob.ravel()
    at = [int(i) for i in np.linspace(0, flat.size - 1, 40).astype(int)]
    return {"width": width, "height": height, "samples": [[i, round(float(flat[i]), 6)] for i in at]}


def sigmoid(x):
    return 1 / (1 + np.exp(-x.astype(np.float64)))


def decode(outputs, width, height):
    found = []
    for reg, obj, cls in (outputs[:3], outputs[3:]):
        grid = obj.shape[2]
        stride = SIDE / grid
        e = np.exp(cls[0].astype(np.float64) - cls[0].max(0))
        p = e / e.sum(0)
        for a, (aw, ah) in enumerate(ANCHORS[grid]):
            score = sigmoid(obj[0, a]) * p.max(0)
            t = sigmoid(reg[0, 4 * a : 4 * a + 4])
            for y, x in zip(*np.where(score > SCORE)):
                cx, cy = (2 * t[0, y, x] - 0.5 + x) * stride, (2 * t[1, y, x] - 0.5 + y) * stride
                w, h = (2 * t[2, y, x]) ** 2 * aw, (2 * t[3, y, x]) ** 2 * ah
                found.append((float(score[y, x]), int(p[:, y, x].argmax()), cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2))
    found.sort(reverse=True)
    kept = []
    for f in found:
        if all(k[1] != f[1] or iou(k[2:], f[2:]) <= IOU for k in kept):
            kept.append(f)
    scaled = []
    for score, c, x0, y0, x1, y1 in kept:
        box = [x0 * width / SIDE, y0 * height / SIDE, x1 * width / SIDE, y1 * height / SIDE]
        box = [min(max(v, 0), limit) for v, limit in zip(box, (width, height, width, height))]
        scaled.append({"class": c, "score": round(score, 5), "box": [round(v, 3) for v in box]})
    return scaled


def iou(a, b):
    inter = max(0, min(a[2], b[2]) - max(a[0], b[0])) * max(0, min(a[3], b[3]) - max(a[1], b[1]))
    area = lambda r: (r[2] - r[0]) * (r[3] - r[1])
    return inter / (area(a) + area(b) - inter)


def main():
    data = pathlib.Path(sys.argv[1])
    session = onnxruntime.InferenceSession(data / "models/yolo-fastestv2-coco.onnx")
    names = [o.name for o in session.get_outputs()]
    run = lambda blob: session.run(None, {session.get_inputs()[0].name: blob})
    raw = []
    for kind in ("noise", "waves"):
        maps = []
        for name, values in zip(names, run(procedural(kind))):
            flat = values.ravel()
            at = [int(i) for i in np.linspace(0, flat.size - 1, 25).astype(int)]
            maps.append({"name": name, "shape": list(values.shape[1:]), "sum": float(flat.astype(np.float64).sum()),
                         "absolute_sum": float(np.abs(flat.astype(np.float64)).sum()),
                         "samples": [[i, round(float(flat[i]), 6)] for i in at]})
        raw.append({"input": kind, "maps": maps})
    boxes = []
    files = FILES + [str(sorted((data / folder).iterdir())[n].relative_to(data)) for folder, n in FRAMES]
    for file in files:
        image = cv2.imread(str(data / file), cv2.IMREAD_COLOR)
        blob = cv2.resize(image.astype(np.float32), (SIDE, SIDE), interpolation=cv2.INTER_LINEAR) / np.float32(255)
        outputs = run(np.ascontiguousarray(blob.transpose(2, 0, 1)[None]))
        boxes.append({"file": file, "pixel_sum": int(image.astype(np.int64).sum()), "found": decode(outputs, image.shape[1], image.shape[0])})
    resize = [resized(width, height) for width, height in ((640, 480), (1280, 720), (352, 352), (200, 100), (3, 2))]
    json.dump({"resize": resize, "score_threshold": SCORE, "iou_threshold": IOU, "raw": raw, "boxes": boxes}, sys.stdout, separators=(",", ":"))
    print()


main()
