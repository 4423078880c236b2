//! `yfslam map`: what a run has seen, as maps that people use.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use nalgebra::{UnitQuaternion, Vector3};
use yfslam::dense::background::{Background, Backgrounds};
use yfslam::dense::classes::{Classes, classes};
use yfslam::dense::cloud::{self, CloudPoint, cloud};
use yfslam::dense::grid::{GridCell, ground_grid};
use yfslam::dense::mesh::{self, mesh};
use yfslam::dense::persist::decode;
use yfslam::dense::{DenseConfig, KnownVoxel, Survey, Volume, check_memory, up};
use yfslam::image::{Image, RgbImage};
use yfslam_io::write::{
    Labels, OctreeFormat, OctreeVoxel, PlyPoint, write_color_png, write_depth_png, write_mask_png, write_nav2,
    write_octomap, write_pcd, write_ply, write_ply_mesh,
};
use yfslam_io::write_atomically;

use crate::draw::colors::{FREE, class_color};
use crate::draw::dense_image::{SHOWN_M, from_above, from_corner};
use crate::input::settings::SettingsArgs;
use crate::output::class_legend::ClassLegend;
use crate::output::dense::DENSE_FILE;
use crate::stats::cpu;
use crate::ui::progress::Progress;
use crate::ui::terminal::Terminal;

const EXAMPLES: &str = "\
Examples:
  yfslam run rgbd_bonn_crowd --camera bonn --dense
  yfslam map yfslam-out/rgbd_bonn_crowd                              all products
  yfslam map yfslam-out/rgbd_bonn_crowd --octomap --grid --resolution 0.1
  yfslam run DIR --dense --save-map lab.map
  yfslam map lab.map --cloud --out clouds --up 0,-1,0

In the output folder:
  cloud.ply, cloud.pcd      with --cloud, coloured points, one a voxel
  above.png, corner.png     with --cloud, pictures of it
  octomap.bt, octomap.ot    with --octomap, for OctoMap: free or occupied; log-odds
  grid.pgm, grid.yaml       with --grid, for ROS's navigation
  mesh.ply                  with --mesh, coloured triangles
  background/               with --background, the keyframes with most people, as seen and without them, with depth (1/5000 m) and
                            a mask of what is known

If the run's detector knew more than what can move (`--detector` with the 80 classes of COCO, for example), the map knows what it shows:
  cloud.ply, cloud.pcd      have the class of each point, 0 where it is unknown
  classes.png               with --cloud, the picture from a corner, coloured by class
  semantic.ot               with --octomap, the octree coloured by class
  classes.json              the classes' numbers, names, colours, and how many voxels are of each

The z-axis points up, x to the front of the first picture, y to its left (ROS, REP 103).";

/// Views that are painted without people.
const BACKGROUNDS: usize = 6;
/// Units of their depth, as in TUM recordings, 1/m.
const BACKGROUND_UNITS_PER_M: f32 = 5000.0;
/// Width and height of pictures, px.
const PICTURE_PX: [usize; 2] = [900, 600];

/// Make clouds, octrees, grids and meshes of what a run with --dense has seen, without people.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct DenseMapArgs {
    /// The output folder of a run with --dense, its `dense.map`, or the map that it saved (--save-map).
    #[arg(value_name = "RUN|MAP")]
    run: PathBuf,
    /// Coloured point cloud.
    #[arg(long, help_heading = "Products")]
    cloud: bool,
    /// Occupancy octree for OctoMap.
    #[arg(long, help_heading = "Products")]
    octomap: bool,
    /// Grid to drive in, for ROS's navigation.
    #[arg(long, help_heading = "Products")]
    grid: bool,
    /// Mesh of the surfaces.
    #[arg(long, help_heading = "Products")]
    mesh: bool,
    /// What some keyframes saw, with the people painted over by what is behind them.
    #[arg(long, help_heading = "Products")]
    background: bool,
    /// Side of a voxel, m, from 0.01 to 0.2 [default: 0.05].
    #[arg(long, value_name = "M", help_heading = "Map")]
    resolution: Option<f32>,
    /// Depth beyond which readings make no surface, m [default: 4].
    #[arg(long, value_name = "M", help_heading = "Map")]
    max_range: Option<f32>,
    /// Settings that differ from the defaults, in the section `dense`; `yfslam config` prints them all.
    #[arg(long, value_name = "FILE.toml", help_heading = "Map")]
    config: Option<PathBuf>,
    /// Which way is up: `level` (as floors, tables and ceilings say), `camera` (upright in the first picture), or a direction X,Y,Z of
    /// the run's world.
    #[arg(long, value_name = "UP", default_value = "level", allow_hyphen_values = true, help_heading = "Map")]
    up: Up,
    /// Heights above the floor between which the grid has obstacles, m.
    #[arg(long, value_name = "LOW,HIGH", default_value = "0.1,1.8", help_heading = "Map")]
    band: Band,
    /// Height of the floor along the up direction, m, the first camera's being 0 [default: as the map shows it].
    #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Map")]
    floor: Option<f32>,
    /// Where the files go [default: `map` in the output folder, or beside the map].
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    out: Option<PathBuf>,
}

