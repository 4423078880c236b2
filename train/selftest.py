"""Checks the training code without data, in half a minute: python -m train.selftest"""

import copy
import pathlib
import tempfile
import types

import numpy as np
import torch

from . import augment, cache, data, export, fit, grow
from .config import Config
from .decode import decode
from .loss import assign, detection_loss, flatten, object_terms
from .metrics import match, summary
from .model import YoloFastestV2


def the_network_has_the_published_size():
    assert sum(p.numel() for p in YoloFastestV2(80).parameters()) == 243_095
    outputs = YoloFastestV2(2).eval()(torch.zeros(1, 3, 352, 352))
    assert [tuple(o.shape[1:]) for o in outputs] == [(12, 22, 22), (3, 22, 22), (2, 22, 22), (12, 11, 11), (3, 11, 11), (2, 11, 11)]


def training_and_running_decode_alike():
    torch.manual_seed(0)
    anchors = Config().anchors
    outputs = [torch.randn(1, channels, cells, cells) for cells in (22, 11) for channels in (12, 3, 2)]
    boxes, objects, classes = flatten(outputs, torch.tensor(anchors, dtype=torch.float32))
    score = objects.sigmoid()[0] * classes.softmax(-1)[0, :, 1] * (classes[0].argmax(-1) == 1)
    best = score.argmax()
    found, scores = decode([o.numpy() for o in outputs], anchors, 1)
    assert abs(scores[0] - score[best].item()) < 1e-5
    assert np.allclose(found[0], (boxes[0, best] / 352).clamp(0, 1).numpy(), atol=1e-5)


def every_box_finds_an_anchor_that_reaches_it():
    torch.manual_seed(0)
    anchors = torch.tensor(Config().anchors, dtype=torch.float32)
    outputs = [torch.zeros(1, channels, cells, cells) for cells in (22, 11) for channels in (12, 3, 1)]
    targets = torch.tensor([[[0, 0, 0, 351, 351], [0, 100, 20, 150, 200], [0, 5, 300, 17, 330], [0, 20, 200, 300, 260], [-1, 0, 0, 0, 0]]])
    picture, anchor, box = assign(*flatten(outputs, anchors), targets.float(), anchors, 352)
    assert set(box.tolist()) == {0, 1, 2, 3} and len(set(anchor.tolist())) == len(anchor)


def the_loss_falls_on_one_batch():
    torch.manual_seed(0)
    model, anchors = YoloFastestV2(1), torch.tensor(Config().anchors, dtype=torch.float32)
    images, targets = torch.rand(4, 3, 96, 96), torch.full((4, 2, 5), -1.0)
    for index in range(4):
        x = 10.0 * index
        images[index, :, 10:80, int(x):int(x) + 30] = 0
        targets[index, 0] = torch.tensor([0, x, 10, x + 30, 80])
    optimizer = torch.optim.AdamW(model.parameters(), lr=2e-3)
    losses = []
    for _ in range(40):
        loss, parts = detection_loss(model(images), targets, torch.zeros(4, 6, 6), torch.ones(4, 1), anchors, 96)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < 0.4 * losses[0], losses


def unlabelled_classes_are_not_background():
    objects, truth = torch.tensor([[2.0, 2.0]], requires_grad=True), torch.zeros(1, 2)
    classes = torch.tensor([[[9.0, -9.0], [-9.0, 9.0]]])  # a person, a chair
    object_terms(objects, classes, truth, torch.tensor([[1.0, 0.0]])).sum().backward()
    assert objects.grad[0, 0] > 0.8 and objects.grad[0, 1].abs() < 1e-6


def turned_boxes_bound_the_ellipse():
    boxes = np.array([[0, 0.4, 0.3, 0.6, 0.7]])
    quarter = np.array([[0.0, -1.0, 100.0], [1.0, 0.0, 0.0]])
    placed, ignored = augment.place(boxes, quarter, 100, np.array([0, 0, 100, 100]))
    assert np.allclose(placed, [[0, 30, 40, 70, 60]]) and len(ignored) == 0
    placed, ignored = augment.place(boxes, quarter, 100, np.array([0, 0, 33, 100]))
    assert len(placed) == 0 and len(ignored) == 1


def precision_and_recall_are_those_of_a_worked_example():
    truth = np.array([[0, 0, 0.5, 0.5], [0.5, 0.5, 1, 1]])
    boxes = np.array([[0, 0, 0.5, 0.5], [0, 0, 0.49, 0.5], [0.5, 0.5, 1, 0.99]])
    assert match(boxes, truth).tolist() == [0, -1, 1]
    result = summary([(boxes, np.array([0.9, 0.8, 0.2]))], [truth])
    assert abs(result["AP50"] - (0.5 + 0.5 * 2 / 3)) < 1e-9 and result["recall"] == 0.5 and result["precision"] == 0.5


