//! Decodes raw outputs into boxes: anchors, sigmoid and softmax, then non-maximum suppression and fusion within each class.
//!
//! With σ the sigmoid, cell (gx, gy), anchor (aw, ah) and stride s, all px of the network input: centre x = (2σ(tx) − ½ + gx) · s,
//! width = (2σ(tw))² · aw, y and height alike; score = σ(objectness) · softmax(classes). The anchors of a cell share the class map.

use yfslam::{BoundingBox, Detection};

use crate::config::DetectorConfig;
use crate::engine::plan::{Map, Plan};
use crate::error::ModelError;

/// One grid of the network's output.
#[derive(Debug)]
pub(crate) struct Grid {
    /// Indices into [`Plan::outputs`]: boxes, objectness, classes.
    maps: [usize; 3],
    /// Width and height of a cell, px of the network input.
    stride: [f32; 2],
    anchors: Vec<[f32; 2]>,
}

impl Grid {
    /// Sorts the outputs of the network into grids, fine to coarse, one for each list of `anchors`. Also returns the number of
    /// classes.
    pub(crate) fn find(name: &str, plan: &Plan, anchors: &[Vec<[f32; 2]>]) -> Result<(Vec<Self>, usize), ModelError> {
        let mismatch = |what: String| ModelError::Mismatch { model: name.into(), what };
        let mut sizes: Vec<(usize, usize)> = plan.outputs.iter().map(|map| map.size).collect();
        sizes.sort_unstable_by(|a, b| b.cmp(a));
        sizes.dedup();
        if sizes.len() != anchors.len() {
            let (found, wanted) = (sizes.len(), anchors.len());
            return Err(mismatch(format!(
                "outputs lie on {found} grids, but there are anchors for {wanted}; see `anchors`"
            )));
        }
        let mut class_count = None;
        let mut grids = Vec::new();
        for (size, anchors) in sizes.into_iter().zip(anchors) {
            let maps: Vec<usize> = (0..plan.outputs.len()).filter(|index| plan.outputs[*index].size == size).collect();
            let channels: Vec<usize> = maps.iter().map(|index| plan.outputs[*index].planes.len()).collect();
            let count = anchors.len();
            let (maps, classes) = match (maps.as_slice(), channels.as_slice()) {
                ([boxes, objects, classes], [b, o, c]) if *b == 4 * count && *o == count => {
                    ([*boxes, *objects, *classes], *c)
                }
                _ => {
                    return Err(mismatch(format!(
                        "the outputs on the {}×{} grid have {channels:?} channels; with {count} anchors [{}, {count}, classes] is \
                         expected, in this order: boxes, objectness, classes, as raw logits",
                        size.1,
                        size.0,
                        4 * count
                    )));
                }
            };
            if *class_count.get_or_insert(classes) != classes {
                return Err(mismatch(format!("the grids have {class_count:?} and {classes} classes")));
            }
            let stride = [plan.input_size.1 as f32 / size.1 as f32, plan.input_size.0 as f32 / size.0 as f32];
            grids.push(Self { maps, stride, anchors: anchors.clone() });
        }
        Ok((grids, class_count.unwrap_or(0)))
    }

    /// Returns the largest number of boxes of [`Grid::candidates`].
    pub(crate) fn most_candidates(&self, plan: &Plan) -> usize {
        let (height, width) = plan.outputs[self.maps[0]].size;
        height * width * self.anchors.len()
    }

    /// Appends every box whose score exceeds `threshold`, px of the network input, to `out`.
    pub(crate) fn candidates(&self, plan: &Plan, threshold: f32, out: &mut Vec<Detection>) {
        let [boxes, objects, classes] = self.maps.map(|index| &plan.outputs[index]);
        // σ(x) > t is x > ln(t / (1 − t)): this avoids the exponential for the many empty cells.
        let least = libm::logf(threshold / (1.0 - threshold));
        for (index, anchor) in self.anchors.iter().enumerate() {
            for (cell, object) in plan.plane(objects, index).iter().enumerate() {
                if *object > least {
                    let (class, probability) = best_class(plan, classes, cell);
                    let score = sigmoid(*object) * probability;
                    let raw = [0, 1, 2, 3].map(|k| sigmoid(plan.plane(boxes, 4 * index + k)[cell]));
                    let bbox = self.place([cell % boxes.size.1, cell / boxes.size.1], *anchor, raw);
                    if score > threshold && bbox.area().is_finite() {
                        out.push(Detection { class, score, bbox });
                    }
                }
            }
        }
    }

