"""Converts folders of images to one array of equal squares, so that training decodes nothing.

    python -m train.cache yolo  PHOTOS  CACHE --classes person      # PHOTOS/images/*, PHOTOS/labels/*.txt: class cx cy w h, relative
    python -m train.cache synth FOLDER  CACHE --classes person chair  # recordings of `yfslam synth`, at any depth below
    python -m train.cache empty ROOMS   CACHE --classes person      # ROOMS/*: photos without any object of the classes

CACHE/images.npy: uint8 [N, 352, 352, 3], blue green red, stretched. CACHE/labels.npz: boxes [M, 5] (class, x0, y0, x1, y1;
relative), first box of each image [N + 1], group [N], held_out [N], and the class names.

Images of one scene (frames of one film, copies of one photo with other colours or rotated) form a group. A group is held out as a
whole, by a hash of the bytes of its images; otherwise the held-out part would measure memorisation.
"""

import argparse
import hashlib
import json
import pathlib

import cv2
import numpy as np

SIDE = 352
LEAST_SEEN = 0.12  # share of its box in which the object must be visible
SAME_SCENE = 0.85  # correlation of 16 x 16 grey thumbnails, in the best of eight orientations


def yolo_folder(folder, classes):
    """Yields (path, boxes) of a folder in YOLO's text format."""
    for path in sorted((folder / "images").iterdir()):
        text = (folder / "labels" / (path.stem + ".txt")).read_text() if (folder / "labels" / (path.stem + ".txt")).exists() else ""
        rows = np.array([line.split()[:5] for line in text.splitlines() if line.strip()], np.float32).reshape(-1, 5)
        kind, x, y, w, h = rows.T
        yield path, np.stack([kind, x - w / 2, y - h / 2, x + w / 2, y + h / 2], 1)


def empty_folder(folder, classes):
    """Yields (path, no boxes) of a folder of photos without any object of the classes."""
    for path in sorted(folder.iterdir()):
        yield path, np.zeros((0, 5), np.float32)


def synthetic_folders(folder, classes):
    """Yields (path, boxes) of every recording of `yfslam synth` below `folder`, without objects that are mostly hidden."""
    for about in sorted(folder.glob("**/boxes.json")):
        stamps = {round(frame["timestamp_ns"] / 1e3): frame["boxes"] for frame in json.loads(about.read_text())["frames"]}
        for line in (about.parent / "rgb.txt").read_text().splitlines():
            if not line.strip() or line.startswith("#"):
                continue
            stamp, file = line.split()[:2]
            path = about.parent / file
            mask = cv2.imread(str(about.parent / "masks" / f"{stamp}.png"), cv2.IMREAD_UNCHANGED)
            size = np.array([mask.shape[1], mask.shape[0]] * 2)
            rows = []
            for box in stamps.get(round(float(stamp) * 1e6), []):
                x0, y0, x1, y1 = box["bbox"]
                seen = (mask == box["instance"]).sum()
                if box["class"] in classes and seen > LEAST_SEEN * max((x1 - x0) * (y1 - y0), 0.01 * mask.size):
                    rows.append([classes.index(box["class"]), *np.array(box["bbox"]) / size])
            yield path, np.array(rows, np.float32).reshape(-1, 5)


def groups(thumbnails):
    """Returns the scene number of each image: connected components of similar images."""
    count = len(thumbnails)
    flat = thumbnails.reshape(count, -1)
    turned = [t[:, :, ::-1] if mirrored else t for t in (np.rot90(thumbnails, k, (1, 2)) for k in range(4)) for mirrored in (False, True)]
    parent = np.arange(count)

    def find(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for start in range(0, count, 1024):
        block = flat[start:start + 1024]
        alike = np.maximum.reduce([block @ t.reshape(count, -1).T for t in turned]) / flat.shape[1]
        for a, b in zip(*np.where(alike > SAME_SCENE)):
            parent[find(a + start)] = find(b)
    return np.array([find(i) for i in range(count)])


def hold_out(group, hashes, share):
    """Selects the held-out images: those of the groups whose least hash is below `share` of all hashes."""
    least = {}
    for g, h in zip(group, hashes):
        least[g] = min(least.get(g, "g"), h)
    # the least of many hashes is small: hash again for a uniform draw
    draw = {g: int(hashlib.sha256(h.encode()).hexdigest()[:12], 16) / 16**12 for g, h in least.items()}
    return np.array([draw[g] < share for g in group])


def write(pictures, classes, out, share):
    images, thumbnails, hashes, boxes, first = [], [], [], [], [0]
    for path, rows in pictures:
        data = path.read_bytes()
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise SystemExit(f"{path}: cannot be read as an image; remove it or convert it")
        if image.shape[:2] != (SIDE, SIDE):
            shrinks = image.shape[0] >= SIDE and image.shape[1] >= SIDE
            image = cv2.resize(image, (SIDE, SIDE), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
        grey = cv2.resize(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (16, 16), interpolation=cv2.INTER_AREA).astype(np.float32)
        thumbnails.append((grey - grey.mean()) / (grey.std() + 1e-3))
        images.append(image)
        hashes.append(hashlib.sha256(data).hexdigest())
        boxes.append(rows.astype(np.float32))
        first.append(first[-1] + len(rows))
    group = groups(np.array(thumbnails))
    held_out = hold_out(group, hashes, share)
    out.mkdir(parents=True, exist_ok=True)
    np.save(out / "images.npy", np.array(images))
    np.savez(out / "labels.npz", boxes=np.concatenate(boxes), first=np.array(first), group=group, held_out=held_out, classes=np.array(classes))
    print(f"{len(images)} images in {len(set(group))} scenes, {held_out.sum()} held out, {first[-1]} boxes -> {out}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("form", choices=["yolo", "synth", "empty"])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("--classes", nargs="+", default=["person"], help="names of the class numbers in the label files; of synthetic folders: the classes to keep")
    parser.add_argument("--tallest", type=float, default=0, help="leave out photos of which no object is taller than this share of the image")
    parser.add_argument("--hold-out", type=float, default=0.15, help="share of the scenes that is not used for training")
    options = parser.parse_args()
    read = {"yolo": yolo_folder, "synth": synthetic_folders, "empty": empty_folder}[options.form]
    tallest = lambda rows: max(rows[:, 4] - rows[:, 2], default=0)
    pictures = ((path, rows) for path, rows in read(options.folder, options.classes) if not options.tallest or tallest(rows) > options.tallest)
    write(pictures, options.classes, options.cache, options.hold_out)


if __name__ == "__main__":
    main()
