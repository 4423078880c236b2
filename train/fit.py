"""Trains the detector; it can be stopped and resumed at any time.

    python -m train.fit RUN CACHE...                          # starts, or continues from RUN/last.pt
    python -m train.fit RUN CACHE... --decay 60000 --side 352   # from RUN/last.pt: rate to 0 over 60000 samples -> RUN/final.pt

The rate is constant after a warm-up, so that the duration of the training need not be known in advance, and falls to zero only in a
branch that ends in usable weights. RUN/last.pt has everything for resuming; each evaluation adds a row to RUN/log.csv.
"""

import argparse
import copy
import csv
import dataclasses
import os
import pathlib
import time

import cv2
import numpy as np
import torch
import torch.distributed as dist

from . import data
from .config import Config
from .decode import SIDE, decode
from .loss import detection_loss
from .metrics import summary
from .model import YoloFastestV2

PARTS = ["box", "object", "class", "iou", "pairs"]


class Batches:
    """Lists of items for the loader from sample `start` on; each of several processes takes its share of every batch."""

    def __init__(self, config, start, stop, sides, rank, world):
        self.config, self.start, self.stop, self.sides, self.rank, self.world = config, start, stop, sides, rank, world

    def sides_at(self, seen):
        return self.sides or [sides for begin, sides in self.config.sides if begin <= seen][-1]

    def __iter__(self):
        c = self.config
        for first in range(self.start, self.stop, c.batch):
            side = int(np.random.default_rng([c.seed, first, 7]).choice(self.sides_at(first)))
            yield [(n, side, c.mosaic, c.strength) for n in range(first, first + c.batch)][self.rank::self.world]


def parameter_groups(model, decay):
    """Returns the parameters with weight decay for the filters only."""
    filters = [p for p in model.parameters() if p.ndim > 1]
    others = [p for p in model.parameters() if p.ndim <= 1]
    return [{"params": filters, "weight_decay": decay}, {"params": others, "weight_decay": 0.0}]


def rate(config, step, seen, decay):
    """Returns the factor of the rate: linear warm-up, then 1, then linearly to 0 within `decay` = (first sample, last sample)."""
    factor = min(1.0, (step + 1) / config.warm_up)
    if decay:
        factor *= max(0.0, (decay[1] - seen) / (decay[1] - decay[0]))
    return factor


@torch.no_grad()
def average(target, model, weight):
    own, new = list(target.state_dict().values()), list(model.state_dict().values())
    torch._foreach_lerp_([a for a in own if a.is_floating_point()], [b for b in new if b.is_floating_point()], 1 - weight)
    for a, b in zip(own, new):
        if not a.is_floating_point():
            a.copy_(b)


def share_gradients(model, world):
    grads = [p.grad for p in model.parameters() if p.grad is not None]
    flat = torch.cat([g.flatten() for g in grads])
    dist.all_reduce(flat)
    for g, part in zip(grads, flat.split([g.numel() for g in grads])):
        g.copy_(part.view_as(g) / world)


def freeze(model, parts):
    """Keeps the weights of these parts of the network, and the statistics of their batch norms, as they are."""
    for part in (model.get_submodule(name) for name in parts):
        part.eval().requires_grad_(False)


@torch.no_grad()
def evaluate(model, cache, config, side, wanted=0):
    """Returns the metrics of class `wanted` on the images of `cache`, at `side` px."""
    model.eval()
    found, truths = [], []
    for index in cache.chosen:
        image = np.array(cache.images[index])
        if side != image.shape[0]:
            image = cv2.resize(image, (side, side), interpolation=cv2.INTER_AREA)
        outputs = model(torch.from_numpy(image).permute(2, 0, 1)[None].float() / 255)
        found.append(decode([o.numpy() for o in outputs], config.anchors, wanted, least=0.01))
        rows = cache.boxes[index]
        truths.append(rows[rows[:, 0] == wanted][:, 1:])
    return summary(found, truths)


def save(path, **state):
    temporary = path.with_suffix(".tmp")
    torch.save(state, temporary)
    os.replace(temporary, path)


def adopt(model, weights):
    """Loads weights; a class map of another size keeps the classes that both have."""
    own = model.state_dict()
    for name in ("cls.weight", "cls.bias"):
        if weights[name].shape != own[name].shape:
            count = min(len(weights[name]), len(own[name]))
            own[name][:count] = weights[name][:count]
            weights[name] = own[name]
    model.load_state_dict(weights)


