//! Images without people: colour and depth of what people occlude, from other keyframes.
//!
//! In: a dense map with its volume, and a view of it. Out: the image of the view without moving objects; pixels that no keyframe
//! shows are not valid. DynaSLAM (IEEE RA-L 2018, section III-E) projects the colours of earlier frames into the view. Here their
//! depth is projected, and colours are sampled at that depth in the nearest frames: the image stays sharp, and a frame that still
//! shows a person is outvoted by the median.
//!
//! Where nothing more certain is known, static cells within a person mask are used too ([`crate::dense::static_recovery`]).

mod source;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::static_recovery::recover_static_cells;
use crate::dense::voxels::voxel_at;
use crate::dense::{DenseMap, Volume};
use crate::geometry::Pose;
use crate::image::{Image, RgbImage};
use source::{Certainty, Source};

/// Number of patches that are sampled for a colour at most, nearest first.
const SOURCES: usize = 30;
/// Number of colours of which the median is taken at most.
const MAX_COLORS: usize = 7;
/// An image without moving objects, on the cells of the dense map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Background {
    /// Colour, black where it is not known.
    pub color: RgbImage,
    /// Depth, m; 0 where it is not known.
    pub depth_m: Image<f32>,
    /// Whether the colour is known.
    pub valid: Image<bool>,
}

/// Makes images of a dense map without moving objects.
pub struct Backgrounds<'a> {
    dense_map: &'a DenseMap,
    volume: &'a Volume,
    /// For each patch in the volume, which of its moving cells are static by static recovery.
    recovered: Vec<Vec<bool>>,
}

impl<'a> Backgrounds<'a> {
    /// Prepares the images of a dense map with its volume. `progress` receives the number of finished patches.
    pub fn new(dense_map: &'a DenseMap, volume: &'a Volume, mut progress: impl FnMut(usize)) -> Self {
        let mut recovered_cells = Vec::with_capacity(dense_map.patches.len());
        for (number, placed) in dense_map.patches.iter().enumerate() {
            progress(number);
            let shown =
                |t_map_cam: Isometry3<f32>| recover_static_cells(volume, &t_map_cam, &dense_map.grid, &placed.patch);
            recovered_cells.push(volume.pose(number).map(|pose| shown(pose.cast())).unwrap_or_default());
        }
        Self { dense_map, volume, recovered: recovered_cells }
    }

    /// Returns the image of patch `number`: its own static cells, the others filled from other patches. `None` if there is no such
    /// patch.
    pub fn of_patch(&self, number: usize) -> Option<Background> {
        let placed = self.dense_map.patches.get(number)?;
        let sources = self.sources(&placed.t_world_cam, Some(number));
        Some(background(&self.dense_map.grid, sources, &placed.patch, &self.recovered[number]))
    }

    /// Returns the image of a frame that is not part of the dense map, at `t_world_cam`; `own` is its patch on the same cells.
    #[cfg(test)]
    pub(crate) fn of_frame(&self, own: &KeyframePatch, t_world_cam: &Pose) -> Background {
        let sources = self.sources(t_world_cam, None);
        let t_map_view = sources.first().map(|source| source.t_map_source * source.t_view_source.inverse());
        let recovered =
            t_map_view.map(|t_map_view| recover_static_cells(self.volume, &t_map_view, &self.dense_map.grid, own));
        background(&self.dense_map.grid, sources, own, &recovered.unwrap_or_default())
    }

    /// Returns all patches but the view's own, nearest first.
    fn sources(&self, t_world_cam: &Pose, own: Option<usize>) -> Vec<Source<'_>> {
        let mut sources: Vec<Source> = Vec::new();
        for (number, placed) in self.dense_map.patches.iter().enumerate().filter(|(number, _)| Some(*number) != own) {
            let Some(t_map_source) = self.volume.pose(number) else { continue };
            let t_view_source = t_world_cam.inverse() * placed.t_world_cam;
            sources.push(Source {
                distance: t_view_source.translation.vector.norm() + 2.0 * t_view_source.rotation.angle(),
                patch: &placed.patch,
                recovered: &self.recovered[number],
                grid: &self.dense_map.grid,
                volume: self.volume,
                t_view_source: t_view_source.cast(),
                t_map_source: t_map_source.cast(),
                gain: Vector3::repeat(1.0),
            });
        }
        sources.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        sources
    }
}

