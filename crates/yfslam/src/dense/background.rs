//! The view without people: colour and depth of what they hide, from other keyframes.
//!
//! In: a dense_map with its volume, and a view. Out: its picture, with the pixels that nobody has seen left out. DynaSLAM (IEEE RA-L 2018,
//! section III-E) projects earlier frames into the view. Here depth is projected, and colour looked up at that depth in the frames that
//! are nearest: it stays sharp, and one of them that still shows somebody is outvoted.
//!
//! Where nothing surer is known, cells within an outline that show what stands beside somebody are believed.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::static_recovery::beside;
use crate::dense::voxels::voxel_at;
use crate::dense::{DenseMap, Volume};
use crate::geometry::Pose;
use crate::image::{Image, RgbImage};

/// Frames that are asked for a colour at most, nearest first.
const SOURCES: usize = 30;
/// Colours of which the median is taken at most.
const VOTES: usize = 7;
/// Difference in depth up to which a frame sees the same surface, as a share of it, and m at least.
const SAME_SHARE: f32 = 0.04;
const SAME_M: f32 = 0.04;
/// Share of a likely colour that has to come from cells that show the surface.
const LIKELY_SHARE: f32 = 0.25;

/// Every so many cells light is compared, and so many must be seen by both.
const LIGHT_STEP: usize = 37;
const LIGHT_CELLS: usize = 50;

/// A view without what moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Background {
    /// Colour, black where it is not known.
    pub color: RgbImage,
    /// Depth, m; 0 where it is not known.
    pub depth_m: Image<f32>,
    /// Whether the colour is known.
    pub valid: Image<bool>,
}

/// How sure an answer has to be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sureness {
    /// Nothing moves there, and all around is the same surface.
    Sure,
    /// Nothing moves there, or what is said to move is where the map has a surface.
    Likely,
}

/// A patch that is asked.
struct Source<'a> {
    /// How far its view is from the one wanted.
    apart: f64,
    patch: &'a KeyframePatch,
    /// Which of its cells show what stands beside somebody.
    beside: &'a [bool],
    grid: &'a CellGrid,
    volume: &'a Volume,
    t_view_source: Isometry3<f32>,
    t_map_source: Isometry3<f32>,
    /// What its colours are multiplied by: exposure changes from frame to frame.
    gain: Vector3<f32>,
}

impl Source<'_> {
    /// The colour that it has for a point of the view.
    fn look(&self, point: &Point3<f32>, sureness: Sureness) -> Option<Vector3<f32>> {
        let p = self.t_view_source.inverse_transform_point(point);
        let at = self.grid.project(&p)?;
        look(self.grid, self.patch, at, p.z, sureness, self.beside)
    }

    /// Brings its light to that of the view's own patch, by what both see.
    fn match_light(&mut self, grid: &CellGrid, own: &KeyframePatch) {
        let (mut ours, mut theirs, mut count) = (Vector3::zeros(), Vector3::zeros(), 0);
        for (cell, [x, y]) in grid.rays().iter().enumerate().step_by(LIGHT_STEP) {
            let Some(z) = own.surface_m(cell) else { continue };
            if let Some(color) = self.look(&Point3::new(x * z, y * z, z), Sureness::Sure) {
                ours += Vector3::from(own.color(cell).map(f32::from));
                theirs += color;
                count += 1;
            }
        }
        if count >= LIGHT_CELLS {
            self.gain = ours.zip_map(&theirs, |ours, theirs| (ours / theirs.max(1.0)).clamp(0.5, 2.0));
        }
    }
}

/// Makes views of a dense_map without what moves.
pub struct Backgrounds<'a> {
    dense_map: &'a DenseMap,
    volume: &'a Volume,
    /// Of each patch that the volume has, which of its cells show what stands beside somebody.
    beside: Vec<Vec<bool>>,
}

impl<'a> Backgrounds<'a> {
    /// DepthHistory of a dense_map with its volume. `progress` hears how many patches are looked through.
    pub fn new(dense_map: &'a DenseMap, volume: &'a Volume, mut progress: impl FnMut(usize)) -> Self {
        let mut besides = Vec::with_capacity(dense_map.patches.len());
        for (number, one) in dense_map.patches.iter().enumerate() {
            progress(number);
            let shown = |t_map_cam: Isometry3<f32>| beside(volume, &t_map_cam, &dense_map.grid, &one.patch);
            besides.push(volume.pose(number).map(|pose| shown(pose.cast())).unwrap_or_default());
        }
        Self { dense_map, volume, beside: besides }
    }

    /// The view of patch `number`: of what it shows itself, what does not move is kept.
    pub fn of_patch(&self, number: usize) -> Option<Background> {
        let one = self.dense_map.patches.get(number)?;
        let sources = self.sources(&one.t_world_cam, Some(number));
        Some(background(&self.dense_map.grid, sources, &one.patch, &self.beside[number]))
    }

