"""Measures the cost of 8-bit integers for an exported network: rounds weights and activations like integer arithmetic, and
evaluates.

    python -m train.quantize RUNS/persons person.onnx --out person.onnx

With --out, the file is written again with the scales of the inputs of 1x1 convolutions (least square error) in its metadata: the
engine can then compute these with integers (`--integers`).

Weights: symmetric, a scale for each output channel. Inputs of convolutions: unsigned, a scale and an offset for each tensor, from
training images (Krishnamoorthi, Quantizing deep convolutional networks for efficient inference, arXiv 1806.08342). Sums are kept
exact, like those of 32-bit integers, and tensors that no convolution reads are not rounded: this is the best that an implementation
can reach.
"""

import argparse
import copy
import pathlib
import tempfile

import numpy as np
import onnx
import onnxruntime
from onnx import helper, numpy_helper

from .data import Cache
from .decode import blob
from .evaluate import Network, held_out

BINS, LEVELS, PERCENTILE = 2048, 255, 99.99
VARIANTS = {  # name: (range of activations, kinds of convolution left in float)
    "as it is": (None, ("first", "last", "depthwise", "1x1")),
    "weights alone": (None, ()),
    "all, min and max": ("whole", ()),
    f"all, percentile {PERCENTILE}": ("percentile", ()),
    "all, least square error": ("square", ()),
    "but first and last, percentile": ("percentile", ("first", "last")),
    "but first and last, square error": ("square", ("first", "last")),
    "1x1 but last alone, percentile": ("percentile", ("first", "last", "depthwise")),
    "1x1 but last alone, square error": ("square", ("first", "last", "depthwise")),
}


def plain(model):
    """Returns the network with float32 weights, however they are stored."""
    stored = {tensor.name: tensor for tensor in model.graph.initializer}
    for node in [node for node in model.graph.node if node.op_type == "Cast" and node.input[0] in stored]:
        values = numpy_helper.to_array(stored[node.input[0]]).astype(np.float32)
        stored[node.input[0]].CopyFrom(numpy_helper.from_array(values, node.output[0]))
        model.graph.node.remove(node)
    return model


def kind(node, graph, weights):
    """Returns the kind of a convolution: first, last, depthwise or 1x1."""
    shape = weights[node.input[1]].shape
    if node.input[0] == graph.input[0].name:
        return "first"
    if node.output[0] in {output.name for output in graph.output}:
        return "last"
    return "1x1" if shape[2:] == (1, 1) else "depthwise"


def work(model):
    """Returns the share of the multiply-adds by kind of convolution."""
    graph = onnx.shape_inference.infer_shapes(model).graph
    weights = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    shapes = {v.name: v.type.tensor_type.shape.dim for v in [*graph.value_info, *graph.output]}
    total = dict.fromkeys(("first", "1x1", "depthwise", "last"), 0)
    for node in graph.node:
        if node.op_type == "Conv":
            total[kind(node, graph, weights)] += weights[node.input[1]].size * shapes[node.output[0]][2].dim_value ** 2
    return {name: count / sum(total.values()) for name, count in total.items()}


def collect(model, names, pictures):
    """Returns, for each tensor, its least and greatest value over the images, and the histogram between them."""
    model = copy.deepcopy(model)
    known = {output.name for output in model.graph.output}
    model.graph.output.extend(onnx.ValueInfoProto(name=name) for name in names if name not in known)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    feed = session.get_inputs()[0].name
    run = lambda picture: session.run(names, {feed: blob(picture)})
    ends = [np.array([[values.min(), values.max()] for values in run(picture)]) for picture in pictures]
    low, high = np.minimum(np.min(ends, 0)[:, 0], 0), np.maximum(np.max(ends, 0)[:, 1], 1e-6)
    counts = np.zeros((len(names), BINS))
    for picture in pictures:
        for index, values in enumerate(run(picture)):
            counts[index] += np.histogram(values, BINS, (low[index], high[index]))[0]
    return {name: (low[index], high[index], counts[index]) for index, name in enumerate(names)}


