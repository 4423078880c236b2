//! A synthetic dynamic world: RGB-D and stereo sequences with people in motion, and exact ground truth.
//!
//! ```text
//! WorldConfig ─► scene ─► textures, light maps ─┐
//!                actors (people, robots, objects) ┼─► render ─► sensor ─► SynthFrame
//!                camera path ───────────────────┘
//! ```
//!
//! # Scenes
//!
//! | `scene=` | size | content |
//! |---|---|---|
//! | `office` | 6.4 m × 6 m × 2.7 m | the desk of the TUM freiburg3 sequences: monitors, books, posters, chairs |
//! | `rescue` | 14 m × 12 m × 4.4 m | a damaged hall: rubble, pillars, crates, barrels, bare concrete, few lamps |
//! | `corridor` | 45.6 m around a block, 2.4 m wide | doors, notice boards, signs, radiators, plants; similar everywhere, but no two places are equal |
//! | `lab` | 6 m × 5.4 m × 2.8 m | white walls with hardly any texture: sockets, cable duct, bench, floor seams |
//!
//! # Motions of the camera
//!
//! The first four have the lengths and durations of the sequences of the TUM RGB-D benchmark (Sturm et al., "A benchmark for the
//! evaluation of RGB-D SLAM systems", IROS 2012, and its web page).
//!
//! | `motion=` | path | pace |
//! |---|---|---|
//! | `static` | hand shake only | 0.28 m in 24.8 s (`walking_static`) |
//! | `xyz` | ±0.38 m sideways, ±0.24 m up and down, ±0.30 m forward | 5.79 m in 28.8 s (`walking_xyz`) |
//! | `rpy` | ±24° roll, ±17° pitch, ±23° yaw | 2.70 m in 30.6 s, 21°/s (`walking_rpy`) |
//! | `halfsphere` | on a sphere of 0.55 m radius, directed at its centre | 7.69 m in 35.8 s (`walking_halfsphere`) |
//! | `drive` | along the circuit of the scene, 0.85 m above the floor, as on a wheeled robot | 0.7 m/s, at most 34°/s |
//! | `loop` | once along the circuit and 6 % past its start, carried at 1.35 m | 0.4 to 1.2 m/s, at most 40°/s |
//!
//! `stereo=0.11` adds a right camera 0.11 m beside the camera, instead of depth; [`World::second_view`] renders the image of any
//! other camera that is fixed to it.
//!
//! # Shutter
//!
//! The shutter is global unless `readout=` gives the time from the first to the last row of an image in ms: 30 reads the top row
//! first, -30 the bottom row. Each row then shows the camera, the people and the light at its own time, to the bit as the same row
//! of a global image would at that time, in colour and depth, in the right image and in a second view; so do the exact depth, the
//! masks and the boxes of a frame. The stamp and the pose of a frame are those of the middle row; [`World::row_pose`] has those of
//! the others. `depth_readout=` is that of the depth image, about its own middle row, which `offset_ms=` puts at another time. The
//! [`Camera`](yfslam::Camera) of a described world has the readout, unless none is mentioned or `unknown_readout=on` withholds it.
//!
//! # Light
//!
//! Light can change: with `flicker=` the brightness of about half of the lamps varies and drops out, `exposure=` darkens the whole
//! image.
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
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod actors;
mod bake;
mod bvh;
mod camera_path;
mod config;
mod flicker;
mod light;
mod look_at;
mod mesh;
mod render;
mod rig;
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
    Activity, ActorsConfig, CameraMotion, CarriedObject, LightConfig, MAX_PEOPLE, SceneKind, SensorConfig,
    UnknownObject, WorldConfig, WorldError, default_camera,
};
pub use spec::{is_spec, parse, parse_with_camera, split};
pub use suite::{NamedWorld, SUITE, names};
pub use world::{SynthFrame, World};

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
