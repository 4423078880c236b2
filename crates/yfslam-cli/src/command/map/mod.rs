//! `yfslam map`: products of the dense map of a run.

mod exporter;
mod options;
mod printer;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use nalgebra::Vector3;
use yfslam::MapFrame;
use yfslam::dense::classes;
use yfslam::dense::{DenseConfig, DenseMap, check_products};
use yfslam_io::{prepare_folder, read_file};

use self::exporter::{Exporter, with_progress};
use self::options::{HeightBand, Up};
use crate::input::settings::SettingsArgs;
use crate::output::dense::DENSE_FILE;
use crate::output::folder::PRODUCTS_FOLDER;
use crate::stats::cpu;
use crate::ui::failures::Failures;
use crate::ui::interrupt::Interrupt;
use crate::ui::terminal::Terminal;

const HELP: &str = "\
Examples:
  yfslam run rgbd_bonn_crowd --camera bonn --dense
  yfslam map yfslam-out/rgbd_bonn_crowd                              all products
  yfslam map yfslam-out/rgbd_bonn_crowd --octomap --grid --resolution 0.1
  yfslam run DIR --dense --save-map lab.map
  yfslam map lab.map --cloud -o clouds --up 0,-1,0

Files in the output folder:
  cloud.ply, cloud.pcd      with --cloud, coloured points, one for each occupied voxel
  above.png, corner.png     with --cloud, images of the cloud
  octomap.bt, octomap.ot    with --octomap, for OctoMap: free or occupied, and log-odds
  grid.pgm, grid.yaml       with --grid, for the ROS navigation stack
  grid.png                  with --grid, an image of it with the path, axes in metres, a scale bar and a legend
  mesh.ply                  with --mesh, coloured triangles
  path.txt                  poses of the keyframes in the frame of the products, as lines of TUM
  T_map_world.txt           transformation from the world of the run to this frame
  background/               with --background, the keyframes with most people: original image, image without people, depth image
                            (1/5000 m) and mask of the known pixels

  Each file is written whole or not at all. After SIGINT (Ctrl-C) or SIGTERM, the command ends with the product at work, with exit
  code 130 or 143; a second signal ends it at once.

Classes:
  If the detector of the run knows classes beside movable objects, such as the 80 classes of COCO, the map has classes:
  cloud.ply, cloud.pcd      also hold the class of each point, 0 where it is unknown
  classes.png               with --cloud, an image coloured by class
  semantic.ot               with --octomap, the octree coloured by class
  classes.json              numbers, names, colours and voxel counts of the classes

Up direction (--up), if it is not to be that of the map frame:
  level     from horizontal surfaces in the map, such as floor, tables and ceiling
  camera    from the first image, which is assumed to be upright
  X,Y,Z     a direction in the world of the run

Coordinates:
  All products are in the frame `map`: z points up, x to the front of the first image, y to its left (ROS, REP 103), the origin is the
  first camera. It is fixed when a map is saved for the first time, and later sessions keep it. The trajectory of a run is in the
  world of its keyframes, the first camera; T_map_world.txt has the transformation.";

/// Make point clouds, octrees, grids and meshes without people from the dense map of a run.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct DenseMapArgs {
    /// Output folder of a run with --dense, its `dense.map`, or its saved map (--save-map).
    #[arg(value_name = "RUN|MAP")]
    run: PathBuf,
    /// Write a coloured point cloud.
    #[arg(long, help_heading = "Products")]
    cloud: bool,
    /// Write an occupancy octree for OctoMap.
    #[arg(long, help_heading = "Products")]
    octomap: bool,
    /// Write an occupancy grid for the ROS navigation stack.
    #[arg(long, help_heading = "Products")]
    grid: bool,
    /// Write a mesh of the surfaces.
    #[arg(long, help_heading = "Products")]
    mesh: bool,
    /// Write images of some keyframes in which people are replaced by the background.
    #[arg(long, help_heading = "Products")]
    background: bool,
    /// Side of a voxel, m, from 0.01 to 0.2 [default: 0.05].
    #[arg(long, value_name = "M", help_heading = "Map")]
    resolution: Option<f32>,
    /// Largest depth of measurements that make surfaces, m [default: 4].
    #[arg(long, value_name = "M", help_heading = "Map")]
    max_range: Option<f32>,
    /// Configuration file; its section `dense` is used.
    #[arg(short, long, value_name = "FILE.toml", help_heading = "Map")]
    config: Option<PathBuf>,
    /// Another up direction than that of the map frame: `level`, `camera`, or X,Y,Z. The products then do not fit T_map_world.txt of the run.
    #[arg(long, value_name = "UP", allow_hyphen_values = true, help_heading = "Map")]
    up: Option<Up>,
    /// Heights above the floor between which the grid has obstacles, m.
    #[arg(long, value_name = "LOW,HIGH", default_value = "0.1,1.8", help_heading = "Map")]
    band: HeightBand,
    /// Height of the floor along the up direction relative to the first camera, m [default: from the map].
    #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Map")]
    floor: Option<f32>,
    /// Output folder [default: `map` in the output folder of the run, or beside the map].
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    out: Option<PathBuf>,
}

