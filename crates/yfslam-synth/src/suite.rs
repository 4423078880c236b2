//! The suite of named worlds, each difficult in one way.
//!
//! In: a name. Out: the differences from [`WorldConfig::default`]. The eight `sitting_*` and `walking_*` follow the freiburg3
//! sequences of the TUM RGB-D benchmark (Sturm et al., IROS 2012).

use crate::config::{Activity, CameraMotion, SceneKind, UnknownObject, WorldConfig};

/// A world of the suite.
#[derive(Clone, Copy, Debug)]
pub struct NamedWorld {
    /// Name in descriptions, such as `walking_xyz`.
    pub name: &'static str,
    /// Description in one line.
    pub about: &'static str,
    set: fn(&mut WorldConfig),
}

/// The world for an empty name.
pub const DEFAULT_NAME: &str = "walking_xyz";

const fn world(name: &'static str, about: &'static str, set: fn(&mut WorldConfig)) -> NamedWorld {
    NamedWorld { name, about, set }
}

/// All worlds of the suite, in the order of the tables.
pub const SUITE: &[NamedWorld] = &[
    world("sitting_static", "people sit at the desk and gesture; the camera is held still", |c| {
        sitting(c, CameraMotion::Static);
    }),
    world("sitting_xyz", "people sit and gesture; the camera moves along its three axes", |c| {
        sitting(c, CameraMotion::Xyz);
    }),
    world("sitting_rpy", "people sit and gesture; the camera rolls, pitches and yaws", |c| {
        sitting(c, CameraMotion::Rpy);
    }),
    world("sitting_halfsphere", "people sit and gesture; the camera moves on a half sphere", |c| {
        sitting(c, CameraMotion::Halfsphere);
    }),
    world("walking_static", "people walk through the image; the camera is held still", |c| {
        walking(c, CameraMotion::Static);
    }),
    world("walking_xyz", "people walk through the image; the camera moves along its three axes", |c| {
        walking(c, CameraMotion::Xyz);
    }),
    world("walking_rpy", "people walk through the image; the camera rolls, pitches and yaws", |c| {
        walking(c, CameraMotion::Rpy);
    }),
    world("walking_halfsphere", "people walk through the image; the camera moves on a half sphere", |c| {
        walking(c, CameraMotion::Halfsphere);
    }),
    world(
        "pushed_chair",
        "a person pushes a chair around the desk while another one walks; the camera moves along its axes",
        |c| {
            passing(c, CameraMotion::Xyz);
            c.actors.pushed_chair = true;
        },
    ),
    world(
        "carried_box",
        "a person carries a box, puts it down, leaves it and fetches it; the camera moves on a half sphere",
        |c| {
            walking(c, CameraMotion::Halfsphere);
            c.actors.carried_box = true;
        },
    ),
    world("crowd", "six people, one of whom sits and one sits down and gets up, fill half of the image", |c| {
        (c.activity, c.motion) = (Activity::Crowd, CameraMotion::Xyz);
        (c.people, c.person_share) = (6, 0.5);
    }),
    world(
        "corridor_loop",
        "people walk along four corridors around a block; the camera is carried around it once",
        |c| {
            passing(c, CameraMotion::Loop);
            c.scene = SceneKind::Corridor;
            // Once around: one person walks ahead of the camera, one comes towards it.
            c.person_share = 0.1;
            c.frames = 1250;
        },
    ),
    world(
        "dark_rescue",
        "a damaged hall with little texture and failing light; a robot drives through it behind two people",
        |c| {
            passing(c, CameraMotion::Drive);
            c.scene = SceneKind::Rescue;
            (c.light.exposure, c.light.flicker) = (0.5, 0.6);
        },
    ),
    world(
        "nonobstructing_box",
        "a box that no detector knows crosses the view; the camera moves along its axes",
        |c| {
            unknown(c, CameraMotion::Xyz, UnknownObject::Box);
        },
    ),
    world(
        "obstructing_box",
        "a large box comes close to the camera and covers most of the view; the camera moves",
        |c| {
            unknown(c, CameraMotion::Xyz, UnknownObject::LargeBox);
        },
    ),
    world(
        "handed_laptop",
        "a laptop is handed from left to right before the camera, which moves on a half sphere",
        |c| {
            unknown(c, CameraMotion::Halfsphere, UnknownObject::Laptop);
        },
    ),
    world("opening_door", "a door opens and is closed; the camera moves along its three axes", |c| {
        unknown(c, CameraMotion::Xyz, UnknownObject::Door);
    }),
    world(
        "moving_wall",
        "a partition wall that covers three fifths of the view is rolled aside and back; the camera moves",
        |c| {
            unknown(c, CameraMotion::Xyz, UnknownObject::Wall);
        },
    ),
];

/// An object moves, and nobody is there.
fn unknown(config: &mut WorldConfig, motion: CameraMotion, object: UnknownObject) {
    (config.motion, config.people, config.person_share) = (motion, 0, 0.0);
    config.actors.unknown = Some(object);
}

fn sitting(config: &mut WorldConfig, motion: CameraMotion) {
    (config.activity, config.motion) = (Activity::Sitting, motion);
}

/// Two pairs walk past: enough to move most of the corners of the image, but few enough to leave walls to track.
fn walking(config: &mut WorldConfig, motion: CameraMotion) {
    (config.activity, config.motion) = (Activity::Walking, motion);
    (config.people, config.person_share) = (4, 0.3);
}

/// Two people, for narrow places and worlds with another difficulty.
fn passing(config: &mut WorldConfig, motion: CameraMotion) {
    (config.activity, config.motion) = (Activity::Walking, motion);
}

impl NamedWorld {
    /// Applies the settings of this world.
    pub(crate) fn apply(&self, config: &mut WorldConfig) {
        (self.set)(config);
    }
}

/// Returns the names of all worlds of the suite.
pub fn names() -> Vec<&'static str> {
    SUITE.iter().map(|world| world.name).collect()
}

/// Returns the world with this name.
pub fn find(name: &str) -> Option<&'static NamedWorld> {
    SUITE.iter().find(|world| world.name == name)
}
