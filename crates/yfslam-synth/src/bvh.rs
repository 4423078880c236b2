//! Bounding-volume hierarchy over a mesh, for shadow rays.
//!
//! In: a mesh. Out: whether a ray segment hits it. Median split along the longest axis; rays are tested with the slab
//! method and Möller–Trumbore ("Fast, minimum storage ray/triangle intersection", 1997).

use crate::mesh::{Lighting, Mesh, Vec3};

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Inner node: index of the second child (the first follows its parent). Leaf: index of the first triangle.
    link: u32,
    /// Number of triangles; 0 for inner nodes.
    count: u32,
}

/// The hierarchy.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Corner and two edges per triangle, in leaf order.
    triangles: Vec<[Vec3; 3]>,
}

const LEAF: usize = 4;

impl Bvh {
    /// Builds the hierarchy over all triangles that cast shadows (lamps do not).
    pub fn new(mesh: &Mesh) -> Self {
        let mut corners: Vec<[Vec3; 3]> = mesh
            .triangles
            .iter()
            .filter(|t| !matches!(mesh.patches[t.patch as usize].lighting, Lighting::Emissive(_) | Lighting::Lamp(_)))
            .map(|t| t.vertices.map(|i| mesh.vertices[i as usize].position))
            .collect();
        let mut bvh = Self { nodes: Vec::new(), triangles: Vec::new() };
        if !corners.is_empty() {
            bvh.build(&mut corners);
        }
        bvh
    }

    fn build(&mut self, corners: &mut [[Vec3; 3]]) {
        let points = || corners.iter().flatten();
        let low = points().fold(Vec3::repeat(f32::INFINITY), |a, b| a.inf(b));
        let high = points().fold(Vec3::repeat(f32::NEG_INFINITY), |a, b| a.sup(b));
        let index = self.nodes.len();
        if corners.len() <= LEAF {
            self.nodes.push(Node { low, high, link: self.triangles.len() as u32, count: corners.len() as u32 });
            self.triangles.extend(corners.iter().map(|[a, b, c]| [*a, b - a, c - a]));
            return;
        }
        let axis = (high - low).imax();
        let middle = corners.len() / 2;
        let key = |t: &[Vec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        corners.sort_by(|a, b| key(a).total_cmp(&key(b)));
        self.nodes.push(Node { low, high, link: 0, count: 0 });
        let (left, right) = corners.split_at_mut(middle);
        self.build(left);
        self.nodes[index].link = self.nodes.len() as u32;
        self.build(right);
    }

    /// Returns whether the ray from `origin` along the unit vector `direction` hits anything nearer than `far`.
    pub fn hit(&self, origin: &Vec3, direction: &Vec3, far: f32) -> bool {
        let inverse = direction.map(|d| 1.0 / d);
        let mut stack = [0u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if !crosses(node, origin, &inverse, far) {
                continue;
            }
            if node.count > 0 {
                let leaf = &self.triangles[node.link as usize..(node.link + node.count) as usize];
                if leaf.iter().any(|t| intersects(t, origin, direction, far)) {
                    return true;
                }
            } else if depth + 2 <= stack.len() {
                stack[depth] = node.link;
                stack[depth + 1] = index + 1;
                depth += 2;
            }
        }
        false
    }
}

fn crosses(node: &Node, origin: &Vec3, inverse: &Vec3, far: f32) -> bool {
    let a = (node.low - origin).component_mul(inverse);
    let b = (node.high - origin).component_mul(inverse);
    let (near, out) = (a.inf(&b).max(), a.sup(&b).min());
    near <= out && out > 0.0 && near < far
}

fn intersects([a, ab, ac]: &[Vec3; 3], origin: &Vec3, direction: &Vec3, far: f32) -> bool {
    let p = direction.cross(ac);
    let det = ab.dot(&p);
    if det.abs() < 1e-12 {
        return false;
    }
    let s = origin - a;
    let u = s.dot(&p) / det;
    let q = s.cross(ab);
    let v = direction.dot(&q) / det;
    let t = ac.dot(&q) / det;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-5 && t < far
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Patch;
    use crate::rng::Rng;

    #[test]
    fn agrees_with_testing_every_triangle() {
        let mut mesh = Mesh::default();
        let mut rng = Rng::new(5, 0);
        let mut random = |scale: f32| Vec3::from_fn(|_, _| rng.range(-scale, scale));
        let patch = Patch { texture: 0, lighting: Lighting::Vertex, instance: 0 };
        for _ in 0..100 {
            mesh.rectangle(random(2.0), random(0.5), random(0.5), patch);
        }
        let bvh = Bvh::new(&mesh);
        let mut hits = 0;
        for _ in 0..500 {
            let (origin, direction) = (random(2.0), random(1.0).normalize());
            let brute = bvh.triangles.iter().any(|t| intersects(t, &origin, &direction, 1.5));
            assert_eq!(bvh.hit(&origin, &direction, 1.5), brute);
            hits += usize::from(brute);
        }
        assert!((50..450).contains(&hits), "{hits} hits make a fair test");
    }
}
