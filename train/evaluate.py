"""Evaluates several detectors with the same program.

    python -m train.evaluate CACHE MODEL... [--data DATA] [--empty FOLDER] [--rooms FOLDER...] [--json FILE]

MODEL: a checkpoint (.pt) or an ONNX file with six raw maps (anchors from its metadata, else those of COCO; `person` must be one of
its classes). On the held-out images of CACHE: AP50 of people, recall and precision at score 0.3, upright and rotated by 30, 60 and
90 degrees to either side. With the folder of development data: how often all visible people are covered on
labels/bonn_crowd_dev_100.json, and the number of false detections on tum_fr1_xyz_dev. With a folder of recordings without people
(FOLDER/*/rgb): the number of detections there. With --rooms, photos without people (a folder of photos, or the held-out images of a
cache of `train.cache empty`): the number of detections per 100 photos.
"""

import argparse
import json
import pathlib

import cv2
import numpy as np

from .data import Cache
from .decode import blob, decode, iou
from .metrics import summary

COCO_ANCHORS = [12.64, 19.39, 37.88, 51.48, 55.71, 138.31, 126.91, 78.23, 131.57, 214.55, 279.92, 258.87]
MAN_VISIBLE = [(0, 8), (52, 103), (143, 232), (283, 299)]  # frames of tum_fr1_xyz_dev
LABELS = pathlib.Path(__file__).parent / "labels"


class Network:
    """Takes an image and returns boxes of people (corners, relative) and scores."""

    def __init__(self, path):
        if path.suffix == ".pt":
            import torch
            from .export import load
            torch.set_num_threads(1)
            model, config = load(path)
            self.anchors, self.person = config["anchors"], config["classes"].index("person")

            def run(image):
                with torch.no_grad():
                    return [o.numpy() for o in model(torch.from_numpy(image))]
        else:
            import onnxruntime
            options = onnxruntime.SessionOptions()
            options.intra_op_num_threads = 1
            session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
            about = session.get_modelmeta().custom_metadata_map
            self.anchors = json.loads(about["anchors"]) if "anchors" in about else COCO_ANCHORS
            self.person = json.loads(about["names"]).index("person") if "names" in about else 0
            name = session.get_inputs()[0].name
            run = lambda image: session.run(None, {name: image})
        self.run = run

    def __call__(self, image, least=0.01):
        return decode(self.run(blob(image)), self.anchors, self.person, least)


def turned(image, boxes, degrees):
    """Returns the image rotated about its centre, grey outside; boxes bound the rotated inscribed ellipses and are clipped at the
    edge. People with less than half remaining are not counted."""
    side = image.shape[0]
    affine = cv2.getRotationMatrix2D((side / 2 - 0.5, side / 2 - 0.5), degrees, 1.0)
    picture = cv2.warpAffine(image, affine, (side, side), flags=cv2.INTER_LINEAR, borderValue=(114, 114, 114))
    centre = (boxes[:, :2] + boxes[:, 2:]) / 2 * side @ affine[:, :2].T + affine[:, 2]
    half = (boxes[:, 2:] - boxes[:, :2]) / 2 * side
    reach = np.sqrt(half**2 @ (affine[:, :2] ** 2).T)
    whole = np.concatenate([centre - reach, centre + reach], 1) / side
    cut = whole.clip(0, 1)
    area = lambda b: (b[:, 2:] - b[:, :2]).prod(1)
    return picture, cut[area(cut) > 0.5 * area(whole)]


def held_out(network, cache, degrees=(), score=0.3):
    """Returns the metrics over the held-out images, each rotated by all of `degrees`."""
    found, truths = [], []
    for index in cache.chosen:
        image, boxes = np.array(cache.images[index]), cache.boxes[index][:, 1:]
        for angle in degrees or (0,):
            picture, truth = turned(image, boxes, angle) if angle else (image, boxes)
            found.append(network(picture))
            truths.append(truth)
    return summary(found, truths, score)