/// Two heights.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Band([f32; 2]);

impl std::str::FromStr for Band {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f32> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
        match numbers[..] {
            [low, high] if low < high && low.is_finite() && high.is_finite() => Ok(Self([low, high])),
            _ => Err(format!("'{text}' is no band of heights; write LOW,HIGH such as 0.1,1.8")),
        }
    }
}

/// How up is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Up {
    Level,
    Camera,
    Direction([f64; 3]),
}

impl std::str::FromStr for Up {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "level" => return Ok(Self::Level),
            "camera" => return Ok(Self::Camera),
            _ => {}
        }
        let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
        match <[f64; 3]>::try_from(numbers) {
            Ok(up) if Vector3::from(up).norm() > 1e-6 && up.iter().all(|v| v.is_finite()) => Ok(Self::Direction(up)),
            _ => Err(format!("'{text}' is no direction; write level, camera, or X,Y,Z such as 0,-1,0")),
        }
    }
}

/// A volume in the making of products.
struct Maker<'a> {
    survey: &'a Survey,
    volume: Volume,
    /// What voxels show; `None` where no detector told.
    classes: Option<Classes>,
    /// Height of the floor.
    floor_m: f32,
    folder: PathBuf,
    terminal: Terminal,
}

pub fn run(args: &DenseMapArgs, terminal: Terminal) -> Result<()> {
    let config = args.config()?;
    let (survey, folder) = args.open()?;
    let (pieces, mb) = (survey.pieces.len(), survey.bytes() as f64 / 1e6);
    terminal.note(&format!("{pieces} pieces of {mb:.0} MB; {}", memory_bound(&config, &survey)));
    let turn = args.turn(&survey);
    let started = Instant::now();
    let (volume, cpu) =
        cpu::timed(|| with_progress(terminal, "occupancy", &survey, |told| survey.volume_within(&config, &turn, told)));
    let volume = volume?;
    let took = cpu.unwrap_or_else(|| started.elapsed());
    let mut text = describe(&volume, took.as_secs_f64() * 1e3 / survey.pieces.len() as f64);
    let floor_m = args.floor.or(up::floor_m(&survey, &turn).map(|floor| floor as f32)).unwrap_or_default();
    let find = |told: &mut dyn FnMut(usize)| classes(&survey, &volume, told);
    let classes = (!survey.class_names.is_empty()).then(|| with_progress(terminal, "classes", &survey, find));
    let maker = Maker { survey: &survey, volume, classes, floor_m, folder, terminal };
    text += &format!("floor: {:.2} m below the first camera\n", first_height_m(&survey, &turn) - floor_m);
    let all = !(args.cloud || args.octomap || args.grid || args.mesh || args.background);
    // Nothing is written if something cannot be.
    for (wanted, what, bytes) in
        [(args.cloud, "the cloud", cloud::bytes as fn(&Volume) -> usize), (args.mesh, "the mesh", mesh::bytes)]
    {
        if wanted || all {
            check_memory(&config, what, bytes(&maker.volume))?;
        }
    }
    text += &maker.legend()?;
    if args.cloud || all {
        text += &maker.cloud()?;
    }
    if args.octomap || all {
        text += &maker.octomap()?;
    }
    if args.grid || all {
        text += &maker.grid(args.band)?;
    }
    if args.mesh || all {
        text += &maker.mesh()?;
    }
    if args.background || all {
        text += &maker.background()?;
    }
    terminal.result(&format!("{text}\nwritten to {}\n", maker.folder.display()))
}

impl DenseMapArgs {
    /// The constants: flags win over the file, the file over the defaults.
    fn config(&self) -> Result<DenseConfig> {
        let file = SettingsArgs { config: self.config.clone(), ..SettingsArgs::default() };
        let mut config = file.resolve()?.dense;
        config.resolution_m = self.resolution.unwrap_or(config.resolution_m);
        config.max_range_m = self.max_range.unwrap_or(config.max_range_m);
        config.validate()?;
        Ok(config)
    }

