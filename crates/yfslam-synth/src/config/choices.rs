//! The choices of a world: motion of the camera, activity of the people, scene, carried object.

use serde::{Deserialize, Serialize};

/// Motion of the camera, following the freiburg3 sequences of the TUM RGB-D benchmark (Sturm et al., IROS 2012).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraMotion {
    /// Held still by hand: 0.28 m in 24.8 s, only hand shake.
    Static,
    /// Along the three axes in turn with constant orientation: 5.79 m in 28.8 s.
    Xyz,
    /// Rotation about roll, pitch and yaw: 2.70 m in 30.6 s, 21°/s.
    Rpy,
    /// On a half sphere, directed at its centre: 7.69 m in 35.8 s.
    Halfsphere,
    /// On a wheeled robot, forward along the circuit of the scene at up to 0.7 m/s, with slight vibration.
    Drive,
    /// Carried once along the circuit of the scene and 6 % past its start. The number of frames sets the speed, within 0.4 to 1.2
    /// m/s and at most 40°/s. At the highest speed the corridor takes 1241 frames at 30 Hz, 1320 with the overlap; fewer frames
    /// show a part of it.
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

/// Activity of the people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activity {
    /// They walk around the desk in the same direction, two abreast, stop, turn and walk on. Where a camera on a circuit leaves no
    /// room for that (the corridor), they walk along its circuit: every second one ahead of the camera, the others towards it and
    /// past it.
    Walking,
    /// They sit (or stand, once the chairs are taken) and gesture slightly.
    Sitting,
    /// One sits, one repeatedly sits down and gets up, all others walk.
    Crowd,
}

impl Activity {
    /// All activities with their names in specs.
    pub const ALL: [(&str, Self); 3] = [("sitting", Self::Sitting), ("walking", Self::Walking), ("crowd", Self::Crowd)];
}

/// The scene.
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

/// The object that a person carries, puts down and fetches again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CarriedObject {
    /// A cardboard box of 36 cm × 26 cm × 24 cm.
    #[default]
    Box,
    /// An open laptop, 34 cm wide, switched off: beyond some distance its screen is too dark for the depth sensor.
    Laptop,
}

impl CarriedObject {
    /// All objects with their names in specs.
    pub const ALL: [(&str, Self); 2] = [("box", Self::Box), ("laptop", Self::Laptop)];
}

/// An object that no person detector knows and that moves without a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnknownObject {
    /// A cardboard box of 45 cm × 35 cm × 35 cm crosses the view.
    Box,
    /// A cardboard box of 95 cm × 45 cm × 80 cm comes close, covers most of the view, and leaves.
    LargeBox,
    /// An open laptop is handed from the left to the right, close to the camera.
    Laptop,
    /// A door of 90 cm × 2 m opens and is closed.
    Door,
    /// A partition wall of 1.7 m × 1.4 m, which covers three fifths of the view, is rolled aside and back.
    Wall,
}

impl UnknownObject {
    /// All objects with their names in specs.
    pub const ALL: [(&str, Self); 5] = [
        ("box", Self::Box),
        ("large_box", Self::LargeBox),
        ("laptop", Self::Laptop),
        ("door", Self::Door),
        ("wall", Self::Wall),
    ];
}
