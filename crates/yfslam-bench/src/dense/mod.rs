//! Dense maps of rendered worlds against the exact world, for several methods.

pub mod background_metrics;
pub mod dense_run;
pub mod ghost_metrics;
pub mod wall_thickness;

use anyhow::Result;
use clap::Args;
use dense_run::{DenseRun, RunOptions, run_all};
use ghost_metrics::{ExactSurfaces, with_exact_poses};
use wall_thickness::wall_thickness;
use yfslam::Method;
use yfslam::dense::{DenseConfig, Up};
use yfslam_synth::{World, parse};

use crate::row::Row;

/// What is measured.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Worlds, such as `walking_xyz?seed=2&frames=300`.
    pub worlds: Vec<String>,
    /// Methods, each of which maps every world.
    #[arg(long, value_delimiter = ',', default_value = "none,boxes,yf,full")]
    pub methods: Vec<String>,
    /// Do not close loops.
    #[arg(long)]
    pub no_loops: bool,
    /// Depth beyond which readings make no surface, m.
    #[arg(long, default_value_t = DenseConfig::default().max_range_m)]
    pub max_range: f32,
    /// Side of a voxel, m.
    #[arg(long, default_value_t = 0.05)]
    pub resolution: f32,
}

/// One row for each world and method.
///
/// # Errors
/// There is no such world or method, or SLAM refuses its input.
pub fn measure(arguments: &Arguments) -> Result<Vec<Row>> {
    let config =
        DenseConfig { resolution_m: arguments.resolution, max_range_m: arguments.max_range, ..Default::default() };
    let mut rows = Vec::new();
    for spec in &arguments.worlds {
        let mut world = parse(spec)?;
        world.detections = true;
        let world = World::new(&world)?;
        let options = |name: &String| -> Result<RunOptions> {
            let method: Method = serde_json::from_value(serde_json::Value::String(name.clone()))?;
            Ok(RunOptions { method, loops: !arguments.no_loops })
        };
        let options = arguments.methods.iter().map(options).collect::<Result<Vec<_>>>()?;
        for (method, run) in arguments.methods.iter().zip(run_all(&world, &options, &config)?) {
            rows.push(row(spec, method, &run, &world, &config)?);
        }
    }
    Ok(rows)
}

fn row(spec: &str, method: &str, run: &DenseRun, world: &World, config: &DenseConfig) -> Result<Row> {
    let DenseRun { map, ms_per_keyframe, bytes } = run;
    let volume = map.volume(config, &map.turn(Up::Level), |_| {})?;
    let occupancy = ExactSurfaces::of(map, &volume, world).compare(&volume);
    let exact = with_exact_poses(map, world);
    let (thickness, exact_thickness) = (wall_thickness(map, world, config)?, wall_thickness(&exact, world, config)?);
    let exact = exact.volume(config, &map.turn(Up::Level), |_| {})?;
    let exact_occupied = exact.voxels().filter(|voxel| voxel.occupied).count();
    let background = background_metrics::compare(map, &volume, world)?;
    Ok(Row::new()
        .case("world", spec)
        .case("method", method)
        .figure("keyframe_patches", map.patches.len())
        .figure("occupied", occupancy.occupied)
        .figure("of_exact_poses", occupancy.occupied as f64 / exact_occupied.max(1) as f64)
        .figure("wall_patches", thickness.patches)
        .figure("wall_thickness_mm", 1e3 * thickness.mean_m)
        .figure("wall_thickness_exact_mm", 1e3 * exact_thickness.mean_m)
        .figure("precision", occupancy.precision)
        .figure("recall", occupancy.recall)
        .figure("ghosts", occupancy.ghosts)
        .figure("filled", background.filled)
        .figure("fillable", background.fillable)
        .figure("valid", background.valid)
        .figure("psnr_db", background.psnr_db)
        .figure("filled_psnr_db", background.filled_psnr_db)
        .figure("ms_per_keyframe", *ms_per_keyframe)
        .figure("mb", *bytes as f64 / 1e6))
}