    /// The survey, and the folder for its products.
    fn open(&self) -> Result<(Survey, PathBuf)> {
        let file = if self.run.is_dir() { self.run.join(DENSE_FILE) } else { self.run.clone() };
        let bytes = std::fs::read(&file).with_context(|| {
            format!("cannot read {}; make it with `yfslam run SEQUENCE --dense`, or check the path", file.display())
        })?;
        let survey = decode(&bytes).with_context(|| format!("{} cannot be used", file.display()))?;
        ensure!(!survey.pieces.is_empty(), "{} holds no keyframe: the run tracked nothing", file.display());
        let beside = || file.parent().unwrap_or(Path::new(".")).join("map");
        Ok((survey, self.out.clone().unwrap_or_else(beside)))
    }

    fn turn(&self, survey: &Survey) -> UnitQuaternion<f64> {
        match self.up {
            Up::Level => up::of_survey(survey),
            Up::Camera => up::of_camera(),
            Up::Direction(up) => up::from_up(&Vector3::from(up)),
        }
    }
}

impl Maker<'_> {
    fn cloud(&self) -> Result<String> {
        let told = |told: &mut dyn FnMut(usize)| cloud(self.survey, &self.volume, told);
        let points = with_progress(self.terminal, "cloud", self.survey, told);
        let ply = |p: &CloudPoint| PlyPoint { position_m: p.position_m, color: p.color };
        let found: Option<Vec<u8>> =
            self.classes.as_ref().map(|classes| points.iter().map(|p| classes.get(p.voxel)).collect());
        let labels = found.as_ref().map(|classes| Labels { classes, names: &self.survey.class_names });
        write_ply(&self.folder.join("cloud.ply"), points.iter().map(ply), labels)?;
        write_pcd(&self.folder.join("cloud.pcd"), points.iter().map(ply), labels)?;
        let resolution_m = self.volume.config().resolution_m;
        let cut_m = self.floor_m + SHOWN_M;
        let above = from_above(&points, resolution_m, cut_m, PICTURE_PX);
        write_color_png(&self.folder.join("above.png"), &above)?;
        let corner = from_corner(&points, resolution_m, cut_m, PICTURE_PX);
        write_color_png(&self.folder.join("corner.png"), &corner)?;
        if let Some(found) = found {
            let by_class = |(point, class): (&CloudPoint, u8)| CloudPoint { color: class_color(class), ..*point };
            let points: Vec<CloudPoint> = points.iter().zip(found).map(by_class).collect();
            let corner = from_corner(&points, resolution_m, cut_m, PICTURE_PX);
            write_color_png(&self.folder.join("classes.png"), &corner)?;
        }
        Ok(format!("cloud: {} points\n", points.len()))
    }

    /// What there is of each class, for whoever opens the other files.
    fn legend(&self) -> Result<String> {
        let Some(classes) = &self.classes else { return Ok(String::new()) };
        let legend = ClassLegend::of(&self.survey.class_names, &self.volume, classes);
        let json = serde_json::to_vec_pretty(&legend)?;
        write_atomically(&self.folder.join("classes.json"), |file| file.write_all(&json))?;
        Ok(legend.to_string())
    }

    fn octomap(&self) -> Result<String> {
        let resolution = f64::from(self.volume.config().resolution_m);
        // As the user wrote it, not as a float of 32 bits has it.
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

    fn grid(&self, Band(band): Band) -> Result<String> {
        let grid = ground_grid(&self.volume, band.map(|height| self.floor_m + height));
        write_nav2(&self.folder.join("grid.pgm"), &grid)?;
        let count = |what| grid.cells.iter().filter(|cell| **cell == what).count();
        let (occupied, free) = (count(GridCell::Occupied), count(GridCell::Free));
        Ok(format!("grid: {} × {} cells, {occupied} occupied, {free} free\n", grid.width, grid.height))
    }

    fn mesh(&self) -> Result<String> {
        let mut progress: Option<Progress> = None;
        let mesh = mesh(self.survey, &self.volume, |done, blocks| {
            let progress = progress.get_or_insert_with(|| Progress::new(self.terminal, "mesh", blocks));
            progress.at(done, "blocks", String::new);
        });
        progress.into_iter().for_each(Progress::finish);
        let vertices = mesh.vertices_m.iter().zip(&mesh.colors);
        let vertices = vertices.map(|(&position_m, &color)| PlyPoint { position_m, color });
        write_ply_mesh(&self.folder.join("mesh.ply"), vertices, &mesh.triangles)?;
        Ok(format!("mesh: {} vertices, {} triangles\n", mesh.vertices_m.len(), mesh.triangles.len()))
    }

    /// Views of some keyframes without people, those in which most moves.
    fn background(&self) -> Result<String> {
        let Survey { grid, pieces, .. } = self.survey;
        let cells = grid.rays().len();
        let moving = |number: usize| (0..cells).filter(|cell| pieces[number].piece.moves(*cell)).count();
        let mut fullest: Vec<(usize, usize)> = (0..pieces.len()).map(|number| (moving(number), number)).collect();
        fullest.sort_by_key(|(moving, number)| (std::cmp::Reverse(*moving), *number));
        fullest.truncate(BACKGROUNDS);
        let views = with_progress(self.terminal, "looking beside people", self.survey, |told| {
            Backgrounds::new(self.survey, &self.volume, told)
        });
        let (mut filled, mut hidden) = (0, 0);
        for &(moving, number) in &fullest {
            let one = &pieces[number];
            let Some(view) = views.of_piece(number) else { continue };
            let colors = (0..cells).map(|cell| one.piece.color(cell)).collect();
            let seen = RgbImage::from_vec(grid.columns(), grid.rows(), colors).unwrap_or_default();
            write_view(&self.folder.join("background"), &format!("{number:06}"), &seen, &view)?;
            hidden += moving;
            filled += view.valid.data().iter().filter(|valid| **valid).count() + moving - cells;
        }
        let share = 100.0 * filled as f64 / hidden.max(1) as f64;
        Ok(format!("background: {} views, {share:.1} % of what people hide is known\n", fullest.len()))
    }
}