pub fn run(args: &DenseMapArgs, terminal: Terminal) -> Result<()> {
    let interrupt = Interrupt::watch()?;
    let config = args.config()?;
    let (map, folder) = args.open()?;
    prepare_folder(&folder).with_context(|| format!("the output folder {} cannot be used", folder.display()))?;
    terminal.note(&printer::memory_bound(&config, &map));
    let frame = args.frame(&map);
    let turn = frame.r_map_world;
    let started = Instant::now();
    let work = |report: &mut dyn FnMut(usize)| map.volume(&config, &turn, report);
    let (volume, cpu) = cpu::timed(|| with_progress(terminal, "occupancy", &map, work));
    let volume = volume?;
    let took = cpu.unwrap_or_else(|| started.elapsed());
    let mut text = printer::occupancy(&volume, took.as_secs_f64() * 1e3 / map.patches.len() as f64);
    let floor_m = args.floor.or(map.floor_m(&turn).map(|floor| floor as f32)).unwrap_or_default();
    let work = |report: &mut dyn FnMut(usize)| classes(&map, &volume, report);
    let classes = (!map.class_names.is_empty()).then(|| with_progress(terminal, "classes", &map, work));
    text += &printer::floor(&map, &turn, floor_m);
    let exporter = Exporter { map: &map, frame, volume, classes, floor_m, folder, terminal };
    let all = !(args.cloud || args.octomap || args.grid || args.mesh || args.background);
    // Nothing is written if a product would take too much memory.
    check_products(&exporter.volume, args.cloud || all, args.mesh || all)?;
    let products: [(bool, &dyn Fn() -> Result<String>); 7] = [
        (true, &|| exporter.frame()),
        (true, &|| exporter.legend()),
        (args.cloud || all, &|| exporter.cloud()),
        (args.octomap || all, &|| exporter.octomap()),
        (args.grid || all, &|| exporter.grid(args.band)),
        (args.mesh || all, &|| exporter.mesh()),
        (args.background || all, &|| exporter.background()),
    ];
    let mut failures = Failures::new(terminal);
    for (_, make) in products.iter().filter(|(is_wanted, _)| *is_wanted) {
        // Products that are complete stay.
        interrupt.check()?;
        text += &failures.keep(make()).unwrap_or_default();
    }
    let printed = terminal.result(&format!("{text}\nwritten to {}\n", exporter.folder.display()));
    failures.check()?;
    printed
}

impl DenseMapArgs {
    /// Returns the configuration: flags override the file, the file overrides the defaults.
    fn config(&self) -> Result<DenseConfig> {
        let file = SettingsArgs { config: self.config.clone(), ..SettingsArgs::default() };
        let mut config = file.resolve()?.dense;
        config.resolution_m = self.resolution.unwrap_or(config.resolution_m);
        config.max_range_m = self.max_range.unwrap_or(config.max_range_m);
        config.validate()?;
        Ok(config)
    }

    /// Returns the dense map, and the folder for its products.
    fn open(&self) -> Result<(DenseMap, PathBuf)> {
        let file = if self.run.is_dir() { self.run.join(DENSE_FILE) } else { self.run.clone() };
        let bytes = read_file(&file).with_context(|| {
            format!("cannot read {}; make it with `yfslam run SEQUENCE --dense`, or check the path", file.display())
        })?;
        let map = DenseMap::from_bytes(&bytes).with_context(|| format!("{} cannot be used", file.display()))?;
        ensure!(!map.patches.is_empty(), "{} holds no keyframe: the run tracked nothing", file.display());
        let beside = || file.parent().unwrap_or(Path::new(".")).join(PRODUCTS_FOLDER);
        Ok((map, self.out.clone().unwrap_or_else(beside)))
    }

    /// Returns the frame of the products: that of the map, unless --up gives another.
    fn frame(&self, map: &DenseMap) -> MapFrame {
        let up = match (self.up, map.frame) {
            (None, Some(frame)) => return frame,
            (up, _) => up.unwrap_or(Up::Level),
        };
        let up = match up {
            Up::Level => yfslam::dense::Up::Level,
            Up::Camera => yfslam::dense::Up::Camera,
            Up::Direction(up) => yfslam::dense::Up::Direction(Vector3::from(up)),
        };
        MapFrame { r_map_world: map.turn(up), up }
    }
}
