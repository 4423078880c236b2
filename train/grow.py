"""Starts a training from an existing network, with the same number of channels or more.

    python -m train.grow crates/yfslam-detect/models/person.onnx RUN/last.pt RUNS/persons                        # for other classes
    python -m train.grow person.onnx RUN/last.pt RUNS/persons --widths 24 48 128 256 96                          # for a larger network
    python -m train.grow crates/yfslam-detect/models/person.onnx RUN/last.pt RUNS/persons --as-0.3 0.395         # undoes the shift of the export

SOURCE is a checkpoint or a file of train.export. The new network computes the same maps (Net2Net: Chen et al., ICLR 2016): new
channels start at random, and the readers of old channels do not read them yet. The batch norms, which an exported file does not
have, are set to the statistics of images of CACHE, so that training continues smoothly.
"""

import argparse
import dataclasses
import json
import pathlib

import numpy as np
import onnx
import torch
from torch import nn

from . import data
from .config import Config
from .export import fold, load, shift
from .fit import save
from .model import UNITS, YoloFastestV2


def read(path):
    """Returns the weights of the folded network, by name, and its settings."""
    if path.suffix == ".pt":
        model, config = load(path)
        return fold(model).state_dict(), config
    model = onnx.load(path)
    about = {entry.key: json.loads(entry.value) for entry in model.metadata_props if entry.key in ("names", "anchors")}
    if not {"names", "anchors"} <= about.keys():
        raise SystemExit(f"{path} was not written by train.export: it does not contain its classes and anchors; export it with train.export")
    arrays = {t.name.removesuffix("_half"): onnx.numpy_helper.to_array(t).astype(np.float32) for t in model.graph.initializer}
    weights = {name: torch.from_numpy(array.copy()) for name, array in arrays.items()}
    outputs = lambda name: len(weights[name + ".weight"])
    widths = [outputs("stem.0"), *(2 * outputs(f"stage{stage}.0.side.2") for stage in (2, 3, 4)), outputs("reduce32.0")]
    return weights, dataclasses.asdict(Config(classes=about["names"], anchors=about["anchors"], widths=widths))


