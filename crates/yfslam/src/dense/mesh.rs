//! A mesh of the surfaces: a truncated signed distance field (Curless and Levoy, SIGGRAPH 1996; KinectFusion, ISMAR 2011, section
//! 3.3), and its zero level by surface nets (Gibson, MICCAI 1998).
//!
//! In: a dense map with its volume. Out: triangles with colour. The field is sampled at the centres of voxels and averaged over all
//! patches. Surfaces that are not occupied in the volume, such as those of a person who has left, are left out.

use std::collections::{BTreeMap, BTreeSet};

#[cfg(test)]
use nalgebra::Point3;
use nalgebra::{Isometry3, Vector3};

use crate::dense::cloud::neighbours;
use crate::dense::voxels::{Block, VOXELS, Voxel, block_of, center_m, index_in_block, voxel_in};
use crate::dense::{DenseMap, Volume};

/// Triangles and their corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions, m, in the frame of the volume.
    pub vertices_m: Vec<[f32; 3]>,
    /// Colour of each vertex.
    pub colors: Vec<[u8; 3]>,
    /// Indices of the vertices, counter-clockwise from the free side.
    pub triangles: Vec<[u32; 3]>,
}

/// Mean signed distance at the centre of a voxel, in parts of the truncation: positive before the surface.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    distance: f32,
    weight: f32,
    color: [f32; 3],
    color_weight: f32,
}

type Field = BTreeMap<Block, Vec<Sample>>;

/// Returns the mesh of a dense map. `progress` receives the number of finished blocks and of all blocks.
pub fn mesh(dense_map: &DenseMap, volume: &Volume, mut progress: impl FnMut(usize, usize)) -> Mesh {
    let near = near_surfaces(volume);
    let mut field = Field::new();
    for (done, &block) in near.iter().enumerate() {
        progress(done, near.len());
        field.insert(block, sample(dense_map, volume, block));
    }
    surface(volume, &field)
}

/// Returns the memory that the field of a mesh takes, bytes.
pub(crate) fn bytes(volume: &Volume) -> usize {
    near_surfaces(volume).len() * VOXELS * size_of::<Sample>()
}

/// Returns the blocks within two voxels of occupied ones.
fn near_surfaces(volume: &Volume) -> BTreeSet<Block> {
    let mut near = BTreeSet::new();
    for known in volume.voxels().filter(|known| known.occupied) {
        for corner in 0..8 {
            let side = |axis: usize| if corner >> axis & 1 == 1 { 2 } else { -2 };
            near.insert(block_of([0, 1, 2].map(|axis| known.voxel[axis] + side(axis))));
        }
    }
    near
}

/// Returns the field in a block.
fn sample(dense_map: &DenseMap, volume: &Volume, block: Block) -> Vec<Sample> {
    let config = volume.config();
    let truncation_m = config.truncation_voxels * config.resolution_m;
    let around = (0..27).map(|i| [block[0] + i % 3 - 1, block[1] + i / 3 % 3 - 1, block[2] + i / 9 - 1]);
    let observing: BTreeSet<usize> = around.flat_map(|block| volume.patches_observing(block)).collect();
    let mut samples = vec![Sample::default(); VOXELS];
    for number in observing {
        let (Some(placed), Some(pose)) = (dense_map.patches.get(number), volume.pose(number)) else { continue };
        let t_cam_map: Isometry3<f32> = pose.inverse().cast();
        for (index, sample) in samples.iter_mut().enumerate() {
            let p = t_cam_map * center_m(voxel_in(block, index), config.resolution_m);
            let Some([column, row]) = dense_map.grid.project(&p) else { continue };
            let cell = (row + 0.5) as usize * dense_map.grid.columns() + (column + 0.5) as usize;
            let Some(depth_m) = placed.patch.surface_m(cell).filter(|z| *z <= config.max_range_m) else { continue };
            // Distance along the ray, not along the optical axis.
            let distance = (depth_m - p.z) * p.coords.norm() / p.z / truncation_m;
            if distance > -1.0 {
                // Noise grows with the square of the depth.
                let weight = 1.0 / (1.0 + depth_m * depth_m);
                sample.add(distance.min(1.0), weight, placed.patch.color(cell));
            }
        }
    }
    samples
}

