//! Layouts of the output of YOLO networks. In: raw output. Out: candidates in px of the network input.

use yfslam::{BoundingBox, Detection};

/// Largest number of boxes of a network that includes suppression.
const MOST_FINAL: usize = 1000;

/// Layout of the first output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// `[1, 4 + classes, n]`: centre, size, score of each class; versions 8 to 12.
    Columns { classes: usize },
    /// `[1, n, 5 + classes]`: centre, size, objectness, share of each class; versions 5 and 7.
    Rows { classes: usize },
    /// `[1, n, 6]`: corners, score, class, suppressed already; versions 10 and 26.
    Final,
}

impl Layout {
    /// Finds the layout of a network with outputs of these shapes. Mask coefficients come last; a second output `[1, masks, height,
    /// width]` gives their number.
    pub(super) fn find(shapes: &[Vec<usize>]) -> Result<Self, String> {
        let masks = shapes.iter().skip(1).find(|shape| shape.len() == 4).map_or(0, |shape| shape[1]);
        let layout = match shapes.first().map(Vec::as_slice) {
            Some(&[1, n, values]) if values == 6 + masks && n <= MOST_FINAL => Some(Self::Final),
            Some(&[1, values, n]) if values < n && values > 4 + masks => {
                Some(Self::Columns { classes: values - 4 - masks })
            }
            Some(&[1, n, values]) if values < n && values > 5 + masks => {
                Some(Self::Rows { classes: values - 5 - masks })
            }
            _ => None,
        };
        layout.ok_or_else(|| {
            format!(
                "its outputs have the shapes {shapes:?}; [1, 4 + classes, n], [1, n, 5 + classes] or [1, n, 6] is expected as the \
                 first, as YOLO networks are exported"
            )
        })
    }

    /// Returns the number of classes, if the output contains it.
    pub(super) fn classes(self) -> Option<usize> {
        match self {
            Self::Columns { classes } | Self::Rows { classes } => Some(classes),
            Self::Final => None,
        }
    }

    /// Appends every box whose score exceeds `threshold`, px of the network input, to `out`, with its number. `values` are those of
    /// an output of `shape`.
    pub(super) fn candidates(self, shape: &[usize], values: &[f32], threshold: f32, out: &mut Vec<(Detection, usize)>) {
        let &[_, rows, columns] = shape else { return };
        let at = |row: usize, column: usize| values.get(row * columns + column).copied().unwrap_or_default();
        let mut push = |n: usize, class: usize, score: f32, bbox: BoundingBox| {
            if score > threshold && score.is_finite() && bbox.area().is_finite() {
                out.push((Detection { class, score: score.min(1.0), bbox }, n));
            }
        };
        match self {
            Self::Columns { classes } => {
                for n in 0..columns {
                    let (class, score) = best((0..classes).map(|class| at(4 + class, n)));
                    push(n, class, score, around([0, 1, 2, 3].map(|k| at(k, n))));
                }
            }
            Self::Rows { classes } => {
                for n in 0..rows {
                    let (class, share) = best((0..classes).map(|class| at(n, 5 + class)));
                    push(n, class, at(n, 4) * share, around([0, 1, 2, 3].map(|k| at(n, k))));
                }
            }
            Self::Final => {
                for n in 0..rows {
                    let [x_min, y_min, x_max, y_max, score, class] = [0, 1, 2, 3, 4, 5].map(|k| at(n, k));
                    push(n, class as usize, score, BoundingBox { x_min, y_min, x_max, y_max });
                }
            }
        }
    }

    /// Returns the `masks` coefficients of box `n`, which follow its classes.
    pub(super) fn coefficients(self, shape: &[usize], values: &[f32], n: usize, masks: usize) -> Vec<f32> {
        let &[_, _, columns] = shape else { return Vec::new() };
        let at = |row: usize, column: usize| values.get(row * columns + column).copied().unwrap_or_default();
        let one = |k: usize| match self {
            Self::Columns { classes } => at(4 + classes + k, n),
            Self::Rows { classes } => at(n, 5 + classes + k),
            Self::Final => at(n, 6 + k),
        };
        (0..masks).map(one).collect()
    }
}

/// Returns the highest score and its class.
fn best(scores: impl Iterator<Item = f32>) -> (usize, f32) {
    scores
        .enumerate()
        .fold((0, f32::NEG_INFINITY), |best, (class, score)| if score > best.1 { (class, score) } else { best })
}

fn around([x, y, width, height]: [f32; 4]) -> BoundingBox {
    let (half_width, half_height) = (width / 2.0, height / 2.0);
    BoundingBox { x_min: x - half_width, y_min: y - half_height, x_max: x + half_width, y_max: y + half_height }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_found_by_their_shapes() {
        let find = |shapes: &[&[usize]]| Layout::find(&shapes.iter().map(|shape| shape.to_vec()).collect::<Vec<_>>());
        assert_eq!(find(&[&[1, 84, 8400]]), Ok(Layout::Columns { classes: 80 }));
        assert_eq!(find(&[&[1, 116, 8400], &[1, 32, 160, 160]]), Ok(Layout::Columns { classes: 80 }));
        assert_eq!(find(&[&[1, 25200, 85]]), Ok(Layout::Rows { classes: 80 }));
        assert_eq!(find(&[&[1, 25200, 6]]), Ok(Layout::Rows { classes: 1 }));
        assert_eq!(find(&[&[1, 300, 6]]), Ok(Layout::Final));
        assert_eq!(find(&[&[1, 300, 38], &[1, 32, 160, 160]]), Ok(Layout::Final));
        for shapes in [&[][..], &[&[1, 1000][..]], &[&[2, 84, 8400]], &[&[1, 4, 8400]], &[&[1, 255, 20, 20]]] {
            assert!(find(shapes).unwrap_err().contains("[1, n, 6]"), "{shapes:?}");
        }
    }
}