def interval(how, low, high, counts):
    """Returns the range of the quantised values; values outside become the nearest one. 0 is always one of them, because margins
    are 0."""
    middles = low + (np.arange(BINS) + 0.5) * (high - low) / BINS
    if how == "percentile":
        share, tail = counts.cumsum() / counts.sum(), 1 - PERCENTILE / 100
        inside = middles[(share > tail) & (share <= 1 - tail)]
        low, high = min(inside.min(), 0), inside.max()
    if how == "square":
        error = lambda part: (counts * (rounded(middles, *scale(low * part, high * part)) - middles) ** 2).sum()
        best = min(np.linspace(0.1, 1, 91), key=error)
        low, high = low * best, high * best
    return low, high


def scale(low, high):
    step = np.float32((high - low) / LEVELS)
    return step, np.uint8(np.clip(round(-low / step), 0, LEVELS))


def rounded(values, step, zero):
    return (np.clip(np.rint(values / step) + float(zero), 0, LEVELS) - float(zero)) * step


def quantized(model, ranges, how, left):
    """Returns the network with rounded weights, and with rounding before each convolution of a kind that is not in `left`."""
    model = copy.deepcopy(model)
    graph = model.graph
    stored = {tensor.name: tensor for tensor in graph.initializer}
    weights = {name: numpy_helper.to_array(tensor) for name, tensor in stored.items()}
    nodes, made = [], {}
    for node in graph.node:
        if node.op_type == "Conv" and kind(node, graph, weights) not in left:
            source, name = node.input[0], node.input[1]
            step = np.abs(weights[name]).max((1, 2, 3), keepdims=True) / 127 + 1e-12
            stored[name].CopyFrom(numpy_helper.from_array((np.rint(weights[name] / step) * step).astype(np.float32), name))
            if source not in made and how:
                step, zero = scale(*interval(how, *ranges[source]))
                made[source] = source + "_rounded"
                graph.initializer.extend(numpy_helper.from_array(np.array(v), source + part) for part, v in (("_step", step), ("_zero", zero)))
                about = [source + "_step", source + "_zero"]
                nodes.append(helper.make_node("QuantizeLinear", [source, *about], [source + "_integer"]))
                nodes.append(helper.make_node("DequantizeLinear", [source + "_integer", *about], [made[source]]))
            node.input[0] = made.get(source, source)
        nodes.append(node)
    graph.CopyFrom(helper.make_graph(nodes, graph.name, graph.input, graph.output, graph.initializer))
    return model


def describe(model, ranges):
    """Returns the scales for the metadata: on each line the name of a convolution, and the step and the zero of its input."""
    weights = {tensor.name: numpy_helper.to_array(tensor) for tensor in plain(copy.deepcopy(model)).graph.initializer}
    lines = []
    for node in model.graph.node:
        if node.op_type == "Conv" and kind(node, model.graph, weights) == "1x1":
            step, zero = scale(*interval("square", *ranges[node.input[0]]))
            lines.append(f"{node.name} {step:.8g} {zero}")
    kept = [entry for entry in model.metadata_props if entry.key != "scales"]
    del model.metadata_props[:]
    model.metadata_props.extend([*kept, onnx.StringStringEntryProto(key="scales", value="\n".join(lines))])
    return model


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("model", type=pathlib.Path)
    parser.add_argument("--pictures", type=int, default=300, help="number of images from which the ranges of activations are computed")
    parser.add_argument("--out", type=pathlib.Path, help="write the model with the scales of the inputs of its 1x1 convolutions")
    parser.add_argument("--quick", action="store_true", help="do not evaluate")
    options = parser.parse_args()
    learnt, cache = Cache(options.cache, ["person"]), Cache(options.cache, ["person"], held_out=True)
    chosen = np.sort(np.random.default_rng(0).choice(learnt.chosen, options.pictures, replace=False))
    model = plain(onnx.load(options.model))
    print("multiply-adds:", " ".join(f"{name} {share:.3f}" for name, share in work(model).items()))
    read = dict.fromkeys(node.input[0] for node in model.graph.node if node.op_type == "Conv")
    ranges = collect(model, list(read), [np.array(learnt.images[i]) for i in chosen])
    if options.out:
        onnx.save(describe(onnx.load(options.model), ranges), options.out)
        print(f"{options.out}: {options.out.stat().st_size} bytes")
    for name, (how, left) in VARIANTS.items() if not options.quick else ():
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "changed.onnx")
            onnx.save(quantized(model, ranges, how, left), path)
            row = held_out(Network(path), cache)
        print(f"{name:34}", " ".join(f"{k} {v:.4f}" for k, v in row.items() if isinstance(v, float)), flush=True)


if __name__ == "__main__":
    main()
