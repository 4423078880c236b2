"""Exports a checkpoint to ONNX: six raw maps, batch norm folded, anchors and class names in the metadata, in the form for the Rust
engine.

    python -m train.export RUN/final.pt person.onnx           # float32
    python -m train.export RUN/final.pt person.onnx --half    # weights stored as float16: half the size
    python -m train.export RUN/final.pt person.onnx --as-0.3 0.45   # a score of 0.45 becomes 0.3, the threshold of the SLAM system
"""

import argparse
import dataclasses
import json
import pathlib

import numpy as np
import onnx
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from .config import Config
from .decode import SIDE
from .model import YoloFastestV2

NAMES = ["reg_22", "obj_22", "cls_22", "reg_11", "obj_11", "cls_11"]


def load(path):
    """Returns the averaged network of a checkpoint, ready to evaluate, and its settings."""
    state = torch.load(path, weights_only=False, map_location="cpu")
    config = Config(**state["config"])
    model = YoloFastestV2(len(config.classes), config.widths)
    model.load_state_dict(state["mean"])
    return model.eval(), dataclasses.asdict(config)


def fold(module):
    """Joins every convolution with the batch norm after it."""
    for child in module.children():
        fold(child)
    if isinstance(module, nn.Sequential):
        layers = list(module)
        for index in range(len(layers) - 1):
            if isinstance(layers[index], nn.Conv2d) and isinstance(layers[index + 1], nn.BatchNorm2d):
                module[index], module[index + 1] = fuse_conv_bn_eval(layers[index], layers[index + 1]), nn.Identity()
    return module


def halve(graph):
    """Stores the weights as float16, each followed by a cast to float32, in which the network computes."""
    casts = []
    for tensor in graph.initializer:
        values = onnx.numpy_helper.to_array(tensor)
        # Biases and the like are few, and keep their precision.
        if values.dtype == np.float32 and values.ndim > 1:
            name, half = tensor.name, tensor.name + "_half"
            tensor.CopyFrom(onnx.numpy_helper.from_array(values.astype(np.float16), half))
            casts.append(onnx.helper.make_node("Cast", [half], [name], name + "_cast", to=onnx.TensorProto.FLOAT))
    nodes = list(graph.node)
    del graph.node[:]
    graph.node.extend(casts + nodes)


def shift(model, score, becomes=0.3):
    """Shifts the objectness so that `score` becomes 0.3; the order of detections, and with it AP, stays the same."""
    logit = lambda p: np.log(p / (1 - p))
    with torch.no_grad():
        model.obj.bias += float(logit(becomes) - logit(score))


def write(checkpoint, out, half, score=0.3):
    model, config = load(checkpoint)
    shift(model, score)
    torch.onnx.export(fold(model), (torch.zeros(1, 3, SIDE, SIDE),), out, input_names=["input"], output_names=NAMES, opset_version=13,
                      dynamo=False)
    exported = onnx.load(out)
    for key in ("classes", "anchors"):
        exported.metadata_props.add(key={"classes": "names"}.get(key, key), value=json.dumps(config[key]))
    if half:
        halve(exported.graph)
    onnx.checker.check_model(exported)
    onnx.save(exported, out)
    print(f"{out}: {out.stat().st_size} bytes, classes {config['classes']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint", type=pathlib.Path)
    parser.add_argument("onnx", type=pathlib.Path)
    parser.add_argument("--half", action="store_true", help="store the weights as float16")
    parser.add_argument("--as-0.3", dest="score", type=float, default=0.3, help="the score that becomes 0.3 (default 0.3)")
    options = parser.parse_args()
    write(options.checkpoint, options.onnx, options.half, options.score)


if __name__ == "__main__":
    main()