def halves(old, new):
    """Returns the new places of the channels of a stage. A unit passes channel 2 k to place k and transforms the odd ones. The
    places keep place(2 k) = 2 place(k), odd ones stay odd, and the upper half stays the upper half; then a channel is the same
    in every unit."""
    place, taken = np.zeros(old, int), {0}
    for k in range(1, old):
        if k % 2 == 0:
            place[k] = 2 * place[k // 2]
        else:  # doubling must not move the place over the half too early or too late
            doublings = 0
            while k << doublings < old // 2:
                doublings += 1
            least = -(-(new // 2) // 2**doublings)
            place[k] = next(p for p in range(least | 1, new, 2) if p not in taken)
        taken.add(place[k])
    if (place >= new).any() or ((place < new // 2) != (np.arange(old) < old // 2)).any():
        raise SystemExit(f"{old} channels cannot become {new} with every unit's halves kept; {old * 4 // 3} can")
    return place


def places(old, new):
    """Returns, for each convolution of the network, the places of its old outputs and inputs in the new one."""
    maps = {}
    same = lambda count: np.arange(count)
    before, before_new = same(old[0]), new[0]
    maps["stem.0"] = (before, same(3))
    for stage, units in zip((2, 3, 4), UNITS):
        channels, grown = old[stage - 1], new[stage - 1]
        at, half = halves(channels, grown), channels // 2
        upper, hidden, name = at[half:] - grown // 2, same(half), f"stage{stage}."
        maps |= {name + "0.side.0": (before, None), name + "0.side.2": (at[:half], before), name + "0.main.0": (hidden, before),
                 name + "0.main.3": (hidden, None), name + "0.main.5": (upper, hidden)}
        for unit in range(1, units):
            maps |= {f"{name}{unit}.main.0": (hidden, at[1::2] // 2), f"{name}{unit}.main.3": (hidden, None),
                     f"{name}{unit}.main.5": (upper, hidden)}
        fine, (before, before_new) = (before, before_new), (at, grown)
    pyramid = same(old[-1])
    maps["reduce16.0"] = (pyramid, np.concatenate([before, before_new + fine[0]]))
    maps["reduce32.0"] = (pyramid, before)
    for head in ("boxes16", "objects16", "boxes32", "objects32"):
        maps |= {f"{head}.{layer}": (pyramid, pyramid if layer in (3, 8) else None) for layer in (0, 3, 5, 8)}
    maps |= {output: (None, pyramid) for output in ("reg", "obj", "cls")}
    return maps


@torch.no_grad()
def fill(model, weights, maps):
    """Copies folded `weights` into `model`; batch norms pass their input, plus the bias."""
    modules = dict(model.named_modules())
    for name, (rows, columns) in maps.items():
        layer = modules[name]
        if rows is None:
            rows = np.arange(len(layer.weight))
        else:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
        if columns is None:
            layer.weight[rows] = weights[name + ".weight"]
        else:
            layer.weight[rows] = 0
            layer.weight[np.ix_(rows, columns)] = weights[name + ".weight"]
        after = layer if layer.bias is not None else modules[".".join([*name.split(".")[:-1], str(int(name.split(".")[-1]) + 1)])]
        if after is not layer:
            nn.init.zeros_(after.running_mean)
            nn.init.constant_(after.running_var, 1 - after.eps)
            nn.init.zeros_(after.bias)
        after.bias[rows] = weights[name + ".bias"]


@torch.no_grad()
def settle(model, batches):
    """Sets the statistics of the batch norms to those of the images, without changing the function of the network."""
    sums = {}

    def watch(norm):
        def hook(_, inputs):
            x = inputs[0].double()
            total = sums.setdefault(norm, [0, 0, 0])
            for index, value in enumerate((x.sum((0, 2, 3)), x.square().sum((0, 2, 3)), x[:, 0].numel())):
                total[index] += value
        return norm.register_forward_pre_hook(hook)

    hooks = [watch(module) for module in model.modules() if isinstance(module, nn.BatchNorm2d)]
    for images in batches:
        model(images)
    for hook in hooks:
        hook.remove()
    for norm, (total, squares, count) in sums.items():
        mean, variance = total / count, (squares / count - (total / count).square()).clamp(min=1e-8)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
        norm.weight.copy_((variance + norm.eps).sqrt())
        norm.bias.add_(mean)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path, help="the checkpoint from which train.fit continues")
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("--widths", type=int, nargs=5, help="channels of the stem, of the three stages, of the pyramid (default: unchanged)")
    parser.add_argument("--as-0.3", dest="score", type=float, default=0.3, help="the option with which SOURCE was exported, to undo its shift")
    parser.add_argument("--seen", type=int, default=0, help="number of samples with which the source was trained; the training continues with later ones")
    options = parser.parse_args()
    weights, config = read(options.source)
    old, config["widths"] = config["widths"], options.widths or config["widths"]
    config = Config(**config)
    torch.manual_seed(config.seed)
    model = YoloFastestV2(len(config.classes), config.widths).eval()
    fill(model, weights, places(old, config.widths))
    cache = data.Cache(options.cache, config.classes)
    samples = data.Samples([cache], [1], config.seed)
    pictures = lambda first: torch.stack([samples[n, 256, config.mosaic, config.strength][0] for n in range(first, first + 32)])
    probe = pictures(options.seen).permute(0, 3, 1, 2).float() / 255
    with torch.no_grad():
        before = model(probe)
    settle(model, (pictures(options.seen + first).permute(0, 3, 1, 2).float() / 255 for first in range(0, 512, 32)))
    worst = max(float((a - b).detach().abs().max()) for a, b in zip(before, model(probe)))
    shift(model, 0.3, options.score)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    save(options.out, model=model.state_dict(), mean=model.state_dict(), optimizer=None, step=0, seen=options.seen,
         config=dataclasses.asdict(config))
    print(f"{options.out}: {sum(p.numel() for p in model.parameters())} parameters; maps changed by {worst:.1e} at most")


if __name__ == "__main__":
    main()