/// Colour and depth, and which pixels are known, as pictures.
fn write_view(folder: &Path, name: &str, seen: &RgbImage, view: &Background) -> Result<()> {
    write_color_png(&folder.join(format!("{name}-seen.png")), seen)?;
    write_color_png(&folder.join(format!("{name}.png")), &view.color)?;
    let units = |z: &f32| (z * BACKGROUND_UNITS_PER_M).min(f32::from(u16::MAX)) as u16;
    let (width, height) = (view.color.width(), view.color.height());
    let picture = Image::from_vec(width, height, view.depth_m.data().iter().map(units).collect()).unwrap_or_default();
    write_depth_png(&folder.join(format!("{name}-depth.png")), &picture)?;
    let mask = view.valid.data().iter().map(|valid| if *valid { 255 } else { 0 }).collect();
    let mask = Image::from_vec(width, height, mask).unwrap_or_default();
    Ok(write_mask_png(&folder.join(format!("{name}-valid.png")), &mask)?)
}

/// Height of the first camera, m.
fn first_height_m(survey: &Survey, turn: &UnitQuaternion<f64>) -> f32 {
    survey.pieces.first().map_or(0.0, |one| (turn * one.t_world_cam).translation.z) as f32
}

/// Shows how far `work` is, which says how many pieces are done.
fn with_progress<T>(
    terminal: Terminal,
    label: &str,
    survey: &Survey,
    work: impl FnOnce(&mut dyn FnMut(usize)) -> T,
) -> T {
    let mut progress = Progress::new(terminal, label, survey.pieces.len());
    let result = work(&mut |done| progress.at(done, "pieces", String::new));
    progress.finish();
    result
}

fn describe(volume: &Volume, each_ms: f64) -> String {
    let occupied = volume.voxels().filter(|v| v.occupied).count();
    let free = volume.voxels().count() - occupied;
    format!(
        "occupancy: {occupied} voxels of {} m occupied, {free} free; {each_ms:.1} ms a keyframe, {:.0} MB\n",
        volume.config().resolution_m,
        volume.bytes() as f64 / 1e6
    )
}

/// How much memory the map can take at most: by extent, resolution and number of pieces.
fn memory_bound(config: &DenseConfig, survey: &Survey) -> String {
    let bound_mb = Volume::bytes_at_most(config, survey).div_ceil(1_000_000);
    let allowed_mb = config.max_memory_mb;
    let map_mb = bound_mb.min(allowed_mb);
    format!(
        "at {} m the map takes {map_mb} MB at most (dense.max_memory_mb allows {allowed_mb}, and as much for a product beside it)",
        config.resolution_m
    )
}