def a_resumed_training_equals_an_uninterrupted_one():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        rng = np.random.default_rng(0)
        pictures = []
        for index in range(12):
            path = folder / f"{index}.png"
            cache.cv2.imwrite(str(path), rng.integers(0, 256, (60, 80, 3), np.uint8))
            pictures.append((path, np.array([[0, 0.2, 0.1, 0.6, 0.9]])))
        cache.write(pictures, ["person"], folder / "cache", 0.3)
        options = dict(caches=[folder / "cache"], shares=None, decay=0, side=[64], start=None, name=None, every=10**9, processes=1, set=["batch=4"], freeze=["stem"])
        for run, parts in (("whole", [16]), ("parts", [8, 8])):
            (folder / run).mkdir()
            for samples in parts:
                fit.train(0, 1, types.SimpleNamespace(run=folder / run, samples=samples, **copy.deepcopy(options)))
        states = [torch.load(folder / run / "last.pt", weights_only=False)["mean"] for run in ("whole", "parts")]
        assert all(torch.equal(a, b) for a, b in zip(*(state.values() for state in states)))


def the_exported_file_computes_what_the_network_computes():
    import onnxruntime
    with tempfile.TemporaryDirectory() as folder:
        torch.manual_seed(0)
        model = YoloFastestV2(2)
        model(torch.rand(4, 3, 64, 64))  # statistics of batch norm other than 0 and 1
        path, out = pathlib.Path(folder) / "m.pt", pathlib.Path(folder) / "m.onnx"
        torch.save({"mean": model.state_dict(), "config": {"classes": ["person", "chair"]}}, path)
        export.write(path, out, half=False)
        image = torch.rand(1, 3, 352, 352)
        with torch.no_grad():
            wanted = model.eval()(image)
        given = onnxruntime.InferenceSession(out).run(None, {"input": image.numpy()})
        assert max(np.abs(a.numpy() - b).max() for a, b in zip(wanted, given)) < 1e-4


def a_grown_network_computes_what_the_exported_one_computes():
    with tempfile.TemporaryDirectory() as folder:
        torch.manual_seed(0)
        model = YoloFastestV2(2)
        model(torch.rand(4, 3, 64, 64))
        path, out = pathlib.Path(folder) / "m.pt", pathlib.Path(folder) / "m.onnx"
        torch.save({"mean": model.state_dict(), "config": {"classes": ["person", "chair"]}}, path)
        export.write(path, out, half=False)
        image = torch.rand(2, 3, 96, 96)
        wanted = model.eval()(image)
        for source in (path, out):
            weights, config = grow.read(source)
            for widths in (config["widths"], [24, 48, 128, 256, 96]):
                grown = YoloFastestV2(2, widths).eval()
                grow.fill(grown, weights, grow.places(config["widths"], widths))
                grow.settle(grown, [torch.rand(8, 3, 96, 96)])
                assert max(float((a - b).detach().abs().max()) for a, b in zip(wanted, grown(image))) < 1e-3, widths


def a_shift_of_the_export_is_undone():
    model = YoloFastestV2(1)
    before = model.obj.bias.detach().clone()
    export.shift(model, 0.395)
    assert (before - model.obj.bias > 0.4).all()
    export.shift(model, 0.3, 0.395)
    assert torch.allclose(before, model.obj.bias, atol=1e-6)


def hard_photos_of_rooms_are_drawn_more_often_and_have_no_boxes():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        rng = np.random.default_rng(0)
        for index in range(3):
            cache.cv2.imwrite(str(folder / f"{index}.png"), rng.integers(0, 256, (60, 80, 3), np.uint8))
        cache.write(cache.empty_folder(folder, ["person"]), ["person"], folder / "cache", 0.0)
        np.save(folder / "cache/hard.npy", np.array([1.0, 1.0, 3.0]))
        photos = data.Cache(folder / "cache", ["person"])
        assert photos.empty and np.allclose(photos.weight, [0.2, 0.2, 0.6])
        samples = data.Samples([photos], [1], 1)
        assert all((samples[n, 96, 0.5, 1.0][1] == -1).all() for n in range(20))


def a_person_is_cut_by_an_upright_edge():
    boxes = np.array([[0, 0.6, 0.2, 0.8, 0.9]])
    for seed in range(50):
        affine = augment.matrix(np.random.default_rng(seed), boxes, 100, 80, 80, 2.5, 0.0, cut=True)
        placed, ignored = augment.place(boxes, affine, 100, np.array([0, 0, 80, 80], float))
        (left, _, right, _), = np.concatenate([placed[:, 1:], ignored])
        assert min(left, 80 - right) == 0 and 0.11 < (right - left) / (20 * abs(affine[0, 0])) < 0.89


if __name__ == "__main__":
    torch.set_num_threads(1)
    for check in [value for value in list(globals().values()) if isinstance(value, types.FunctionType) and value.__module__ == "__main__"]:
        check()
        print("ok:", check.__name__.replace("_", " "), flush=True)
