//! The fundamental matrix between two images (Hartley and Zisserman, Multiple View Geometry, sections 11.2 and 11.6).
//!
//! In: positions of the same points in both images. Out: the matrix F with x₂ᵀ F x₁ = 0 for static points, by RANSAC.

use nalgebra::{Matrix3, SMatrix, SymmetricEigen, Vector3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Position of a point in the first and in the second image, px.
pub(crate) type Pair = ([f32; 2], [f32; 2]);

/// Largest number of RANSAC iterations.
const MAX_DRAWS: f64 = 500.0;

/// Estimates F by RANSAC: inliers lie within `limit_px` of their epipolar line; iterations end when a sample without outliers was drawn
/// with probability `confidence`. `None` for fewer than eight pairs.
pub(crate) fn fundamental_ransac(
    pairs: &[Pair],
    limit_px: f64,
    confidence: f64,
    rng: &mut Pcg32,
) -> Option<Matrix3<f64>> {
    if pairs.len() < 8 {
        return None;
    }
    let mut best: Option<(usize, Matrix3<f64>)> = None;
    let (mut draws, mut needed) = (0.0, MAX_DRAWS);
    while draws < needed {
        draws += 1.0;
        let sample: [Pair; 8] =
            std::array::from_fn(|_| pairs[((u64::from(rng.next_u32()) * pairs.len() as u64) >> 32) as usize]);
        let Some(f) = eight_point(sample.iter().copied()) else { continue };
        let inliers = pairs.iter().filter(|pair| epipolar_distance(&f, pair) <= limit_px).count();
        if best.is_none_or(|(most, _)| inliers > most) {
            best = Some((inliers, f));
            let share = inliers as f64 / pairs.len() as f64;
            // Without inliers the logarithm is 0; the bounds keep the quotient finite and positive.
            let per_draw = libm::log1p(-share.powi(8).min(1.0 - 1e-12)).min(-1e-12);
            needed = (libm::log(1.0 - confidence) / per_draw).clamp(1.0, MAX_DRAWS);
        }
    }
    let (_, f) = best?;
    // The refit needs eight inliers; with fewer the sampled matrix is returned.
    let inliers = pairs.iter().filter(|pair| epipolar_distance(&f, pair) <= limit_px).copied();
    eight_point(inliers).or(Some(f))
}

/// Returns the distance of the second position from the epipolar line of the first, px.
pub(crate) fn epipolar_distance(f: &Matrix3<f64>, ([x1, y1], [x2, y2]): &Pair) -> f64 {
    let line = f * Vector3::new(f64::from(*x1), f64::from(*y1), 1.0);
    let length = libm::hypot(line.x, line.y);
    (line.x * f64::from(*x2) + line.y * f64::from(*y2) + line.z).abs() / length.max(1e-12)
}

/// Computes F by the normalised eight-point algorithm; `None` if the pairs do not determine it.
pub(super) fn eight_point(pairs: impl Iterator<Item = Pair> + Clone) -> Option<Matrix3<f64>> {
    let row = |a: &Vector3<f64>, b: &Vector3<f64>| {
        [SMatrix::from([b.x * a.x, b.x * a.y, b.x, b.y * a.x, b.y * a.y, b.y, a.x, a.y, 1.0])]
    };
    let [to_unit_1, f, to_unit_2] = direct_linear(pairs, 8, row)?;
    let mut svd = f.svd(true, true);
    let smallest = svd.singular_values.imin();
    svd.singular_values[smallest] = 0.0;
    let f = svd.recompose().ok()?;
    let f = to_unit_2.transpose() * f * to_unit_1;
    f.iter().all(|v| v.is_finite()).then_some(f)
}

/// Solves a homogeneous linear system for a 3 × 3 matrix M (direct linear transform). `rows` returns the equations of one pair of
/// normalised positions. Returns the normalisation of the first image, M, and the normalisation of the second image; `None` for fewer
/// than `min_pairs` pairs.
pub(super) fn direct_linear<const ROWS: usize>(
    pairs: impl Iterator<Item = Pair> + Clone,
    min_pairs: usize,
    rows: impl Fn(&Vector3<f64>, &Vector3<f64>) -> [SMatrix<f64, 9, 1>; ROWS],
) -> Option<[Matrix3<f64>; 3]> {
    if pairs.clone().count() < min_pairs {
        return None;
    }
    let to_unit_1 = normalisation(pairs.clone().map(|pair| pair.0))?;
    let to_unit_2 = normalisation(pairs.clone().map(|pair| pair.1))?;
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for ([x1, y1], [x2, y2]) in pairs {
        let a = to_unit_1 * Vector3::new(f64::from(x1), f64::from(y1), 1.0);
        let b = to_unit_2 * Vector3::new(f64::from(x2), f64::from(y2), 1.0);
        for row in rows(&a, &b) {
            normal += row * row.transpose();
        }
    }
    let eigen = SymmetricEigen::new(normal);
    let solution = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    Some([to_unit_1, Matrix3::from_row_slice(solution.as_slice()), to_unit_2])
}

/// Returns the similarity that moves the mean of positions to 0 and scales their mean distance from it to √2; `None` if they coincide.
fn normalisation(positions: impl Iterator<Item = [f32; 2]> + Clone) -> Option<Matrix3<f64>> {
    let count = positions.clone().count() as f64;
    let (sx, sy) = positions.clone().fold((0.0, 0.0), |(x, y), p| (x + f64::from(p[0]), y + f64::from(p[1])));
    let (mx, my) = (sx / count, sy / count);
    let spread: f64 = positions.map(|p| libm::hypot(f64::from(p[0]) - mx, f64::from(p[1]) - my)).sum::<f64>() / count;
    let s = std::f64::consts::SQRT_2 / spread;
    (spread > 1e-9).then(|| Matrix3::new(s, 0.0, -s * mx, 0.0, s, -s * my, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Point3};
    use proptest::prelude::*;

    fn project(p: Point3<f64>) -> [f32; 2] {
        [(520.0 * p.x / p.z + 320.0) as f32, (520.0 * p.y / p.z + 240.0) as f32]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn static_points_are_inliers_and_moving_points_are_not(
            points in prop::collection::vec((-2f64..2.0, -1.5f64..1.5, 2f64..6.0), 60..90),
            shift in prop::array::uniform3(0.05f64..0.2),
            turn in prop::array::uniform3(-0.05f64..0.05),
        ) {
            let motion = Isometry3::new(shift.into(), turn.into());
            let mut pairs: Vec<Pair> = points
                .iter()
                .map(|&(x, y, z)| Point3::new(x, y, z))
                .map(|p| (project(p), project(motion * p)))
                .collect();
            let f = fundamental_ransac(&pairs, 0.1, 0.99, &mut Pcg32::new(1, 2)).unwrap();
            prop_assert!(pairs.iter().filter(|pair| epipolar_distance(&f, pair) < 0.1).count() > pairs.len() * 9 / 10);
            // A quarter of the points moves by itself.
            let moving = pairs.len() / 4;
            for (k, pair) in pairs.iter_mut().take(moving).enumerate() {
                pair.1[k % 2] += 12.0;
            }
            let f = fundamental_ransac(&pairs, 0.1, 0.99, &mut Pcg32::new(1, 2)).unwrap();
            let outliers = |pairs: &[Pair]| pairs.iter().filter(|pair| epipolar_distance(&f, pair) > 1.0).count();
            prop_assert!(outliers(&pairs[moving..]) < pairs.len() / 6, "{} {}", outliers(&pairs[moving..]), outliers(&pairs[..moving]));
            prop_assert!(outliers(&pairs[..moving]) > moving / 2);
        }
    }

    #[test]
    fn too_few_pairs_make_no_matrix() {
        let pairs = [([1.0, 2.0], [3.0, 4.0]); 7];
        assert_eq!(fundamental_ransac(&pairs, 0.1, 0.99, &mut Pcg32::new(1, 2)), None);
    }
}