    /// The view of a frame that is none of the dense_map's patches, from `t_world_cam`: `own` is cut from it on the same cells.
    #[cfg(test)]
    pub(crate) fn of_frame(&self, own: &KeyframePatch, t_world_cam: &Pose) -> Background {
        let sources = self.sources(t_world_cam, None);
        let t_map_view = sources.first().map(|source| source.t_map_source * source.t_view_source.inverse());
        let beside = t_map_view.map(|t_map_view| beside(self.volume, &t_map_view, &self.dense_map.grid, own));
        background(&self.dense_map.grid, sources, own, &beside.unwrap_or_default())
    }

    /// All patches but the view's own, nearest first.
    fn sources(&self, t_world_cam: &Pose, own: Option<usize>) -> Vec<Source<'_>> {
        let mut sources: Vec<Source> = Vec::new();
        for (number, one) in self.dense_map.patches.iter().enumerate().filter(|(number, _)| Some(*number) != own) {
            let Some(t_map_source) = self.volume.pose(number) else { continue };
            let t_view_source = t_world_cam.inverse() * one.t_world_cam;
            sources.push(Source {
                apart: t_view_source.translation.vector.norm() + 2.0 * t_view_source.rotation.angle(),
                patch: &one.patch,
                beside: &self.beside[number],
                grid: &self.dense_map.grid,
                volume: self.volume,
                t_view_source: t_view_source.cast(),
                t_map_source: t_map_source.cast(),
                gain: Vector3::repeat(1.0),
            });
        }
        sources.sort_by(|a, b| a.apart.total_cmp(&b.apart));
        sources
    }
}

