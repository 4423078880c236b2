//! What the examples share: rendered frames in the place of a camera.

use yfslam::{Camera, Frame};
use yfslam_synth::{World, WorldError, parse};

/// Renders the frames of a small synthetic world, such as `walking_xyz?frames=60`, and returns their camera.
///
/// # Errors
/// If there is no such world.
pub fn rendered(world: &str) -> Result<(Camera, Vec<Frame>), WorldError> {
    let world = World::new(&parse(&format!("{world}&width=320&height=240"))?)?;
    let frames = (0..world.len()).map(|index| world.frame(index).frame).collect();
    Ok((world.config().camera.clone(), frames))
}