/// Returns the image on the cells of `grid`, from `sources` and the static cells of the view's `own` patch, including its
/// `recovered` ones.
fn background(grid: &CellGrid, mut sources: Vec<Source<'_>>, own: &KeyframePatch, recovered: &[bool]) -> Background {
    sources.iter_mut().take(SOURCES).for_each(|source| source.match_exposure(grid, own));
    let none = vec![0.0; grid.columns() * grid.rows()];
    let certain_m = projected_depth(grid, &sources, Certainty::Certain, &none);
    let mut depth_m = projected_depth(grid, &sources, Certainty::Likely, &certain_m);
    let mut color = RgbImage::new(grid.columns(), grid.rows());
    let mut valid = Image::new(grid.columns(), grid.rows());
    for (cell, (z, &[x, y])) in depth_m.iter_mut().zip(grid.rays()).enumerate() {
        if let Some(own_m) = own.surface_m(cell) {
            *z = own_m;
        }
        let color_of = |z: f32, certainty| {
            (z > 0.0).then(|| median_color(&sources, &Point3::new(x * z, y * z, z), certainty)).flatten()
        };
        let kept = (!own.moves(cell)).then(|| own.color(cell));
        let known = kept.or_else(|| color_of(*z, Certainty::Certain)).or_else(|| {
            let Some(shown) = own.reading(cell).filter(|_| recovered.get(cell) == Some(&true)) else {
                return color_of(*z, Certainty::Likely);
            };
            *z = shown.depth_m;
            Some(own.color(cell))
        });
        if let Some(known) = known {
            color.data_mut()[cell] = known;
            valid.data_mut()[cell] = true;
        }
    }
    let depth_m = Image::from_vec(grid.columns(), grid.rows(), depth_m).unwrap_or_default();
    Background { color, depth_m, valid }
}

/// Returns the depth of the nearest static surface in each cell, m; 0 where there is none. Depths in `known` are kept. A surface
/// within the range of the volume counts only if it is occupied there.
fn projected_depth(grid: &CellGrid, sources: &[Source], certainty: Certainty, known: &[f32]) -> Vec<f32> {
    let (columns, rows) = (grid.columns() as i32, grid.rows() as i32);
    let mut depth_m = known.to_vec();
    for source in sources {
        let Source { patch, recovered, volume, t_view_source, t_map_source, .. } = source;
        let config = volume.config();
        for (cell, [x, y]) in source.grid.rays().iter().enumerate() {
            let is_likely = certainty == Certainty::Likely;
            let Some(reading) = patch.reading(cell).filter(|reading| reading.moves == is_likely) else { continue };
            let z = reading.depth_m;
            let p = Point3::new(x * z, y * z, z);
            let in_view = t_view_source * p;
            let Some([column, row]) = grid.project(&in_view) else { continue };
            let is_surface = || match certainty {
                Certainty::Likely => recovered[cell],
                // Beyond its range the volume has no data.
                Certainty::Certain => {
                    z > config.max_range_m
                        || volume.is_occupied(voxel_at(&(t_map_source * p), 1.0 / config.resolution_m))
                }
            };
            // Number of cells of the view, along a side, that a cell of the source covers.
            let scale = p.z / in_view.z * source.grid.stride_px() as f32 / grid.stride_px() as f32;
            let reach = (0.5 * scale + 0.6).clamp(0.6, 4.0);
            let range =
                |at: f32, end: i32| ((at - reach).ceil().max(0.0) as i32, ((at + reach).floor() as i32).min(end - 1));
            let ((left, right), (top, bottom)) = (range(column, columns), range(row, rows));
            let target_cells = (top..=bottom).flat_map(|r| (left..=right).map(move |c| (r * columns + c) as usize));
            let is_open = |cell: &usize| known[*cell] == 0.0;
            if !target_cells.clone().any(|cell| is_open(&cell)) || !is_surface() {
                continue;
            }
            for cell in target_cells.filter(is_open) {
                let nearest = &mut depth_m[cell];
                if *nearest == 0.0 || in_view.z < *nearest {
                    *nearest = in_view.z;
                }
            }
        }
    }
    depth_m
}

