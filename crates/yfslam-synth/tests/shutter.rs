//! Checks that each row of a rolling image shows the world as it is at the time of that row.
#![allow(clippy::unwrap_used, reason = "a test may")]

use yfslam_synth::{SensorConfig, SynthFrame, World, WorldConfig, parse};

/// Returns a small world with a perfect sensor, except for its shutter.
fn config(spec: &str, readout_ms: f64) -> WorldConfig {
    let mut config = parse(&format!("{spec}&width=160&height=120")).unwrap();
    config.light.shadow_rays = 0;
    config.sensor = SensorConfig { readout_ms, ..SensorConfig::perfect() };
    config
}

fn world(spec: &str, readout_ms: f64) -> World {
    World::new(&config(spec, readout_ms)).unwrap()
}

fn same(a: &SynthFrame, b: &SynthFrame) -> bool {
    a.frame.color == b.frame.color
        && a.frame.depth == b.frame.depth
        && a.frame.right == b.frame.right
        && a.instances == b.instances
        && a.exact_depth == b.exact_depth
        && a.boxes == b.boxes
        && a.t_world_cam == b.t_world_cam
}

#[test]
fn a_readout_of_zero_is_the_global_shutter() {
    let (plain, zero) = (world("walking_xyz?seed=2", 0.0), world("walking_xyz?seed=2&readout=0", 0.0));
    assert!(same(&plain.frame(20), &zero.frame(20)));
    let rolling = world("walking_rpy?seed=2&people=2", 30.0);
    assert!(same(&rolling.frame(40), &rolling.frame(40)), "the same frame has the same bits");
    assert!(rolling.frame(40).frame.color != world("walking_rpy?seed=2&people=2", 0.0).frame(40).frame.color);
    assert_eq!(rolling.frame(40).frame.depth_timestamp_ns, Some(rolling.timestamp_ns(40)));
}
