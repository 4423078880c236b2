//! A synthetic dynamic world: RGB-D and stereo sequences with people that move, and exact ground truth.
//!
//! ```text
//! WorldConfig ─► scene ─► textures, light maps ─┐
//!                actors (people, robots, things) ┼─► render ─► sensor ─► SynthFrame
//!                camera path ───────────────────┘
//! ```
//!
//! # Scenes
//!
//! | `scene=` | size | what is in it |
//! |---|---|---|
//! | `office` | 6.4 m × 6 m × 2.7 m | the desk of the TUM freiburg3 sequences: monitors, books, posters, chairs |
//! | `rescue` | 14 m × 12 m × 4.4 m | a damaged hall: rubble, pillars, crates, barrels, bare concrete, few lamps |
//! | `corridor` | 45.6 m around a block, 2.4 m wide | doors, notice boards, signs, radiators, plants; alike, but no two places the same |
//! | `lab` | 6 m × 5.4 m × 2.8 m | white walls with hardly any texture: sockets, cable duct, bench, floor seams |
//!
//! # Motions of the camera
//!
//! The first four have the lengths and times of the TUM RGB-D benchmark's sequences (Sturm et al., "A benchmark for the
//! evaluation of RGB-D SLAM systems", IROS 2012, and its web page).
//!
//! | `motion=` | way | pace |
//! |---|---|---|
//! | `static` | hand shake only | 0.28 m in 24.8 s (`walking_static`) |
//! | `xyz` | ±0.38 m sideways, ±0.24 m up and down, ±0.30 m forwards | 5.79 m in 28.8 s (`walking_xyz`) |
//! | `rpy` | ±24° roll, ±17° pitch, ±23° yaw | 2.70 m in 30.6 s, 21°/s (`walking_rpy`) |
//! | `halfsphere` | on a sphere of 0.55 m radius, looking at its centre | 7.69 m in 35.8 s (`walking_halfsphere`) |
//! | `drive` | along the scene's round, 0.85 m above the floor, as on a wheeled robot | 0.7 m/s, at most 34°/s |
//! | `loop` | once around the round and 6 % past its start, carried at 1.35 m | 0.4 to 1.2 m/s, at most 40°/s |
//!
//! `stereo=0.11` puts a right camera 0.11 m beside the camera, in place of depth; [`World::second_view`] shows what any other camera
//! fixed to it sees.
//!
//! Light can change: `flicker=` makes about half of the lamps wander in brightness and drop out, `exposure=` darkens the
//! whole picture.
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
    Activity, ActorsConfig, CameraMotion, CarriedObject, LightConfig, MAX_PEOPLE, SceneKind, SensorConfig, WorldConfig,
    WorldError, default_camera,
};
pub use spec::{is_spec, parse, parse_with_camera, split};
pub use suite::{NamedWorld, SUITE, names};
pub use world::{SynthFrame, World};