/// Returns the median colour, channel by channel, that the nearest sources give a point of the view.
fn median_color(sources: &[Source], point: &Point3<f32>, certainty: Certainty) -> Option<[u8; 3]> {
    let mut colors: Vec<[u8; 3]> = Vec::with_capacity(MAX_COLORS);
    for source in sources.iter().take(SOURCES) {
        let color = source.color_at(point, certainty).map(|color| color.component_mul(&source.gain));
        colors.extend(color.map(|color| color.data.0[0].map(|v| (v + 0.5) as u8)));
        if colors.len() == MAX_COLORS {
            break;
        }
    }
    if colors.is_empty() {
        return None;
    }
    Some([0, 1, 2].map(|channel| {
        colors.sort_unstable_by_key(|rgb| rgb[channel]);
        colors[colors.len() / 2][channel]
    }))
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::dense::{DenseConfig, scene};

    #[test]
    fn static_cells_within_a_person_mask_are_used_as_far_as_they_continue_the_map() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        // In the view itself a person occludes everything; in the other one half of the wall is marked as moving, and a person is
        // in front of its other half.
        let own = scene::wall(&grid, 1.0, None);
        let (mut marked, mut other) = (own.clone(), scene::wall(&grid, 3.01, None));
        marked.depth.iter_mut().for_each(|d| *d |= 1 << 15);
        let (columns, half) = (grid.columns(), grid.columns() / 2);
        for (cell, depth) in other.depth.iter_mut().enumerate() {
            match (cell % columns, cell / columns) {
                (column, _) if column >= half => *depth |= 1 << 15,
                (column, row) if column < 9 && row < 9 => *depth = 2000 | 1 << 15,
                _ => {}
            }
        }
        let dense_map =
            DenseMap::of_poses(grid.clone(), [(Pose::identity(), marked.clone()), (Pose::identity(), other)]);
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let image = Backgrounds::new(&dense_map, &volume, |_| {}).of_patch(0).unwrap();
        let known = |column: usize, row: usize| image.valid.data()[row * columns + column];
        assert!(known(half - 1, 30) && known(half + 4, 30) && known(columns - 1, 30), "the wall continues");
        assert!(!known(4, 4), "the person stays out");
        assert!(image.depth_m.data().iter().all(|z| *z == 0.0 || (z - 3.01).abs() < 0.01));
    }

    #[test]
    fn a_person_is_replaced_by_the_wall_that_another_view_shows() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let moved = Pose::translation(0.4, 0.0, 0.0);
        // The wall has stripes.
        let mut other = scene::wall(&grid, 3.0, None);
        let stripe = |x: f32| if (x * 2.0).floor() as i32 % 2 == 0 { [200, 40, 40] } else { [40, 200, 40] };
        for (cell, [x, _]) in grid.rays().iter().enumerate() {
            other.color[cell] = stripe(x * 3.0 + 0.4 + 100.0);
        }
        let mut own = scene::wall(&grid, 3.0, Some(1.0));
        for (cell, [x, _]) in grid.rays().iter().enumerate() {
            own.color[cell] = stripe(x * 3.0 + 100.0);
        }
        own.depth.iter_mut().filter(|d| **d < 3000).for_each(|d| *d |= 1 << 15);
        let patches = [(Pose::identity(), own.clone()), (moved, other)];
        let dense_map = DenseMap::of_poses(grid.clone(), patches);
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let images = Backgrounds::new(&dense_map, &volume, |_| {});
        let image = images.of_patch(0).unwrap();
        assert_eq!(image, images.of_frame(&own, &Pose::identity()), "a frame need not be one of the patches");
        assert!(image.valid.data().iter().all(|valid| *valid), "everything is known");
        let mut filled = 0;
        for cell in (0..own.depth.len()).filter(|cell| own.moves(*cell)) {
            assert!((image.depth_m.data()[cell] - 3.0).abs() < 0.01);
            let x = grid.rays()[cell][0] * 3.0 + 100.0;
            if ((x * 2.0).fract() - 0.5).abs() < 0.4 {
                let (found, painted) = (image.color.data()[cell], stripe(x));
                assert!((0..3).all(|channel| found[channel].abs_diff(painted[channel]) < 20), "{x}: {found:?}");
            }
            filled += 1;
        }
        assert!(filled > 100);
    }
}
