//! In: a line. Out: its parts inside a rectangle, without points that could not be distinguished.

/// A position in pixels or in the units of the axes.
pub type Point = [f64; 2];

/// Returns the parts of a line inside the rectangle from `low` to `high`.
pub fn clip(line: &[Point], low: Point, high: Point) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut end = None;
    for pair in line.windows(2) {
        let &[a, b] = pair else { continue };
        let Some([from, to]) = clip_segment(a, b, low, high) else { continue };
        match parts.last_mut() {
            Some(part) if end == Some(from) => part.push(to),
            _ => parts.push(vec![from, to]),
        }
        end = Some(to);
    }
    parts
}

/// Returns the part of the segment from `a` to `b` inside the rectangle (Liang and Barsky 1984); `None` if there is none, or for NaN.
fn clip_segment(a: Point, b: Point, low: Point, high: Point) -> Option<[Point; 2]> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for k in 0..2 {
        let step = b[k] - a[k];
        for (side, sign) in [(low[k], -1.0), (high[k], 1.0)] {
            let (speed, room) = (sign * step, sign * (side - a[k]));
            if speed < 0.0 {
                enter = enter.max(room / speed);
            } else if speed > 0.0 {
                leave = leave.min(room / speed);
            } else if room < 0.0 || room.is_nan() {
                return None;
            }
        }
    }
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    // Ends inside keep their exact values, because the next segment has to start at the same ones.
    let from = if enter > 0.0 { at(enter) } else { a };
    let to = if leave < 1.0 { at(leave) } else { b };
    (enter <= leave).then_some([from, to])
}

/// Removes points that are nearer to the last kept one than a tolerance in px, which starts at 0.3 and grows until at most `most` points are
/// left in all parts of a line together.
///
/// No point of the line is farther than the tolerance from a kept one. The ends of a part are kept unless the whole part is smaller.
pub fn thin(parts: &[Vec<Point>], most: usize) -> Vec<Vec<Point>> {
    let mut tolerance = 0.3;
    loop {
        let kept: Vec<Vec<Point>> = parts.iter().map(|part| keep_distant(part, tolerance)).collect();
        // The loop ends, because the tolerance exceeds every figure at some time.
        if kept.iter().map(Vec::len).sum::<usize>() <= most {
            return kept;
        }
        tolerance *= 1.5;
    }
}

fn keep_distant(line: &[Point], tolerance: f64) -> Vec<Point> {
    let near = |a: &Point, b: &Point| (a[0] - b[0]).hypot(a[1] - b[1]) <= tolerance;
    let mut kept: Vec<Point> = Vec::new();
    for (index, &point) in line.iter().enumerate() {
        if index + 1 == line.len() || !kept.last().is_some_and(|last| near(last, &point)) {
            kept.push(point);
        }
    }
    match kept.as_slice() {
        [from, to] if near(from, to) => Vec::new(),
        _ => kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_leaves_the_rectangle_and_returns_becomes_two() {
        let line = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
        let parts = clip(&line, [0.0, 0.0], [2.0, 4.0]);
        assert_eq!(parts, [vec![[1.0, 1.0], [2.0, 1.0]], vec![[2.0, 3.0], [1.0, 3.0]]]);
        assert_eq!(clip(&line, [0.0; 2], [4.0; 2]), [line.to_vec()]);
        assert!(clip(&[[5.0, 5.0], [6.0, 6.0]], [0.0; 2], [4.0; 2]).is_empty());
        assert!(clip(&[[f64::NAN, 1.0], [f64::NAN, 2.0]], [0.0; 2], [4.0; 2]).is_empty());
    }

    #[test]
    fn a_long_line_keeps_its_peaks_in_few_points() {
        let mut line: Vec<Point> = (0..100_000).map(|i| [f64::from(i) * 0.005, f64::from(i % 2) * 0.1]).collect();
        line[40_000][1] = 90.0;
        let [kept] = &thin(&[line.clone()], 2000)[..] else { panic!("one part") };
        assert!(kept.len() <= 2000, "{}", kept.len());
        assert!(kept.contains(&line[40_000]) && kept.contains(&line[99_999]));
        // The same in parts of two points each.
        let parts: Vec<Vec<Point>> = line.chunks(2).map(<[Point]>::to_vec).collect();
        assert!(thin(&parts, 2000).iter().flatten().count() <= 2000);
    }
}