def train(rank, world, options):
    torch.set_num_threads(1)
    if world > 1:
        dist.init_process_group("gloo", init_method=f"file://{options.run.resolve()}/rendezvous", rank=rank, world_size=world)
    config = Config()
    last = options.run / "last.pt"
    source = options.start or last
    state = torch.load(source, weights_only=False) if source.exists() else None
    if state:
        config = Config(**state["config"])
    for setting in options.set:
        name, value = setting.split("=", 1)
        setattr(config, name, type(getattr(config, name))(eval(value, {})))
    torch.manual_seed(config.seed)
    model = YoloFastestV2(len(config.classes), config.widths).to(memory_format=torch.channels_last)
    mean = copy.deepcopy(model)
    optimizer = torch.optim.AdamW(parameter_groups(model, config.weight_decay), lr=config.rate, fused=True)
    step = seen = 0
    if state:
        same = state["optimizer"] and len(state["model"]["cls.bias"]) == len(config.classes)
        adopt(model, state["model"])
        adopt(mean, state["mean"])
        if same:  # otherwise no moments fit, and they start again
            optimizer.load_state_dict(state["optimizer"])
        step, seen = state["step"], state["seen"]
    decay = (seen, seen + options.decay) if options.decay else None
    out = options.run / ("final.pt" if decay else "last.pt")
    if options.name:
        out = options.run / f"{options.name}.pt"
    stop = decay[1] if decay else seen + options.samples
    anchors = torch.tensor(config.anchors, dtype=torch.float32)

    caches = [data.Cache(folder, config.classes) for folder in options.caches]
    held_out = data.Cache(options.caches[0], config.classes, held_out=True)
    samples = data.Samples(caches, options.shares or [1] * len(caches), config.seed, config.empty)
    batches = Batches(config, seen, stop, options.side, rank, world)

    saved = told = time.time()
    sums, count = torch.zeros(len(PARTS)), 0
    next_evaluation = seen + options.every
    for images, targets, ignored, labelled in data.loader(samples, batches, 1):
        model.train()
        freeze(model, options.freeze)
        factor = rate(config, step, seen, decay)
        for group in optimizer.param_groups:
            group["lr"] = config.rate * factor
        images = images.permute(0, 3, 1, 2).float().div_(255)
        loss, parts = detection_loss(model(images), targets, ignored, labelled, anchors, images.shape[-1])
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        if world > 1:
            share_gradients(model, world)
        torch.nn.utils.clip_grad_norm_(model.parameters(), 10.0)
        optimizer.step()
        step, seen = step + 1, seen + config.batch
        average(mean, model, min(config.average, step / (step + 10)))
        sums, count = sums + parts, count + 1
        if rank == 0 and (seen >= next_evaluation or seen >= stop or time.time() - saved > 120):
            save(out, model=model.state_dict(), mean=mean.state_dict(), optimizer=optimizer.state_dict(), step=step, seen=seen,
                 config=dataclasses.asdict(config))
            saved = time.time()
        if rank == 0 and (seen >= next_evaluation or seen >= stop):
            next_evaluation += options.every
            speed = count * config.batch / (time.time() - told)
            side = int(np.median(batches.sides_at(seen)) / 32) * 32  # a network trained on small images is best there
            small, scores = evaluate(mean, held_out, config, side), evaluate(mean, held_out, config, SIDE)
            row = {"time": time.strftime("%H:%M:%S"), "branch": out.stem, "samples": seen, "rate": f"{config.rate * factor:.5f}",
                   **{name: f"{value:.4f}" for name, value in zip(PARTS, (sums / count).tolist())},
                   **{name: f"{scores[name]:.4f}" for name in ("AP50", "recall", "precision", "tall_recall")},
                   "side": side, "AP50_at_side": f"{small['AP50']:.4f}", "tall_recall_at_side": f"{small['tall_recall']:.4f}", "per_second": f"{speed:.1f}"}
            fresh = not (options.run / "log.csv").exists()
            with open(options.run / "log.csv", "a", newline="") as file:
                writer = csv.DictWriter(file, row)
                if fresh:
                    writer.writeheader()
                writer.writerow(row)
            print(" ".join(f"{k}={v}" for k, v in row.items()), flush=True)
            sums, count, told = torch.zeros(len(PARTS)), 0, time.time()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("caches", type=pathlib.Path, nargs="+", help="from train.cache; the first one's held-out part is evaluated")
    parser.add_argument("--shares", type=float, nargs="+", help="share of samples that each cache gets")
    parser.add_argument("--samples", type=int, default=10**9, help="stop after this number of further samples")
    parser.add_argument("--decay", type=int, default=0, help="samples over which the rate falls to 0")
    parser.add_argument("--side", type=int, nargs="+", help="sides of the training images, instead of those of the settings")
    parser.add_argument("--start", type=pathlib.Path, help="checkpoint to start from, instead of RUN/last.pt")
    parser.add_argument("--freeze", nargs="+", default=[], metavar="PART", help="parts of train/model.py that do not change, for example `stem stage2`, which take half of the time")
    parser.add_argument("--name", help="file to write, instead of `last` or `final`")
    parser.add_argument("--every", type=int, default=16000, help="samples between evaluations")
    parser.add_argument("--processes", type=int, default=1, help="number of processes, each on one core; gradients are averaged")
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE", help="settings of train/config.py")
    options = parser.parse_args()
    options.run.mkdir(parents=True, exist_ok=True)
    if options.processes == 1:
        return train(0, 1, options)
    (options.run / "rendezvous").unlink(missing_ok=True)
    torch.multiprocessing.spawn(train, (options.processes, options), options.processes)


if __name__ == "__main__":
    main()
