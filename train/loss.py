"""Computes the training loss from six raw maps and boxes.

Each box chooses its anchors by the predictions of the network (simOTA: Ge et al., YOLOX, 2021): candidates are the anchors, on both
grids, of the four cells from which the decoding can reach its centre, if the sides differ by less than a factor of 4; the box takes
its k cheapest, k = sum of the IoU of its candidates. Boxes learn from CIoU (Zheng et al., AAAI 2020), objectness from binary
cross-entropy, classes from cross-entropy.
"""

import math

import torch
import torch.nn.functional as F

from .model import ANCHORS_PER_GRID, STRIDES

REACH = 4.0  # the decoding gives sides from 0 to 4 anchors
BOX_WEIGHT, LOCATION_COST = 5.0, 3.0


def flatten(outputs, anchors):
    """Returns logits and decoded boxes of all anchors. anchors: [2, 3, 2], px. Returns boxes [B, A, 4] (corners, px), objectness
    [B, A], classes [B, A, C]; A counts grid, anchor, row, column."""
    boxes, objects, classes = [], [], []
    for grid, stride in enumerate(STRIDES):
        reg, obj, cls = (map.float() for map in outputs[3 * grid:3 * grid + 3])
        batch, _, rows, columns = reg.shape
        reg = reg.reshape(batch, ANCHORS_PER_GRID, 4, rows * columns).sigmoid()
        x = torch.arange(columns).repeat(rows)
        y = torch.arange(rows).repeat_interleave(columns)
        cx, cy = (2 * reg[:, :, 0] - 0.5 + x) * stride, (2 * reg[:, :, 1] - 0.5 + y) * stride
        size = (2 * reg[:, :, 2:]).square() * anchors[grid].view(1, ANCHORS_PER_GRID, 2, 1) / 2
        box = torch.stack([cx - size[:, :, 0], cy - size[:, :, 1], cx + size[:, :, 0], cy + size[:, :, 1]], -1)
        boxes.append(box.reshape(batch, -1, 4))
        objects.append(obj.reshape(batch, -1))
        classes.append(cls.reshape(batch, 1, cls.shape[1], rows * columns).transpose(2, 3).expand(-1, ANCHORS_PER_GRID, -1, -1)
                       .reshape(batch, -1, cls.shape[1]))
    return torch.cat(boxes, 1), torch.cat(objects, 1), torch.cat(classes, 1)


def iou(a, b):
    """Returns the intersection over union of corner boxes [..., 4], by pairs."""
    low, high = torch.maximum(a[..., :2], b[..., :2]), torch.minimum(a[..., 2:], b[..., 2:])
    shared = (high - low).clamp(min=0).prod(-1)
    area = lambda r: (r[..., 2:] - r[..., :2]).clamp(min=0).prod(-1)
    return shared / (area(a) + area(b) - shared + 1e-6)


def ciou(a, b):
    """Returns the IoU less the penalties for the distance of the centres and for different proportions; and the IoU."""
    overlap = iou(a, b)
    hull = torch.maximum(a[..., 2:], b[..., 2:]) - torch.minimum(a[..., :2], b[..., :2])
    distance = ((a[..., :2] + a[..., 2:] - b[..., :2] - b[..., 2:]) / 2).square().sum(-1) / (hull.square().sum(-1) + 1e-6)
    ratio = lambda r: torch.atan((r[..., 2] - r[..., 0]) / (r[..., 3] - r[..., 1] + 1e-6))
    v = 4 / math.pi**2 * (ratio(a) - ratio(b)).square()
    with torch.no_grad():
        alpha = v / (1 - overlap + v + 1e-6)
    return overlap - distance - alpha * v, overlap


def candidates(targets, anchors, side):
    """Returns, for each box [B, T], the numbers of its candidate anchors [B, T, 24] and which of them are allowed."""
    centre, size = (targets[..., 1:3] + targets[..., 3:5]) / 2, targets[..., 3:5] - targets[..., 1:3]
    numbers, allowed, start = [], [], 0
    for grid, stride in enumerate(STRIDES):
        cells = side // stride
        at = centre / stride
        base = at.floor()
        step = torch.where(at - base < 0.5, -1.0, 1.0)
        ratio = size.unsqueeze(-2) / anchors[grid]
        fits = torch.maximum(ratio, 1 / ratio.clamp(min=1e-6)).amax(-1) < REACH
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            x, y = base[..., 0] + dx * step[..., 0], base[..., 1] + dy * step[..., 1]
            inside = (x >= 0) & (x < cells) & (y >= 0) & (y < cells)
            cell = (y.clamp(0, cells - 1) * cells + x.clamp(0, cells - 1)).long()
            for anchor in range(ANCHORS_PER_GRID):
                numbers.append(start + anchor * cells * cells + cell)
                allowed.append(inside & fits[..., anchor])
        start += ANCHORS_PER_GRID * cells * cells
    return torch.stack(numbers, -1), torch.stack(allowed, -1)


