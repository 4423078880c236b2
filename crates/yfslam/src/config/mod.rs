//! Every constant of the system, with its meaning, unit and source.
//!
//! Each section is declared once by `config_section!`: the doc comment, the type and the default of a key stand together, and
//! [`Config::to_commented_toml`] prints the same words as comments.

mod dense;
mod depth;
mod method;
mod monocular;
mod places;
mod validate;

use serde::{Deserialize, Serialize};

pub use dense::DenseConfig;
pub use depth::{DepthConfig, DepthSource, StereoConfig};
pub use method::{Grouping, Method};
pub use monocular::MonocularConfig;
pub use places::{LoopConfig, PlaceConfig, PoseGraphConfig};
pub use validate::ConfigError;

/// Field names and doc comments of a configuration section.
pub type FieldDocs = &'static [(&'static str, &'static str)];

macro_rules! config_section {
    ($(#[doc = $sdoc:literal])* $name:ident { $($(#[doc = $fdoc:literal])* $field:ident : $ty:ty = $default:expr),* $(,)? }) => {
        $(#[doc = $sdoc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[doc = $fdoc])* pub $field: $ty,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $name {
            /// What this section is about.
            pub const ABOUT: &'static str = concat!($($sdoc, "\n"),*);
            /// The doc comment of each key.
            pub const FIELDS: FieldDocs = &[$((stringify!($field), concat!($($fdoc, "\n"),*)),)*];
        }
    };
}
pub(crate) use config_section;

config_section! {
    /// ORB features (ORB-SLAM2, IEEE T-RO 2017, section III; Rublee et al., ICCV 2011).
    FeatureConfig {
        /// Features per image. Source: ORB-SLAM2 settings for TUM.
        count: usize = 1000,
        /// Ratio between the scales of neighbouring pyramid levels. Source: ORB-SLAM2 settings.
        scale_factor: f32 = 1.2,
        /// Pyramid levels. Source: ORB-SLAM2 settings.
        levels: usize = 8,
        /// FAST threshold tried first in a cell, grey levels. Source: ORB-SLAM2 settings.
        fast_threshold: u8 = 20,
        /// FAST threshold for cells in which the first finds nothing, grey levels. Source: ORB-SLAM2 settings.
        fast_threshold_low: u8 = 7,
        /// Side of the cells in which the two FAST thresholds are tried, px of the level. Source: ORB-SLAM2.
        cell_px: usize = 30,
    }
}

config_section! {
    /// Motion-only optimisation (ORB-SLAM2, IEEE T-RO 2017, section III-B).
    PoseOptimizerConfig {
        /// Rounds of minimising and re-classifying outliers. Source: ORB-SLAM2.
        rounds: usize = 4,
        /// Rounds with the Huber kernel; later ones are plain least squares. Source: ORB-SLAM2.
        robust_rounds: usize = 2,
        /// Levenberg-Marquardt steps in a round. Source: ORB-SLAM2.
        iterations: usize = 10,
        /// A round ends when a step gains less than this share of the cost.
        relative_tolerance: f64 = 1e-5,
        /// First damping, relative to the diagonal.
        initial_damping: f64 = 1e-5,
    }
}

config_section! {
    /// Bundle adjustment (Triggs et al. 2000; ORB-SLAM2 section III-B).
    BundleConfig {
        /// Steps before outliers are dropped. Source: ORB-SLAM2.
        first_iterations: usize = 5,
        /// Steps after outliers were dropped. Source: ORB-SLAM2.
        second_iterations: usize = 10,
        /// Adjustment ends when a step gains less than this share of the cost.
        relative_tolerance: f64 = 1e-4,
        /// First damping, relative to the diagonal.
        initial_damping: f64 = 1e-4,
    }
}

config_section! {
    /// Tracking (ORB-SLAM2, IEEE T-RO 2017, section III; ORB-SLAM, IEEE T-RO 2015, section V).
    TrackingConfig {
        /// Features needed to start a map. Source: ORB-SLAM2.
        init_min_features: usize = 500,
        /// Landmarks with depth needed to start a map.
        init_min_landmarks: usize = 100,
        /// Largest Hamming distance of a match in a projection search. Source: ORB-SLAM2's TH_HIGH.
        hamming_high: u32 = 100,
        /// Largest Hamming distance of a match without a projection to guide it. Source: ORB-SLAM2's TH_LOW.
        hamming_low: u32 = 50,
        /// Search radius around the prediction from the last frame, px at the finest level. Source: ORB-SLAM2.
        motion_radius_px: f32 = 15.0,
        /// Matches below which the radius is doubled and the search repeated. Source: ORB-SLAM2.
        motion_min_matches: usize = 20,
        /// Inliers with landmarks of the map that the first pose needs. Source: ORB-SLAM2.
        motion_min_inliers: usize = 10,
        /// Ratio of best to second-best distance against the reference keyframe. Source: ORB-SLAM2.
        reference_ratio: f32 = 0.7,
        /// Matches with the reference keyframe that are needed. Source: ORB-SLAM2.
        reference_min_matches: usize = 15,
        /// Features of the last frame that lend their depth to tracking without being landmarks. Source: ORB-SLAM2.
        odometry_points: usize = 100,
        /// Keyframes in the local map at most. Source: ORB-SLAM2.
        local_keyframes: usize = 80,
        /// Covisible neighbours that each keyframe brings into the local map. Source: ORB-SLAM2.
        local_neighbours: usize = 10,
        /// Search radius for local landmarks seen head on (cosine above 0.998), px at the finest level. Source: ORB-SLAM2.
        local_radius_narrow_px: f32 = 2.5,
        /// Search radius for other local landmarks, px at the finest level. Source: ORB-SLAM2.
        local_radius_px: f32 = 4.0,
        /// Factor on both radii for RGB-D input. Source: ORB-SLAM2.
        local_radius_factor: f32 = 3.0,
        /// Ratio of best to second-best distance at the same level. Source: ORB-SLAM2.
        local_ratio: f32 = 0.8,
        /// Least cosine between viewing direction and the landmark's mean direction. Source: ORB-SLAM2.
        min_view_cosine: f64 = 0.5,
        /// A submap with at most this many keyframes is given up when tracking stays lost. Source: ORB-SLAM2.
        reset_max_keyframes: usize = 5,
        /// Time over which there is enough to see for a map and nothing is recognised, before a new submap is begun, s.
        reset_after_s: f64 = 3.0,
        /// Time between frames after which the velocity is no longer believed, s.
        max_gap_s: f64 = 0.5,
        /// Inliers in the local map that a tracked frame needs. Source: ORB-SLAM2.
        local_min_inliers: usize = 30,
    }
}

config_section! {
    /// When a frame becomes a keyframe (ORB-SLAM2, IEEE T-RO 2017, section III-E).
    KeyframeConfig {
        /// Share of the reference keyframe's landmarks below which a keyframe is wanted. ORB-SLAM2 has 0.75, with looser matching.
        reference_ratio: f64 = 0.85,
        /// The same while there are fewer than two keyframes. Source: ORB-SLAM2.
        first_reference_ratio: f64 = 0.4,
        /// Close features tracked below which, and not tracked above which, a keyframe is wanted. Source: ORB-SLAM2.
        close_tracked: usize = 100,
        /// See `close_tracked`. Source: ORB-SLAM2.
        close_untracked: usize = 70,
        /// Inliers that a keyframe needs. Source: ORB-SLAM2.
        min_inliers: usize = 15,
        /// Observation weight that makes a landmark count for the reference (a matched with depth weighs 2). Source: ORB-SLAM2.
        min_observation_weight: usize = 3,
        /// Frames between keyframes at least, unless it is urgent: the time that ORB-SLAM2's mapper is busy with one.
        min_frames: u64 = 5,
        /// Share of the reference keyframe's landmarks below which a keyframe is urgent. Source: ORB-SLAM2.
        urgent_ratio: f64 = 0.25,
    }
}

config_section! {
    /// Growth and refinement of the map (ORB-SLAM2 section III; ORB-SLAM section VI).
    MappingConfig {
        /// Landmarks made from depth, nearest first, before the close limit ends it. ORB-SLAM2 has 100; where people hide what is near,
        /// that leaves too few, and weights by distance already say how little a far depth tells.
        min_depth_landmarks: usize = 1000,
        /// FrameDetections/visible below which a young landmark is dropped. Source: ORB-SLAM2.
        min_found_ratio: f64 = 0.25,
        /// Keyframes during which a landmark is young. Source: ORB-SLAM2.
        probation_keyframes: u64 = 3,
        /// Observation weight a landmark needs after two keyframes. Source: ORB-SLAM2.
        min_observation_weight: usize = 4,
        /// Covisible keyframes with which features without landmark are triangulated. Source: ORB-SLAM2.
        triangulation_neighbours: usize = 10,
        /// Ratio of best to second-best distance in triangulation. Source: ORB-SLAM2.
        triangulation_ratio: f32 = 0.6,
        /// Cosine of the parallax angle above which nothing is triangulated. Source: ORB-SLAM2.
        max_parallax_cosine: f64 = 0.9998,
        /// Covisible keyframes in which duplicates are sought. Source: ORB-SLAM2.
        fuse_neighbours: usize = 10,
        /// Neighbours of each of those that are searched too. Source: ORB-SLAM2.
        fuse_second_neighbours: usize = 5,
        /// Search radius for duplicates, px at the finest level. Source: ORB-SLAM2.
        fuse_radius_px: f32 = 3.0,
        /// Keyframes adjusted together at most, best covisible first.
        window_keyframes: usize = 30,
        /// Keyframes outside the window that hold it in place at most.
        window_fixed: usize = 40,
        /// Share of a keyframe's landmarks seen elsewhere above which it is dropped. Source: ORB-SLAM2.
        redundant_share: f64 = 0.9,
        /// Other keyframes that must see a landmark as finely to make a matched redundant. Source: ORB-SLAM2.
        redundant_views: usize = 3,
    }
}

config_section! {
    /// Method `full`: segmenter of bodies, and what has moved since earlier views.
    FullConfig {
        /// Difference in depth of neighbouring cells of one surface, m: this,
        surface_step_m: f32 = 0.02,
        /// and this share of the depth.
        surface_step_share: f32 = 0.03,
        /// Cells of 4 × 4 px without depth over which a body goes on.
        max_gap_cells: u8 = 8,
        /// Earlier frames that are kept to tell what has moved since.
        views: usize = 8,
        /// Time between them, s.
        view_spacing_s: f64 = 0.5,
        /// Distance of the camera from where it was for a view that still tells, m.
        view_max_distance_m: f64 = 1.0,
        /// The same for its direction, degrees.
        view_max_angle_deg: f64 = 40.0,
        /// Difference from the depth that a view predicts which is taken for the sensor's error, m: this,
        view_tolerance_m: f32 = 0.05,
        /// and this share of the depth.
        view_tolerance_share: f32 = 0.04,
        /// Cells of 8 × 8 px that make something that has moved.
        view_min_cells: usize = 12,
        /// Difference in depth up to which neighbouring cells that have moved are one thing, m.
        view_thing_step_m: f32 = 0.66,
        /// Distance from the body within which a corner sees its outline, px at the finest level.
        edge_px: f32 = 3.0,
        /// Frames over which a track is carried without a box, of those in which a detector looked.
        max_misses: usize = 30,
        /// Overlap (IoU) with the box of somebody who is carried from which on a new box that holds only the wall behind him is his.
        same_box_iou: f32 = 0.7,
        /// Weight of features that boxes speak against in a frame that would be lost without them: if that holds them to be somebody, and the map
        /// knows them, the map is right.
        doubted_trust: f32 = 0.5,
        /// Landmarks seen on a body in such a frame from which on its box is false, and ignored as long as it is there.
        refuting_landmarks: usize = 30,
        /// How far a body that is carried can be from its last depth before it is somebody else, m.
        max_jump_m: f32 = 0.2,
        /// Share of its former size at which a body that is carried is seen whole, and its box follows it.
        whole_share: f32 = 0.9,
        /// Share of its box that shows something nearer when a body is hidden, not gone.
        hidden_share: f32 = 0.5,
        /// A landmark stands there no more if what is seen all around is farther by this, m: most of what moves stands clear of walls,
        through_m: f32 = 0.3,
        /// and this share of its depth.
        through_share: f32 = 0.08,
    }
}

config_section! {
    /// Keeping moving static_objects out (YF-SLAM, section 3.3).
    DynamicConfig {
        /// `none` (ORB-SLAM2), `boxes` (all features in boxes dropped), `yf` (the paper), `ds` (DS-SLAM), `dyna` (DynaSLAM), `dms`
        /// (DMS-SLAM) or `full` (ours).
        method: Method = Method::Full,
        /// How the largest depth group is found: `ransac` (the paper, seeded) or `exact` (deterministic search).
        grouping: Grouping = Grouping::Exact,
        /// Names of the classes that can move.
        movable: Vec<String> = vec!["person".to_owned()],
        /// Frames from one look of the detector to the next; 1 has it look at each. Over those between tracks are carried: by method
        /// `full` for as long as their bodies are there, by `yf` as over frames without boxes. Boxes that come with the frames are thinned alike.
        detect_every: usize = 1,
        /// Whether boxes are used when they are ready, perhaps some frames late, so that no frame waits for the detector once there is a
        /// map: for boards on which it is slower than the camera. Results then differ from run to run.
        detect_async: bool = false,
        /// Roll of the camera, against how it was held on average, above which the detector is given a picture turned upright, degrees;
        /// 180 never turns any. Networks know people who stand.
        upright_roll_deg: f64 = 20.0,
        /// Score at which a box opens a track, and counts for `boxes`. Source: demo threshold of YOLO-FastestV2.
        open_score: f32 = 0.3,
        /// Score at which a box keeps a track.
        keep_score: f32 = 0.1,
        /// Overlap (IoU) of a box with the place predicted by its track.
        track_min_iou: f32 = 0.3,
        /// Difference in depth between a track and a box of the same body, m.
        track_max_depth_gap_m: f32 = 0.3,
        /// Frames over which a track is carried without a box.
        max_misses: usize = 10,
        /// Half the depth of a body, m. Source: NGD-SLAM's 0.33.
        group_half_width_m: f32 = 0.33,
        /// How much nearer than the body a limb may reach, m.
        reach_m: f32 = 0.3,
        /// Depth between a body and what is in front of it, m. Source: NGD-SLAM's gap between clusters.
        group_gap_m: f32 = 0.1,
        /// Share of a box's pixels that makes a body.
        body_min_share: f32 = 0.15,
        /// How far a body moves towards or from the camera between frames, m.
        max_depth_step_m: f32 = 0.15,
        /// Share of its size by which a box is grown on each side: limbs stick out.
        margin: f32 = 0.1,
        /// Distance from the body within which a corner sees its outline, px at the finest level.
        edge_px: f32 = 6.0,
        /// Features that must stay trusted; else the least certain boxes are given up.
        min_trusted: usize = 60,
        /// Features asked for at most, as a multiple of `features.count`, to make up for those on moving bodies. NGD-SLAM asks for 1.5.
        max_extra_features: f64 = 2.5,
        /// Seed of the random draws.
        seed: u64 = 0,
        /// What only method `full` does.
        full: FullConfig = FullConfig::default(),
    }
}

config_section! {
    /// The whole configuration.
    Config {
        /// Feature extraction.
        features: FeatureConfig = FeatureConfig::default(),
        /// Sensor noise.
        depth: DepthConfig = DepthConfig::default(),
        /// Depth from a stereo pair.
        stereo: StereoConfig = StereoConfig::default(),
        /// Dynamic filter.
        dynamic: DynamicConfig = DynamicConfig::default(),
        /// Tracking.
        tracking: TrackingConfig = TrackingConfig::default(),
        /// Keyframe policy.
        keyframes: KeyframeConfig = KeyframeConfig::default(),
        /// Mapping.
        mapping: MappingConfig = MappingConfig::default(),
        /// Place recognition.
        places: PlaceConfig = PlaceConfig::default(),
        /// Loop closing.
        loops: LoopConfig = LoopConfig::default(),
        /// Motion-only optimisation.
        pose: PoseOptimizerConfig = PoseOptimizerConfig::default(),
        /// Bundle adjustment.
        bundle: BundleConfig = BundleConfig::default(),
        /// Pose-graph optimisation.
        pose_graph: PoseGraphConfig = PoseGraphConfig::default(),
        /// A single camera.
        monocular: MonocularConfig = MonocularConfig::default(),
        /// Dense maps.
        dense: DenseConfig = DenseConfig::default(),
    }
}

/// Sections of the configuration in the order of [`Config`], with the docs of their keys.
const SECTIONS: &[(&str, &str, FieldDocs)] = &[
    ("features", FeatureConfig::ABOUT, FeatureConfig::FIELDS),
    ("depth", DepthConfig::ABOUT, DepthConfig::FIELDS),
    ("stereo", StereoConfig::ABOUT, StereoConfig::FIELDS),
    ("dynamic", DynamicConfig::ABOUT, DynamicConfig::FIELDS),
    ("tracking", TrackingConfig::ABOUT, TrackingConfig::FIELDS),
    ("keyframes", KeyframeConfig::ABOUT, KeyframeConfig::FIELDS),
    ("mapping", MappingConfig::ABOUT, MappingConfig::FIELDS),
    ("places", PlaceConfig::ABOUT, PlaceConfig::FIELDS),
    ("loops", LoopConfig::ABOUT, LoopConfig::FIELDS),
    ("pose", PoseOptimizerConfig::ABOUT, PoseOptimizerConfig::FIELDS),
    ("bundle", BundleConfig::ABOUT, BundleConfig::FIELDS),
    ("pose_graph", PoseGraphConfig::ABOUT, PoseGraphConfig::FIELDS),
    ("monocular", MonocularConfig::ABOUT, MonocularConfig::FIELDS),
    ("dense", DenseConfig::ABOUT, DenseConfig::FIELDS),
];

impl Config {
    /// Reads a configuration; keys that are left out keep their defaults, unknown keys are refused.
    ///
    /// # Errors
    /// With line, key and the keys that exist, if the text is not TOML or holds an unknown key or a value of the wrong type.
    pub fn from_toml(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// The configuration as TOML, each key under a comment with its meaning, unit and source.
    ///
    /// # Errors
    /// If a value has no TOML form, such as a seed beyond 2^63.
    pub fn to_commented_toml(&self) -> Result<String, toml::ser::Error> {
        let table = toml::Table::try_from(self)?;
        let mut text = String::new();
        for (name, about, fields) in SECTIONS {
            let Some(section) = table.get(*name) else { continue };
            push_comment(&mut text, about);
            text += &format!("[{name}]\n");
            for (key, doc) in *fields {
                if let Some(value) = section.get(key) {
                    push_comment(&mut text, doc);
                    text += &format!("{key} = {value}\n");
                }
            }
            text.push('\n');
        }
        Ok(text)
    }
}

fn push_comment(text: &mut String, doc: &str) {
    for line in doc.lines() {
        text.push('#');
        text.push_str(line);
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_configuration_reads_back_and_explains_every_key() {
        let text = Config::default().to_commented_toml().unwrap();
        assert_eq!(Config::from_toml(&text).unwrap(), Config::default());
        let lines: Vec<&str> = text.lines().collect();
        let keys = lines.iter().enumerate().filter(|(_, l)| l.contains(" = ") && !l.starts_with('#'));
        assert!(keys.clone().count() > 60);
        for (i, key) in keys {
            assert!(i > 0 && lines[i - 1].starts_with("# "), "no comment above: {key}");
        }
        assert_eq!(SECTIONS.len(), Config::FIELDS.len(), "a section is missing from SECTIONS");
    }

    #[test]
    fn a_value_that_cannot_work_is_refused_by_name() {
        assert_eq!(Config::default().validate(), Ok(()));
        for (text, key) in [
            ("[features]\nscale_factor = nan", "features.scale_factor"),
            ("[features]\nlevels = 0", "features.levels"),
            ("[depth]\ncorner_sigma_px = 0.0", "depth.corner_sigma_px"),
            ("[dynamic]\nopen_score = 30.0", "dynamic.open_score"),
            ("[dense]\nresolution_m = 0.0", "dense.resolution_m"),
        ] {
            let error = Config::from_toml(text).unwrap().validate().unwrap_err();
            assert_eq!(error.key, key);
        }
    }

    #[test]
    fn an_unknown_key_is_refused_by_name() {
        let error = Config::from_toml("[tracking]\nlocal_raduis_px = 4.0\n").unwrap_err().to_string();
        assert!(error.contains("local_raduis_px") && error.contains("local_radius_px"), "{error}");
    }
}
