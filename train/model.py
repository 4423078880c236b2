"""The network: takes a batch of images and returns six maps of raw logits. ShuffleNetV2 backbone (Ma et al., ECCV 2018), a light
feature pyramid (Lin et al., CVPR 2017), and two heads per grid, the layout for the fused plan of the Rust engine.

Input [N, 3, H, W]: blue, green, red in [0, 1], H and W multiples of 32. Output, for stride 16 and then 32: reg [N, 12, h, w], obj
[N, 3, h, w], cls [N, C, h, w]. The last 1x1 convolutions are shared between the two grids.
"""

import math

import torch
from torch import nn

STRIDES = (16, 32)
ANCHORS_PER_GRID = 3
UNITS = (4, 8, 4)  # number of units of the three stages


def conv(inputs, outputs, kernel=1, stride=1, groups=1, relu=True):
    layers = [nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False), nn.BatchNorm2d(outputs)]
    return layers + [nn.ReLU(inplace=True)] * relu


class Unit(nn.Module):
    """A ShuffleNetV2 unit with stride 1: odd channels are transformed, even ones pass."""

    def __init__(self, channels):
        super().__init__()
        half = channels // 2
        self.main = nn.Sequential(*conv(half, half), *conv(half, half, 3, groups=half, relu=False), *conv(half, half))

    def forward(self, x):
        odd = x[:, 1::2].contiguous(memory_format=torch.channels_last)  # saves a fifth of the training time
        return torch.cat([x[:, 0::2], self.main(odd)], 1)


class Down(nn.Module):
    """A ShuffleNetV2 unit with stride 2: both branches read all channels."""

    def __init__(self, inputs, outputs):
        super().__init__()
        half = outputs // 2
        self.side = nn.Sequential(*conv(inputs, inputs, 3, 2, inputs, relu=False), *conv(inputs, half))
        self.main = nn.Sequential(*conv(inputs, half), *conv(half, half, 3, 2, half, relu=False), *conv(half, half))

    def forward(self, x):
        return torch.cat([self.side(x), self.main(x)], 1)


class Head(nn.Sequential):
    """Two separable 5x5 convolutions."""

    def __init__(self, channels):
        half = lambda: conv(channels, channels, 5, groups=channels) + conv(channels, channels, relu=False)
        super().__init__(*half(), *half())


class YoloFastestV2(nn.Module):
    """The network of this module. `widths`: channels of the stem, of the three stages and of the pyramid; `prior`: initial
    objectness of every cell."""

    def __init__(self, classes=1, widths=(24, 48, 96, 192, 72), prior=0.01):
        super().__init__()
        *stages, pyramid = widths
        self.stem = nn.Sequential(*conv(3, stages[0], 3, 2), nn.MaxPool2d(3, 2, 1))
        self.stage2, self.stage3, self.stage4 = (
            nn.Sequential(Down(inputs, outputs), *(Unit(outputs) for _ in range(units - 1)))
            for inputs, outputs, units in zip(stages, stages[1:], UNITS))
        self.reduce16, self.reduce32 = nn.Sequential(*conv(sum(stages[-2:]), pyramid)), nn.Sequential(*conv(stages[-1], pyramid))
        self.boxes16, self.objects16, self.boxes32, self.objects32 = (Head(pyramid) for _ in range(4))
        self.reg = nn.Conv2d(pyramid, 4 * ANCHORS_PER_GRID, 1)
        self.obj = nn.Conv2d(pyramid, ANCHORS_PER_GRID, 1)
        self.cls = nn.Conv2d(pyramid, classes, 1)
        for output in (self.reg, self.obj, self.cls):
            nn.init.normal_(output.weight, std=0.01)
            nn.init.zeros_(output.bias)
        nn.init.constant_(self.obj.bias, math.log(prior / (1 - prior)))

    def forward(self, x):
        fine = self.stage3(self.stage2(self.stem(x)))
        coarse = self.stage4(fine)
        up = nn.functional.interpolate(coarse, scale_factor=2.0, mode="nearest")
        p16, p32 = self.reduce16(torch.cat([up, fine], 1)), self.reduce32(coarse)
        o16, o32 = self.objects16(p16), self.objects32(p32)
        return (self.reg(self.boxes16(p16)), self.obj(o16), self.cls(o16),
                self.reg(self.boxes32(p32)), self.obj(o32), self.cls(o32))