@torch.no_grad()
def assign(boxes, objects, classes, targets, anchors, side):
    """Returns assigned pairs (image, anchor, box) as three index vectors."""
    real = targets[..., 0] >= 0
    numbers, allowed = candidates(targets, anchors, side)
    allowed &= real.unsqueeze(-1)
    batch, most, count = numbers.shape
    flat = numbers.reshape(batch, -1)
    pick = lambda values: values.gather(1, flat).reshape(batch, most, count)
    predicted = boxes.gather(1, flat.unsqueeze(-1).expand(-1, -1, 4)).reshape(batch, most, count, 4)
    overlap = iou(predicted, targets[..., None, 1:5])
    wanted = targets[..., 0].clamp(min=0).long()
    log_class = classes.log_softmax(-1).gather(1, flat.unsqueeze(-1).expand(-1, -1, classes.shape[-1]))
    log_class = log_class.reshape(batch, most, count, -1).gather(3, wanted[..., None, None].expand(-1, -1, count, 1)).squeeze(3)
    cost = -F.logsigmoid(pick(objects)) - log_class - LOCATION_COST * overlap.clamp(min=1e-4).log()
    cost = cost.masked_fill(~allowed, math.inf)
    wish = (overlap * allowed).topk(10, -1).values.sum(-1).int().clamp(min=1)
    rank = cost.argsort(-1).argsort(-1)
    taken = (rank < wish.unsqueeze(-1)) & allowed
    picture, box, which = taken.nonzero(as_tuple=True)
    anchor, price = numbers[picture, box, which], cost[picture, box, which]
    # an anchor that two boxes choose is assigned to the one with the lower cost
    key = picture * boxes.shape[1] + anchor
    least = torch.full((batch * boxes.shape[1],), math.inf).scatter_reduce(0, key, price, "amin")
    keep = price == least[key]
    return picture[keep], anchor[keep], box[keep]


def object_terms(objects, classes, truth, labelled):
    """Returns the binary cross-entropy of each anchor [B, A]. Where an image has no labels of some class, an anchor that is empty
    according to the labels may contain an object of that class: only its probability of a labelled object, objectness times the
    share of the labelled classes [B, C], is pushed to zero; -log(1 - s p) = softplus(o) - softplus(o + log(1 - p)) with s the
    sigmoid of o."""
    terms = F.binary_cross_entropy_with_logits(objects, truth, reduction="none")
    if labelled.all():
        return terms
    share = (classes.detach().softmax(-1) * labelled[:, None]).sum(-1)
    spared = F.softplus(objects + (1 - share).clamp(min=1e-12).log())
    return torch.where(truth > 0, terms, terms - spared)


def detection_loss(outputs, targets, ignored, labelled, anchors, side):
    """Returns the loss and its parts (boxes, objectness, classes, mean IoU, pairs per image). targets [B, T, 5], class -1: none;
    `ignored` [B, side / 16, side / 16]: 1 where nothing is learnt; labelled [B, C]: 1 for the classes for which the image has
    labels."""
    boxes, objects, classes = flatten(outputs, anchors)
    picture, anchor, box = assign(boxes, objects, classes, targets, anchors, side)
    pairs = max(len(picture), 1)
    gain, overlap = ciou(boxes[picture, anchor], targets[picture, box, 1:5])
    box_loss = (1 - gain).sum() / pairs
    truth = torch.zeros_like(objects)
    truth[picture, anchor] = 0.5 + 0.5 * overlap.detach().clamp(0, 1)
    coarse = F.max_pool2d(ignored[:, None].float(), 2, ceil_mode=True)[:, 0]
    weight = 1 - torch.cat([mask.flatten(1).float().repeat(1, ANCHORS_PER_GRID) for mask in (ignored, coarse)], 1)
    weight[picture, anchor] = 1
    object_loss = (object_terms(objects, classes, truth, labelled) * weight).sum() / pairs
    class_loss = F.cross_entropy(classes[picture, anchor], targets[picture, box, 0].long(), reduction="sum") / pairs
    total = BOX_WEIGHT * box_loss + object_loss + class_loss
    parts = [box_loss, object_loss, class_loss, overlap.sum() / pairs, len(picture) / len(targets)]
    return total, torch.tensor([float(torch.as_tensor(part).detach()) for part in parts])
