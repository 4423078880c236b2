//! A synthetic dynamic world: RGB-D sequences with people that move, and exact ground truth.
//!
//! ```text
//! WorldConfig ─► scene ─► textures, light maps ─┐
//!                actors (people, robots, things) ┼─► render ─► sensor ─► SynthFrame
//!                camera path ───────────────────┘
//! ```
//!
//! ```
//! # fn main() -> Result<(), yfslam_synth::WorldError> {
//! let mut config = yfslam_synth::parse("synth:walking_xyz?seed=7&people=1&width=64&height=48&frames=10")?;
//! config.light.shadow_rays = 0;
//! let world = yfslam_synth::World::new(&config)?;
//! let first = world.frame(0);
//! assert_eq!(first.frame.color.width(), 64);
//! assert_eq!(first.t_world_cam, world.pose(0));
//! # Ok(())
//! # }
//! ```

mod actors;
mod bake;
mod bvh;
mod camera_path;
mod config;
mod flicker;
mod light;
mod mesh;
mod render;
mod rng;
mod scene;
mod sensor;
mod spec;
mod suite;
mod surfaces;
mod texture;
mod tour;
mod world;

pub use actors::CLASS_NAMES;
pub use config::{
    Activity, ActorsConfig, CameraMotion, LightConfig, MAX_PEOPLE, SceneKind, SensorConfig, WorldConfig, WorldError,
    default_camera,
};
pub use spec::{is_spec, parse, parse_with_camera, split};
pub use suite::{NamedWorld, SUITE, names};
pub use world::{SynthFrame, World};