    fn place(&self, cell: [usize; 2], anchor: [f32; 2], [x, y, width, height]: [f32; 4]) -> BoundingBox {
        let centre = [x, y].map(|value| 2.0 * value - 0.5);
        let [x, y] = [0, 1].map(|axis| (centre[axis] + cell[axis] as f32) * self.stride[axis]);
        let (half_width, half_height) = (2.0 * width * width * anchor[0], 2.0 * height * height * anchor[1]);
        BoundingBox { x_min: x - half_width, y_min: y - half_height, x_max: x + half_width, y_max: y + half_height }
    }
}

/// Returns the most likely class of a cell and its softmax probability.
fn best_class(plan: &Plan, classes: &Map, cell: usize) -> (usize, f32) {
    let logits = || (0..classes.planes.len()).map(|class| plan.plane(classes, class)[cell]);
    let (mut best, mut most) = (0, f32::NEG_INFINITY);
    for (class, logit) in logits().enumerate() {
        if logit > most {
            (best, most) = (class, logit);
        }
    }
    (best, 1.0 / logits().map(|logit| libm::expf(logit - most)).sum::<f32>())
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-x))
}

/// Moves the best candidates to `out`, best first, except those that overlap a better one of their class.
pub(crate) fn suppress(candidates: &mut [Detection], config: &DetectorConfig, out: &mut Vec<Detection>) {
    let corner = |a: &Detection| [a.bbox.x_min, a.bbox.y_min];
    candidates.sort_unstable_by(|a, b| {
        let [[ax, ay], [bx, by]] = [corner(a), corner(b)];
        b.score.total_cmp(&a.score).then(ay.total_cmp(&by)).then(ax.total_cmp(&bx)).then(a.class.cmp(&b.class))
    });
    for candidate in candidates.iter() {
        let covers = |better: &Detection| {
            better.class == candidate.class && better.bbox.iou(&candidate.bbox) > config.iou_threshold
        };
        if !out.iter().any(covers) {
            out.push(*candidate);
        }
    }
}

/// Replaces each box of `kept` by the mean of the `candidates` that agree with it, weighted by their scores.
pub(crate) fn fuse(candidates: &[Detection], config: &DetectorConfig, kept: &mut [Detection]) {
    for found in kept {
        let agrees = |other: &&Detection| other.class == found.class && other.bbox.iou(&found.bbox) > config.fuse_iou;
        let (mut sums, mut weight) = ([0.0; 4], 0.0);
        for Detection { score, bbox, .. } in candidates.iter().filter(agrees) {
            let edges = [bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max];
            sums.iter_mut().zip(edges).for_each(|(sum, edge)| *sum += score * edge);
            weight += score;
        }
        if weight > 0.0 {
            let [x_min, y_min, x_max, y_max] = sums.map(|sum| sum / weight);
            found.bbox = BoundingBox { x_min, y_min, x_max, y_max };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(class: usize, score: f32, x: f32) -> Detection {
        Detection { class, score, bbox: BoundingBox { x_min: x, y_min: 0.0, x_max: x + 10.0, y_max: 10.0 } }
    }

    #[test]
    fn suppression_keeps_the_best_of_overlapping_boxes_of_one_class_only() {
        let mut candidates = [found(0, 0.5, 1.0), found(0, 0.9, 0.0), found(1, 0.6, 0.0), found(0, 0.4, 8.0)];
        let mut out = Vec::new();
        suppress(&mut candidates, &DetectorConfig::default(), &mut out);
        assert_eq!(out, [found(0, 0.9, 0.0), found(1, 0.6, 0.0), found(0, 0.4, 8.0)]);
    }

    #[test]
    fn boxes_that_agree_are_fused_by_their_scores() {
        let candidates = [found(0, 0.6, 0.0), found(0, 0.3, 1.0), found(1, 0.9, 1.0), found(0, 0.3, 4.0)];
        let mut kept = [found(0, 0.6, 0.0), found(1, 0.9, 1.0)];
        fuse(&candidates, &DetectorConfig::default(), &mut kept);
        assert!((kept[0].bbox.x_min - 1.0 / 3.0).abs() < 1e-6 && (kept[0].bbox.x_max - 31.0 / 3.0).abs() < 1e-5);
        assert_eq!((kept[0].score, kept[1]), (0.6, found(1, 0.9, 1.0)));

        let mut kept = [found(0, 0.6, 0.0)];
        fuse(&candidates, &DetectorConfig { fuse_iou: 1.0, ..DetectorConfig::default() }, &mut kept);
        assert_eq!(kept, [found(0, 0.6, 0.0)]);
    }

    #[test]
    fn boxes_are_placed_by_the_published_formula() {
        let grid = Grid { maps: [0; 3], stride: [16.0, 16.0], anchors: Vec::new() };
        // σ = ½ everywhere: the centre of the cell, the size of the anchor
        let bbox = grid.place([2, 3], [10.0, 20.0], [0.5; 4]);
        assert_eq!(bbox, BoundingBox { x_min: 35.0, y_min: 46.0, x_max: 45.0, y_max: 66.0 });
    }
}
