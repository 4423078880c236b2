//! Writes the products of a dense map.
//!
//! In: a dense map and its volume. Out: files, and a line on each product for the summary.

use std::path::{Path, PathBuf};

use anyhow::Result;
use yfslam::dense::{
    Background, Backgrounds, Classes, CloudPoint, DenseMap, GridCell, KnownVoxel, PlacedPatch, Volume, cloud,
    ground_grid, mesh,
};
use yfslam::{Image, MapFrame, RgbImage};
use yfslam_io::write::{
    Coordinates, Labels, OctreeFormat, OctreeVoxel, PlyPoint, write_color_png, write_depth_png, write_mask_png,
    write_nav2, write_octomap, write_pcd, write_ply, write_ply_mesh,
};
use yfslam_io::{StampedPose, prepare_folder, write_atomically, write_trajectory};

use super::options::HeightBand;
use crate::draw::colors::{FREE, class_color};
use crate::draw::dense_image::{SHOWN_M, from_above, from_corner};
use crate::draw::grid_image::draw_grid;
use crate::output::class_legend::ClassLegend;
use crate::output::map_frame;
use crate::ui::progress::Progress;
use crate::ui::terminal::Terminal;

/// Number of keyframes whose background is written.
const BACKGROUNDS: usize = 6;
/// Depth units of their depth images, as in TUM recordings, 1/m.
const BACKGROUND_UNITS_PER_M: f32 = 5000.0;
/// Width and height of images of the map, px.
const IMAGE_PX: [usize; 2] = [900, 600];

/// Exports one volume.
pub struct Exporter<'a> {
    pub map: &'a DenseMap,
    /// The frame of all products.
    pub frame: MapFrame,
    pub volume: Volume,
    /// Classes of the voxels; `None` if the detector of the run had none.
    pub classes: Option<Classes>,
    /// Height of the floor.
    pub floor_m: f32,
    pub folder: PathBuf,
    pub terminal: Terminal,
}

