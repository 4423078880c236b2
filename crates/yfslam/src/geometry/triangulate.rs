//! Triangulation of a point from two rays (midpoint method).
//!
//! In: origins and directions of two rays. Out: the point nearest to both.

use nalgebra::{Point3, Vector3};

/// Returns the midpoint of the shortest segment between two rays; `None` for parallel rays and if it lies behind an origin.
pub(crate) fn midpoint(
    center_a: &Vector3<f64>,
    ray_a: &Vector3<f64>,
    center_b: &Vector3<f64>,
    ray_b: &Vector3<f64>,
) -> Option<Point3<f64>> {
    let (aa, bb, ab) = (ray_a.norm_squared(), ray_b.norm_squared(), ray_a.dot(ray_b));
    let determinant = aa * bb - ab * ab;
    if determinant < 1e-12 * aa * bb {
        return None;
    }
    let d = center_b - center_a;
    let s = (d.dot(ray_a) * bb - d.dot(ray_b) * ab) / determinant;
    let t = (d.dot(ray_a) * ab - d.dot(ray_b) * aa) / determinant;
    (s > 0.0 && t > 0.0).then(|| Point3::from((center_a + ray_a * s + center_b + ray_b * t) * 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn midpoint_of_crossing_rays_is_the_crossing() {
        let p = Vector3::new(0.3, -0.2, 2.0);
        let (a, b) = (Vector3::zeros(), Vector3::new(0.5, 0.1, 0.0));
        let found = midpoint(&a, &((p - a) * 0.7), &b, &((p - b) * 0.4));
        assert!(found.is_some_and(|q| (q.coords - p).norm() < 1e-12));
        assert!(midpoint(&a, &p, &b, &p).is_none(), "parallel rays do not intersect");
    }
}