/// The view on the cells of `grid`, from `sources` and what its `own` patch shows, also `beside` what moves.
fn background(grid: &CellGrid, mut sources: Vec<Source<'_>>, own: &KeyframePatch, beside: &[bool]) -> Background {
    sources.iter_mut().take(SOURCES).for_each(|source| source.match_light(grid, own));
    let nowhere = vec![0.0; grid.columns() * grid.rows()];
    let sure_m = projected_depth(grid, &sources, Sureness::Sure, &nowhere);
    let mut depth_m = projected_depth(grid, &sources, Sureness::Likely, &sure_m);
    let mut color = RgbImage::new(grid.columns(), grid.rows());
    let mut valid = Image::new(grid.columns(), grid.rows());
    for (cell, (z, &[x, y])) in depth_m.iter_mut().zip(grid.rays()).enumerate() {
        if let Some(own_m) = own.surface_m(cell) {
            *z = own_m;
        }
        let asked =
            |z: f32, sureness| (z > 0.0).then(|| vote(&sources, &Point3::new(x * z, y * z, z), sureness)).flatten();
        let kept = (!own.moves(cell)).then(|| own.color(cell));
        let known = kept.or_else(|| asked(*z, Sureness::Sure)).or_else(|| {
            let Some(shown) = own.reading(cell).filter(|_| beside.get(cell) == Some(&true)) else {
                return asked(*z, Sureness::Likely);
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

/// Depth of the nearest static surface in each cell, m; 0 where there is none. It stays where it is `known`. Of what is in its range,
/// only what the volume has as occupied counts.
fn projected_depth(grid: &CellGrid, sources: &[Source], sureness: Sureness, known: &[f32]) -> Vec<f32> {
    let (columns, rows) = (grid.columns() as i32, grid.rows() as i32);
    let mut depth_m = known.to_vec();
    for source in sources {
        let Source { patch, beside, volume, t_view_source, t_map_source, .. } = source;
        let config = volume.config();
        for (cell, [x, y]) in source.grid.rays().iter().enumerate() {
            let likely = sureness == Sureness::Likely;
            let Some(reading) = patch.reading(cell).filter(|reading| reading.moves == likely) else { continue };
            let z = reading.depth_m;
            let p = Point3::new(x * z, y * z, z);
            let seen = t_view_source * p;
            let Some([column, row]) = grid.project(&seen) else { continue };
            let holds = || match sureness {
                Sureness::Likely => beside[cell],
                // Far away the volume says nothing.
                Sureness::Sure => {
                    z > config.max_range_m
                        || volume.is_occupied(voxel_at(&(t_map_source * p), 1.0 / config.resolution_m))
                }
            };
            // A cell of the source covers this many of the view.
            let scale = p.z / seen.z * source.grid.stride_px() as f32 / grid.stride_px() as f32;
            let reach = (0.5 * scale + 0.6).clamp(0.6, 4.0);
            let range =
                |at: f32, end: i32| ((at - reach).ceil().max(0.0) as i32, ((at + reach).floor() as i32).min(end - 1));
            let ((left, right), (top, bottom)) = (range(column, columns), range(row, rows));
            let covered = (top..=bottom).flat_map(|r| (left..=right).map(move |c| (r * columns + c) as usize));
            let open = |cell: &usize| known[*cell] == 0.0;
            if !covered.clone().any(|cell| open(&cell)) || !holds() {
                continue;
            }
            for cell in covered.filter(open) {
                let nearest = &mut depth_m[cell];
                if *nearest == 0.0 || seen.z < *nearest {
                    *nearest = seen.z;
                }
            }
        }
    }
    depth_m
}

/// Median colour that the nearest sources give a point of the view, channel by channel.
fn vote(sources: &[Source], point: &Point3<f32>, sureness: Sureness) -> Option<[u8; 3]> {
    let mut votes: Vec<[u8; 3]> = Vec::with_capacity(VOTES);
    for source in sources.iter().take(SOURCES) {
        let color = source.look(point, sureness).map(|color| color.component_mul(&source.gain));
        votes.extend(color.map(|color| color.data.0[0].map(|v| (v + 0.5) as u8)));
        if votes.len() == VOTES {
            break;
        }
    }
    if votes.is_empty() {
        return None;
    }
    Some([0, 1, 2].map(|channel| {
        votes.sort_unstable_by_key(|rgb| rgb[channel]);
        votes[votes.len() / 2][channel]
    }))
}

/// The colour of a patch at a position, between its cells; `None` if another surface or something that moves is there. If that is
/// asked for what is likely, such cells are left out, and those that show what stands `beside` are not.
fn look(
    grid: &CellGrid,
    patch: &KeyframePatch,
    [column, row]: [f32; 2],
    z: f32,
    sureness: Sureness,
    beside: &[bool],
) -> Option<Vector3<f32>> {
    let (left, top) = (column.floor(), row.floor());
    let (dx, dy) = (column - left, row - top);
    let (mut sum, mut weights, mut same) = (Vector3::<f32>::zeros(), 0.0, false);
    for (x, y, weight) in [
        (0.0, 0.0, (1.0 - dx) * (1.0 - dy)),
        (1.0, 0.0, dx * (1.0 - dy)),
        (0.0, 1.0, (1.0 - dx) * dy),
        (1.0, 1.0, dx * dy),
    ] {
        let (c, r) = (left + x, top + y);
        if c < 0.0 || r < 0.0 || c >= grid.columns() as f32 || r >= grid.rows() as f32 {
            continue;
        }
        let cell = r as usize * grid.columns() + c as usize;
        let depth = patch.reading(cell).map(|reading| reading.depth_m);
        let other = depth.is_some_and(|depth| (depth - z).abs() > SAME_M + SAME_SHARE * z);
        let likely = sureness == Sureness::Likely;
        if other || patch.moves(cell) && !(likely && beside[cell]) {
            if likely {
                continue;
            }
            return None;
        }
        same |= depth.is_some();
        sum += Vector3::from(patch.color(cell).map(f32::from)) * weight;
        weights += weight;
    }
    let least = if sureness == Sureness::Likely { LIKELY_SHARE } else { 0.0 };
    (same && weights > least).then(|| sum / weights)
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::dense::{DenseConfig, scene};

    #[test]
    fn what_an_outline_wrongly_covers_is_believed_as_far_as_it_goes_on_with_the_map() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        // In the view itself somebody hides all; in the other one half of the wall is marked, and somebody stands before its other half.
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
        let seen = Backgrounds::new(&dense_map, &volume, |_| {}).of_patch(0).unwrap();
        let known = |column: usize, row: usize| seen.valid.data()[row * columns + column];
        assert!(known(half - 1, 30) && known(half + 4, 30) && known(columns - 1, 30), "the wall goes on");
        assert!(!known(4, 4), "somebody in the way stays out");
        assert!(seen.depth_m.data().iter().all(|z| *z == 0.0 || (z - 3.01).abs() < 0.01));
    }

    #[test]
    fn a_person_is_replaced_by_the_wall_that_another_view_shows() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let moved = Pose::translation(0.4, 0.0, 0.0);
        // The wall is painted in stripes.
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
        let views = Backgrounds::new(&dense_map, &volume, |_| {});
        let seen = views.of_patch(0).unwrap();
        assert_eq!(seen, views.of_frame(&own, &Pose::identity()), "it need not be one of the patches");
        assert!(seen.valid.data().iter().all(|valid| *valid), "everything is known");
        let mut filled = 0;
        for cell in (0..own.depth.len()).filter(|cell| own.moves(*cell)) {
            assert!((seen.depth_m.data()[cell] - 3.0).abs() < 0.01);
            let x = grid.rays()[cell][0] * 3.0 + 100.0;
            if ((x * 2.0).fract() - 0.5).abs() < 0.4 {
                let (found, painted) = (seen.color.data()[cell], stripe(x));
                assert!((0..3).all(|channel| found[channel].abs_diff(painted[channel]) < 20), "{x}: {found:?}");
            }
            filled += 1;
        }
        assert!(filled > 100);
    }
}
