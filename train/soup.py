"""Computes the mean of the weights of several trainings that began from the same network (Wortsman et al., Model soups, ICML 2022).

    python -m train.soup OUT.pt A.pt B.pt...

It runs as fast as one of them. The embedded network is such a mean: at the same recall it has fewer false alarms than each of the
two (`train.scores`). OUT can be exported, evaluated, and trained further.
"""

import argparse
import pathlib

import torch

from .fit import save


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("checkpoints", type=pathlib.Path, nargs="+")
    options = parser.parse_args()
    states = [torch.load(path, weights_only=False, map_location="cpu") for path in options.checkpoints]
    for path, state in zip(options.checkpoints, states):
        for key in ("classes", "widths", "anchors"):
            if state["config"][key] != states[0]["config"][key]:
                parser.error(f"{path} has other {key} than {options.checkpoints[0]}; only networks of one shape have a mean")
    last = max(states, key=lambda state: state["seen"])
    mean = {name: torch.stack([state["mean"][name].float() for state in states]).mean(0).to(value.dtype) for name, value in last["mean"].items()}
    # No moments fit the mean.
    save(options.out, **{**last, "model": mean, "mean": mean, "optimizer": None})
    print(f"{options.out}: the mean of {len(states)}")


if __name__ == "__main__":
    main()
