//! The choices of a world: motion of the camera, activity of the people, scene, carried object.

use serde::{Deserialize, Serialize};

/// How the camera is moved, after the freiburg3 sequences of the TUM RGB-D benchmark (Sturm et al., IROS 2012).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraMotion {
    /// Held still by hand: 0.28 m in 24.8 s, all of it hand shake.
    Static,
    /// Along the three axes in turn, orientation kept: 5.79 m in 28.8 s.
    Xyz,
    /// Turned about roll, pitch and yaw: 2.70 m in 30.6 s, 21°/s.
    Rpy,
    /// On a half sphere, looking at its centre: 7.69 m in 35.8 s.
    Halfsphere,
    /// On a wheeled robot, forwards along the scene's round at up to 0.7 m/s, with a little vibration.
    Drive,
    /// Carried once around the scene's round and 6 % past its start, as fast as the number of frames asks for but between
    /// 0.4 and 1.2 m/s and at most 40°/s. At the fastest the corridor takes 1241 frames at 30 Hz, 1320 with the overlap;
    /// fewer frames show a part of it.
    Loop,
}

impl CameraMotion {
    /// All motions with their names in specs.
    pub const ALL: [(&str, Self); 6] = [
        ("static", Self::Static),
        ("xyz", Self::Xyz),
        ("rpy", Self::Rpy),
        ("halfsphere", Self::Halfsphere),
        ("drive", Self::Drive),
        ("loop", Self::Loop),
    ];
}

/// What the people do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activity {
    /// They walk around the desk, all the same way and two abreast, stop, turn and walk on. Where a camera on a tour leaves no room
    /// for that (the corridor), they walk the tour: every second one ahead of the camera, the others towards it and past it.
    Walking,
    /// They sit (or stand, once the chairs are taken) and gesture a little.
    Sitting,
    /// One sits, one sits down and gets up again and again, all others walk.
    Crowd,
}

impl Activity {
    /// All activities with their names in specs.
    pub const ALL: [(&str, Self); 3] = [("sitting", Self::Sitting), ("walking", Self::Walking), ("crowd", Self::Crowd)];
}

/// Where it happens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneKind {
    /// An office of 6.4 m × 6 m with a desk in the middle.
    #[default]
    Office,
    /// A damaged hall of 14 m × 12 m: rubble, pillars, crates and barrels, little texture, few lamps.
    Rescue,
    /// Four corridors around a block, 45.6 m along the middle: doors, signs, notice boards, radiators and plants.
    Corridor,
    /// An empty laboratory of 6 m × 5.4 m with white walls: sockets, a cable duct, a whiteboard and floor seams.
    Lab,
}

impl SceneKind {
    /// All scenes with their names in specs.
    pub const ALL: [(&str, Self); 4] =
        [("office", Self::Office), ("rescue", Self::Rescue), ("corridor", Self::Corridor), ("lab", Self::Lab)];
}

/// What someone carries, puts down and fetches again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CarriedObject {
    /// A cardboard box of 36 cm × 26 cm × 24 cm.
    #[default]
    Box,
    /// An open laptop, 34 cm wide, switched off: its screen is too dark for the depth sensor from some distance on.
    Laptop,
}

impl CarriedObject {
    /// All objects with their names in specs.
    pub const ALL: [(&str, Self); 2] = [("box", Self::Box), ("laptop", Self::Laptop)];
}