/// Returns the zero level of the field.
fn surface(volume: &Volume, field: &Field) -> Mesh {
    let resolution_m = volume.config().resolution_m;
    let mut mesh = Mesh::default();
    let mut numbers: BTreeMap<Voxel, u32> = BTreeMap::new();
    for &block in field.keys() {
        for index in 0..VOXELS {
            let voxel = voxel_in(block, index);
            if let Some((position, color)) = vertex(volume, field, voxel) {
                numbers.insert(voxel, mesh.vertices_m.len() as u32);
                let corner = center_m(voxel, resolution_m);
                mesh.vertices_m.push((corner + position * resolution_m).coords.into());
                mesh.colors.push(color);
            }
        }
    }
    // Each grid edge whose ends differ in sign gives a quadrilateral of the four cubes around it.
    for &voxel in numbers.keys() {
        for axis in 0..3 {
            let (Some(here), Some(there)) = (sample_at(field, voxel), sample_at(field, neighbour(voxel, axis, 1)))
            else {
                continue;
            };
            if (here.distance > 0.0) == (there.distance > 0.0) {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let back = |voxel, axis| neighbour(voxel, axis, -1);
            let cubes = [voxel, back(voxel, u), back(back(voxel, u), v), back(voxel, v)];
            let [Some(&a), Some(&b), Some(&c), Some(&d)] = cubes.map(|cube| numbers.get(&cube)) else { continue };
            let halves = if here.distance > 0.0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
            mesh.triangles.extend(halves);
        }
    }
    mesh
}

/// Returns the vertex in the cube whose lowest corner is the centre of `voxel`: offset from that corner in voxels, and colour.
fn vertex(volume: &Volume, field: &Field, voxel: Voxel) -> Option<(Vector3<f32>, [u8; 3])> {
    let mut corners = [Sample::default(); 8];
    for (number, corner) in corners.iter_mut().enumerate() {
        *corner = sample_at(field, [0, 1, 2].map(|axis| voxel[axis] + (number >> axis & 1) as i32))?;
    }
    let positive = corners.iter().filter(|corner| corner.distance > 0.0).count();
    if positive == 0 || positive == 8 || !is_occupied_surface(volume, voxel) {
        return None;
    }
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for (from, axis) in (0..8usize).flat_map(|from| (0..3).map(move |axis| (from, axis))) {
        let to = from | 1 << axis;
        let (a, b) = (corners[from].distance, corners[to].distance);
        if to != from && (a > 0.0) != (b > 0.0) {
            let mut at = Vector3::from_fn(|axis, _| (from >> axis & 1) as f32);
            at[axis] += a / (a - b);
            sum += at;
            count += 1.0;
        }
    }
    let mut color = Sample::default();
    corners.iter().for_each(|corner| color.add_color(corner.color, corner.color_weight));
    let mean = |v: f32| (v / color.color_weight.max(1e-6) + 0.5) as u8;
    Some((sum / count, color.color.map(mean)))
}

/// Returns whether a corner of the cube is occupied in the volume and not an outlier.
fn is_occupied_surface(volume: &Volume, voxel: Voxel) -> bool {
    (0..8).any(|number| {
        let corner = [0, 1, 2].map(|axis| voxel[axis] + (number >> axis & 1));
        volume.is_occupied(corner) && neighbours(volume, corner) >= volume.config().min_neighbours
    })
}

/// Returns the sample of a voxel; `None` if no patch has measured it.
fn sample_at(field: &Field, voxel: Voxel) -> Option<Sample> {
    field.get(&block_of(voxel)).map(|samples| samples[index_in_block(voxel)]).filter(|sample| sample.weight > 0.0)
}

/// Returns the neighbour of a voxel along an axis.
fn neighbour(mut voxel: Voxel, axis: usize, by: i32) -> Voxel {
    voxel[axis] += by;
    voxel
}

impl Sample {
    fn add(&mut self, distance: f32, weight: f32, color: [u8; 3]) {
        let total = self.weight + weight;
        self.distance = (self.distance * self.weight + distance * weight) / total;
        self.weight = total;
        if distance < 1.0 {
            self.add_color(color.map(|v| f32::from(v) * weight), weight);
        }
    }

    fn add_color(&mut self, sum: [f32; 3], weight: f32) {
        self.color.iter_mut().zip(sum).for_each(|(own, more)| *own += more);
        self.color_weight += weight;
    }
}

impl Mesh {
    /// Returns the corners of a triangle, m.
    #[cfg(test)]
    pub(crate) fn corners(&self, triangle: [u32; 3]) -> [Point3<f32>; 3] {
        triangle.map(|vertex| self.vertices_m.get(vertex as usize).copied().unwrap_or_default().into())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::dense::{CellGrid, DenseConfig, scene};
    use crate::geometry::Pose;

    #[test]
    fn a_wall_becomes_a_plane_of_its_size_that_faces_the_camera() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let pose = |k: i64| Pose::translation(0.02 * k as f64, 0.0, 0.013 * k as f64);
        // Observed from three positions.
        let patch = |k: i64| (pose(k), scene::wall(&grid, 2.0 - 0.013 * k as f32, None));
        let dense_map = DenseMap::of_poses(grid.clone(), (0..3).map(patch));
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let mesh = mesh(&dense_map, &volume, |_, _| {});
        assert!(mesh.vertices_m.iter().all(|p| (p[2] - 2.0).abs() < 0.004), "on the wall");
        assert!(mesh.colors.iter().all(|color| *color == [120, 130, 140]));
        let mut area = 0.0;
        for &triangle in &mesh.triangles {
            let [a, b, c] = mesh.corners(triangle);
            let normal = (b - a).cross(&(c - a));
            assert!(normal.z <= 0.0, "the normal points to the camera");
            area += 0.5 * normal.norm();
        }
        let expected = 4.0 * (158.0 / 134.0) * (118.0 / 134.0);
        assert!((area - expected).abs() < 0.12 * expected, "{area} of {expected}");
    }
}
