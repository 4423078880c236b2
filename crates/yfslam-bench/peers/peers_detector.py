#!/usr/bin/env python3
"""Times the detector's forward pass beside ONNX Runtime and ncnn: one thread each, the same weights (the official ones; ncnn takes no
others), the same 352×352 input. The embedded network, of one class, is timed too, in ONNX Runtime and here.

python3 crates/yfslam-bench/peers/peers_detector.py [DATA_FOLDER] [--rounds 5] [--runs 100]
(pip: onnxruntime, ncnn, numpy; DATA_FOLDER defaults to YFSLAM_DATA, else ../shared/data)

The engines take turns for a few rounds, so that all see the same load; reported are the minimum and the median of the process
CPU time, in ms, and the ratio of our best minimum to the fastest peer's, for each network. Loading and the first runs do not count.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import time

import ncnn
import numpy as np
import onnxruntime

ROOT = pathlib.Path(__file__).resolve().parents[3]
EMBEDDED = ROOT / "crates/yfslam-detect/models/person.onnx"
WARM_UP = 10


def clock(runs, call):
    for _ in range(WARM_UP):
        call()
    times = []
    for _ in range(runs):
        start = time.process_time_ns()
        call()
        times.append((time.process_time_ns() - start) / 1e6)
    return times


def onnx_runtime(model, image):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name
    return lambda: session.run(None, {name: image[None]})


def ncnn_net(models, image, half):
    net = ncnn.Net()
    net.opt.num_threads = 1
    net.opt.use_vulkan_compute = False
    net.opt.use_fp16_packed = net.opt.use_fp16_storage = net.opt.use_fp16_arithmetic = half
    assert net.load_param(str(models / "yolo-fastestv2-opt.param")) == 0
    assert net.load_model(str(models / "yolo-fastestv2-opt.bin")) == 0
    mat = ncnn.Mat(image)
    inputs, outputs = net.input_names(), net.output_names()

    def run():
        extractor = net.create_extractor()
        extractor.input(inputs[0], mat)
        return [extractor.extract(output)[1] for output in outputs]

    run.net = net
    return run


def ours(model, runs):
    command = ["cargo", "run", "--release", "--quiet", "-p", "yfslam-detect", "--example", "time_detector", "--"]
    output = subprocess.run([*command, model, str(runs)], cwd=ROOT, check=True, capture_output=True)
    return [json.loads(line) for line in output.stdout.splitlines()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", nargs="?", default=os.environ.get("YFSLAM_DATA", ROOT.parent / "shared/data"))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--runs", type=int, default=100)
    arguments = parser.parse_args()
    models = pathlib.Path(arguments.data) / "models"
    image = np.random.default_rng(0).random((3, 352, 352), dtype=np.float32)
    official, engine = models / "yolo-fastestv2-coco.onnx", f"ONNX Runtime {onnxruntime.__version__}"
    networks = {"official": official, "embedded": EMBEDDED}
    peers = {f"{engine}, {name}": onnx_runtime(model, image) for name, model in networks.items()}
    for half in (True, False):
        peers[f"ncnn {ncnn.__version__} {'fp16 storage' if half else 'fp32'}, official"] = ncnn_net(models, image, half)
    ours(official, 1)  # builds
    times = {}
    for _ in range(arguments.rounds):
        for name, run in peers.items():
            times.setdefault(name, []).extend(clock(arguments.runs, run))
        for name, model in networks.items():
            for line in ours(model, arguments.runs):
                for what in ("forward", "detect"):
                    times.setdefault(f"yfslam {line['level']} {what}, {name}", []).extend(line[f"{what}_all_ms"])
    for name, values in times.items():
        print(f"{name:44} min {min(values):6.2f} ms   median {statistics.median(values):6.2f} ms")
    least = lambda names: min(names, key=lambda name: min(times[name]))
    for network in networks:
        mine = least(name for name in times if name.endswith(f"forward, {network}"))
        # ncnn has the official network only, which is larger by the output of 79 classes.
        peer = least(name for name in peers if name.endswith(network) or name.startswith("ncnn"))
        print(f"ratio of minima, {mine} to {peer}: {min(times[mine]) / min(times[peer]):.2f}")


main()
