"""All settings of a training; they are stored in every checkpoint."""

import dataclasses


@dataclasses.dataclass
class Config:
    classes: list = dataclasses.field(default_factory=lambda: ["person"])
    # widths and heights, px of the 352 px input, fine grid first; from train.anchors
    anchors: list = dataclasses.field(default_factory=lambda: [[[20, 40], [32, 90], [69, 57]], [[59, 136], [110, 139], [182, 274]]])
    # channels of the stem, of the three stages and of the pyramid; 24 48 96 192 72 is the size of the paper's network
    widths: list = dataclasses.field(default_factory=lambda: [24, 48, 96, 192, 72])
    seed: int = 1
    batch: int = 32
    rate: float = 2e-3
    weight_decay: float = 0.05
    warm_up: int = 400  # steps
    average: float = 0.9995  # of the moving average of the weights, per step
    # [from this sample on, sides of training images, px]: small ones first, because they are faster (progressive resizing)
    sides: list = dataclasses.field(default_factory=lambda: [[0, [160, 192, 224]], [160000, [192, 224, 256, 288]]])
    mosaic: float = 0.35  # share of images that are composed of four
    strength: float = 1.0  # of the augmentation, 0 to 1
    empty: float = 0.5  # share of the images with people that are reduced to a part without people