def crowd(network, data, score=0.3):
    """Returns the share of labelled frames with people in which each person is covered: by one box at IoU 0.5; or at least 70 % of
    the person by one box."""
    labels = json.loads((LABELS / "bonn_crowd_dev_100.json").read_text())
    size = np.array([labels["width"], labels["height"]] * 2)
    good = loose = frames = people = hits = empty = false = 0
    for file, rows in labels["frames"].items():
        boxes, scores = network(cv2.imread(str(data / labels["sequence"] / file)))
        boxes = boxes[scores > score]
        if not rows:
            empty, false = empty + 1, false + len(boxes)
            continue
        truth = np.array([[x, y, x + w, y + h] for x, y, w, h in rows]) / size
        tight, inside = [], []
        for person in truth:
            tight.append(len(boxes) > 0 and iou(person, boxes).max() >= 0.5)
            shared = np.maximum(np.minimum(person[2:], boxes[:, 2:]) - np.maximum(person[:2], boxes[:, :2]), 0).prod(1)
            inside.append(len(boxes) > 0 and shared.max() >= 0.7 * (person[2:] - person[:2]).prod())
        frames, people, hits = frames + 1, people + len(rows), hits + sum(tight)
        good, loose = good + all(tight), loose + all(inside)
    return {"frames_with_people": frames, "all_at_iou_.5": good / frames, "all_within_boxes": loose / frames,
            "recall_of_people": hits / people, "false_per_empty_frame": false / max(empty, 1)}


def false_alarms(network, data, score=0.3):
    """Returns the number of detections per frame of a desk. A man sits behind it: in some frames a box with its centre in the upper
    left may be that man and is not counted as false."""
    files = sorted((data / "rgbd/tum_fr1_xyz_dev/rgb").iterdir())
    total = false = 0
    for number, file in enumerate(files):
        boxes, scores = network(cv2.imread(str(file)))
        x, y = (boxes[scores > score].reshape(-1, 2, 2).mean(1)).T
        him = any(first <= number <= last for first, last in MAN_VISIBLE) & (x < 0.62) & (y < 0.36)
        total, false = total + len(x), false + int((~him).sum())
    return {"frames": len(files), "reported_per_frame": total / len(files), "false_per_frame": false / len(files)}


def empty_recordings(network, folder, score=0.3):
    """Returns the number of detections per frame of recordings without people, and that in the worst of the recordings."""
    per_frame = []
    for recording in sorted(path for path in folder.iterdir() if (path / "rgb").is_dir()):
        files = sorted((recording / "rgb").iterdir())
        per_frame.append([int((network(cv2.imread(str(file)))[1] > score).sum()) for file in files])
    frames, means = np.concatenate(per_frame), [np.mean(counts) for counts in per_frame]
    return {"recordings": len(per_frame), "frames": len(frames), "false_per_frame": float(frames.mean()),
            "frames_with_any": float((frames > 0).mean()), "worst_recording": float(max(means))}


def room_photos(path):
    """Yields photos without people: those of a folder, or the held-out ones of a cache."""
    if (path / "images.npy").exists():
        cache = Cache(path, ["person"], held_out=True)
        yield from (np.array(cache.images[index]) for index in cache.chosen)
    else:
        yield from (cv2.imread(str(file)) for file in sorted(path.iterdir()))


def rooms(network, path, score=0.3):
    """Returns the number of detections per 100 photos without people, and the share of photos with any."""
    counts = np.array([int((network(image)[1] > score).sum()) for image in room_photos(path)])
    return {"photos": len(counts), "false_per_100": float(100 * counts.mean()), "photos_with_any": float((counts > 0).mean())}


def report(network, cache, data, empty, rooms_at=()):
    rows = {"upright": held_out(network, cache)}
    for angle in (30, 60, 90):
        rows[f"turned {angle}"] = held_out(network, cache, (-angle, angle))
    if data:
        rows["bonn_crowd_dev"] = crowd(network, data)
        rows["tum_fr1_xyz_dev"] = false_alarms(network, data)
    if empty:
        rows["without people"] = empty_recordings(network, empty)
    for path in rooms_at:
        rows[f"rooms {path.name}"] = rooms(network, path)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("models", type=pathlib.Path, nargs="+")
    parser.add_argument("--data", type=pathlib.Path, help="folder of development data, with rgbd/")
    parser.add_argument("--empty", type=pathlib.Path, help="folder of recordings without people, each with rgb/")
    parser.add_argument("--rooms", type=pathlib.Path, nargs="+", default=[], help="folders or caches of photos without people")
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    cache = Cache(options.cache, ["person"], held_out=True)
    everything = {}
    for path in options.models:
        everything[path.name] = report(Network(path), cache, options.data, options.empty, options.rooms)
        print(path.name)
        for name, row in everything[path.name].items():
            print(f"  {name:16}", " ".join(f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()), flush=True)
    if options.json:
        options.json.write_text(json.dumps(everything, indent=1) + "\n")


if __name__ == "__main__":
    main()