impl Exporter<'_> {
    /// Writes the transformation into the frame of the products, and the path of the camera in it.
    pub fn frame(&self) -> Result<String> {
        map_frame::write(&self.folder, &self.frame)?;
        write_trajectory(&self.folder.join("path.txt"), &self.path())?;
        Ok(String::new())
    }

    /// Returns the poses of the keyframes in the frame of the products, in the order of time.
    fn path(&self) -> Vec<StampedPose> {
        let r_map_world = self.frame.r_map_world;
        let pose = |placed: &PlacedPatch| StampedPose::new(placed.timestamp_ns, r_map_world * placed.t_world_cam);
        let mut path: Vec<StampedPose> = self.map.patches.iter().map(pose).collect();
        path.sort_by_key(|pose| pose.timestamp_ns);
        path
    }

    /// Writes the point cloud and images of it.
    pub fn cloud(&self) -> Result<String> {
        let work = |report: &mut dyn FnMut(usize)| cloud(self.map, &self.volume, report);
        let points = with_progress(self.terminal, "cloud", self.map, work);
        let ply = |p: &CloudPoint| PlyPoint { position_m: p.position_m, color: p.color };
        let point_classes: Option<Vec<u8>> =
            self.classes.as_ref().map(|classes| points.iter().map(|p| classes.get(p.voxel)).collect());
        let labels = point_classes.as_ref().map(|classes| Labels { classes, names: &self.map.class_names });
        write_ply(&self.folder.join("cloud.ply"), Coordinates::Map, points.iter().map(ply), labels)?;
        write_pcd(&self.folder.join("cloud.pcd"), points.iter().map(ply), labels)?;
        let resolution_m = self.volume.config().resolution_m;
        let cut_m = self.floor_m + SHOWN_M;
        let above = from_above(&points, resolution_m, cut_m, IMAGE_PX);
        write_color_png(&self.folder.join("above.png"), &above)?;
        let corner = from_corner(&points, resolution_m, cut_m, IMAGE_PX);
        write_color_png(&self.folder.join("corner.png"), &corner)?;
        if let Some(point_classes) = point_classes {
            let by_class = |(point, class): (&CloudPoint, u8)| CloudPoint { color: class_color(class), ..*point };
            let points: Vec<CloudPoint> = points.iter().zip(point_classes).map(by_class).collect();
            let corner = from_corner(&points, resolution_m, cut_m, IMAGE_PX);
            write_color_png(&self.folder.join("classes.png"), &corner)?;
        }
        Ok(format!("cloud: {} points\n", points.len()))
    }

    /// Writes names, colours and voxel counts of the classes.
    pub fn legend(&self) -> Result<String> {
        let Some(classes) = &self.classes else { return Ok(String::new()) };
        let legend = ClassLegend::of(&self.map.class_names, &self.volume, classes);
        let json = serde_json::to_vec_pretty(&legend)?;
        write_atomically(&self.folder.join("classes.json"), |file| file.write_all(&json))?;
        Ok(legend.to_string())
    }

    /// Writes the occupancy octrees.
    pub fn octomap(&self) -> Result<String> {
        let resolution = f64::from(self.volume.config().resolution_m);
        // Rounds away the error of a 32-bit float.
        let resolution = (resolution * 1e6).round() / 1e6;
        let color = |v: &KnownVoxel| match &self.classes {
            Some(classes) if v.occupied => class_color(classes.get(v.voxel)),
            _ => FREE,
        };
        let tree = |v: KnownVoxel| OctreeVoxel { voxel: v.voxel, log_odds: v.log_odds, color: color(&v) };
        let write = |name: &str, format| {
            let voxels = |block| self.volume.voxels_in(block).map(tree);
            write_octomap(&self.folder.join(name), resolution, self.volume.blocks(), voxels, format)
        };
        let binary = write("octomap.bt", OctreeFormat::Binary)?;
        let full = write("octomap.ot", OctreeFormat::LogOdds)?;
        let mut text = format!("octomap: {} nodes in octomap.bt, {} in octomap.ot", binary.nodes, full.nodes);
        if self.classes.is_some() {
            let semantic = write("semantic.ot", OctreeFormat::Colors)?;
            text += &format!(", {} in semantic.ot", semantic.nodes);
        }
        Ok(text + "\n")
    }

    /// Writes the occupancy grid of the heights `band` above the floor, and an image of it with the path.
    pub fn grid(&self, HeightBand(band): HeightBand) -> Result<String> {
        let grid = ground_grid(&self.volume, band.map(|height| self.floor_m + height));
        write_nav2(&self.folder.join("grid.pgm"), &grid)?;
        let position = |pose: &StampedPose| [pose.t_world_cam.translation.x, pose.t_world_cam.translation.y];
        let path: Vec<[f64; 2]> = self.path().iter().map(position).collect();
        write_color_png(&self.folder.join("grid.png"), &draw_grid(&grid, &path))?;
        let count = |what| grid.cells.iter().filter(|cell| **cell == what).count();
        let (occupied, free) = (count(GridCell::Occupied), count(GridCell::Free));
        Ok(format!("grid: {} × {} cells, {occupied} occupied, {free} free\n", grid.width, grid.height))
    }

    /// Writes the mesh.
    pub fn mesh(&self) -> Result<String> {
        let mut progress: Option<Progress> = None;
        let mesh = mesh(self.map, &self.volume, |done, blocks| {
            let progress = progress.get_or_insert_with(|| Progress::new(self.terminal, "mesh", blocks));
            progress.at(done, "blocks", String::new);
        });
        progress.into_iter().for_each(Progress::finish);
        let vertices = mesh.vertices_m.iter().zip(&mesh.colors);
        let vertices = vertices.map(|(&position_m, &color)| PlyPoint { position_m, color });
        write_ply_mesh(&self.folder.join("mesh.ply"), Coordinates::Map, vertices, &mesh.triangles)?;
        Ok(format!("mesh: {} vertices, {} triangles\n", mesh.vertices_m.len(), mesh.triangles.len()))
    }

    /// Writes images of the keyframes with most people, without these people.
    pub fn background(&self) -> Result<String> {
        let DenseMap { grid, patches, .. } = self.map;
        let folder = self.folder.join("background");
        prepare_folder(&folder)?;
        let cells = grid.rays().len();
        let moving = |number: usize| (0..cells).filter(|cell| patches[number].patch.moves(*cell)).count();
        let mut most_hidden: Vec<(usize, usize)> = (0..patches.len()).map(|number| (moving(number), number)).collect();
        most_hidden.sort_by_key(|(moving, number)| (std::cmp::Reverse(*moving), *number));
        most_hidden.truncate(BACKGROUNDS);
        let views = with_progress(self.terminal, "backgrounds", self.map, |report| {
            Backgrounds::new(self.map, &self.volume, report)
        });
        let (mut filled, mut hidden) = (0, 0);
        for &(moving, number) in &most_hidden {
            let patch = &patches[number].patch;
            let Some(view) = views.of_patch(number) else { continue };
            let colors = (0..cells).map(|cell| patch.color(cell)).collect();
            let original = RgbImage::from_vec(view.color.width(), view.color.height(), colors).unwrap_or_default();
            write_view(&folder, &format!("{number:06}"), &original, &view)?;
            hidden += moving;
            filled += view.valid.data().iter().filter(|valid| **valid).count() + moving - cells;
        }
        let share = 100.0 * filled as f64 / hidden.max(1) as f64;
        Ok(format!("background: {} views, {share:.1} % of what people hide is known\n", most_hidden.len()))
    }
}

/// Writes the original image, and the one without people as colour, depth and mask of known pixels.
fn write_view(folder: &Path, name: &str, original: &RgbImage, view: &Background) -> Result<()> {
    write_color_png(&folder.join(format!("{name}-seen.png")), original)?;
    write_color_png(&folder.join(format!("{name}.png")), &view.color)?;
    let units = |z: &f32| (z * BACKGROUND_UNITS_PER_M).min(f32::from(u16::MAX)) as u16;
    let (width, height) = (view.color.width(), view.color.height());
    let depth = Image::from_vec(width, height, view.depth_m.data().iter().map(units).collect()).unwrap_or_default();
    write_depth_png(&folder.join(format!("{name}-depth.png")), &depth)?;
    let mask = view.valid.data().iter().map(|valid| if *valid { 255 } else { 0 }).collect();
    let mask = Image::from_vec(width, height, mask).unwrap_or_default();
    Ok(write_mask_png(&folder.join(format!("{name}-valid.png")), &mask)?)
}

/// Shows the progress of `work`, which reports the number of patches that are done.
pub fn with_progress<T>(
    terminal: Terminal,
    label: &str,
    map: &DenseMap,
    work: impl FnOnce(&mut dyn FnMut(usize)) -> T,
) -> T {
    let mut progress = Progress::new(terminal, label, map.patches.len());
    let result = work(&mut |done| progress.at(done, "keyframes", String::new));
    progress.finish();
    result
}
