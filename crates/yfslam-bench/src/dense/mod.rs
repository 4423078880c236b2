//! What dense maps are worth, by the exact world, for each method side by side.
//!
//! ```text
//! cargo run --release -p yfslam-cli --example dense -- 'walking_xyz?frames=300' --methods none,yf,full
//! ```

mod background_metrics;
mod dense_run;
mod ghost_metrics;
mod wall_thickness;

use anyhow::Result;
use clap::Args;
use dense_run::{Taken, Way, take};
use ghost_metrics::{Truth, survey_of_exact_poses};
use wall_thickness::thickness;
use yfslam::dense::{DenseConfig, up};
use yfslam::dynamic::Method;
use yfslam_eval::{Table, TableStyle};
use yfslam_synth::{World, parse};

#[derive(Args)]
pub struct Arguments {
    /// Worlds, such as `walking_xyz?seed=2&frames=300`.
    worlds: Vec<String>,
    /// Methods that keep moving things out.
    #[arg(long, value_delimiter = ',', default_value = "none,boxes,yf,full")]
    methods: Vec<String>,
    /// Close no loops.
    #[arg(long)]
    no_loops: bool,
    /// Depth beyond which readings make no surface, m.
    #[arg(long, default_value_t = DenseConfig::default().max_range_m)]
    max_range: f32,
    /// Side of a voxel, m.
    #[arg(long, default_value_t = 0.05)]
    resolution: f32,
}

pub fn run(arguments: Arguments) -> Result<()> {
    let config =
        DenseConfig { resolution_m: arguments.resolution, max_range_m: arguments.max_range, ..Default::default() };
    let mut table = Table::new([
        "world",
        "method",
        "pieces",
        "occupied",
        "of exact poses",
        "patches",
        "thick (cm)",
        "of exact (cm)",
        "precision",
        "recall",
        "ghosts",
        "filled",
        "shown",
        "valid",
        "PSNR (dB)",
        "of filled",
        "ms a keyframe",
        "MB",
    ]);
    for spec in &arguments.worlds {
        let mut world = parse(spec)?;
        world.detections = true;
        let world = World::new(&world)?;
        let way = |name: &String| -> Result<Way> {
            let method: Method = serde_json::from_value(serde_json::Value::String(name.clone()))?;
            Ok(Way { method, loops: !arguments.no_loops })
        };
        let ways = arguments.methods.iter().map(way).collect::<Result<Vec<_>>>()?;
        for (name, taken) in arguments.methods.iter().zip(take(&world, &ways, &config)?) {
            let Taken { survey, each_ms, bytes } = taken;
            let volume = survey.volume(&config, &up::of_survey(&survey), |_| {});
            let found = Truth::of(&survey, &volume, &world).judge(&volume);
            let exact = survey_of_exact_poses(&survey, &world);
            let thick = [&survey, &exact].map(|survey| thickness(survey, &world, &config));
            let exact = exact.volume(&config, &up::of_survey(&survey), |_| {});
            let exact = exact.voxels().filter(|known| known.occupied).count();
            let views = background_metrics::judge(&survey, &volume, &world)?;
            table.push([
                spec.clone(),
                name.clone(),
                survey.pieces.len().to_string(),
                found.occupied.to_string(),
                format!("{:.3}", found.occupied as f64 / exact.max(1) as f64),
                thick[0].patches.to_string(),
                format!("{:.2}", 100.0 * thick[0].mean_m),
                format!("{:.2}", 100.0 * thick[1].mean_m),
                format!("{:.4}", found.precision),
                format!("{:.4}", found.recall),
                format!("{:.5}", found.ghosts),
                format!("{:.3}", views.filled),
                format!("{:.3}", views.shown),
                format!("{:.3}", views.valid),
                format!("{:.1}", views.psnr_db),
                format!("{:.1}", views.filled_psnr_db),
                format!("{each_ms:.1}"),
                format!("{:.0}", bytes as f64 / 1e6),
            ]);
        }
    }
    print!("{}", table.render(TableStyle::Plain));
    Ok(())
}
