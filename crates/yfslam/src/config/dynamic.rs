//! Keys of the dynamic filter.

use super::section::config_section;
use super::{Grouping, MAX_SEED, Method};

config_section! {
    /// Method `full`: person masks from depth, and objects that have moved since earlier frames.
    FullConfig {
        /// The depth difference of neighbouring cells up to which they belong to one surface, to which `surface_step_share` of the depth is
        /// added.
        /// Source: chosen: the quantisation of structured-light depth.
        surface_step_m: f32 = 0.02, in 0.0..=10.0, "m";
        /// The share of the depth that is added to `surface_step_m`.
        /// Source: chosen: the slope of surfaces and noise that grows with distance.
        surface_step_share: f32 = 0.03, in 0.0..=1.0;
        /// The number of 4 × 4 px cells without depth across which a person mask continues.
        /// Source: chosen: dark clothes and edges have no depth.
        max_gap_cells: u8 = 8, in 0..=250, "cells";
        /// The number of earlier frames in the depth history.
        /// Source: chosen: with the spacing, the last four seconds.
        history_frames: usize = 8, in 1..=100, "frames";
        /// The smallest time between two frames of the depth history.
        /// Source: chosen: people move noticeably within that time.
        history_spacing_s: f64 = 0.5, in 0.0..=60.0, "s";
        /// The distance from the camera up to which a frame of the depth history is compared.
        /// Source: chosen: beyond it, the views overlap too little.
        history_max_distance_m: f64 = 1.0, in 0.0..=1000.0, "m";
        /// The angle to the camera's orientation up to which a frame of the depth history is compared.
        /// Source: chosen: beyond it, the views overlap too little.
        history_max_angle_deg: f64 = 40.0, in 0.0..=180.0, "degrees";
        /// The difference from the depth predicted by the depth history that counts as noise, to which `history_tolerance_share` of the depth
        /// is added.
        /// Source: chosen: noise of structured-light depth and of the pose.
        history_tolerance_m: f32 = 0.05, in 0.0..=10.0, "m";
        /// The share of the depth that is added to `history_tolerance_m`.
        /// Source: chosen: noise grows with distance.
        history_tolerance_share: f32 = 0.04, in 0.0..=1.0;
        /// The number of connected 8 × 8 px cells from which on a region that is nearer than the depth history counts as a moving object.
        /// Source: chosen: smaller regions are mostly noise.
        history_min_cells: usize = 12, in 1..=1_000_000, "cells";
        /// The depth difference up to which neighbouring moving cells belong to the same object.
        /// Source: chosen: the depth of a person, twice NGD-SLAM's 0.33.
        history_cluster_step_m: f32 = 0.66, in 0.0..=10.0, "m";
        /// The number of earlier frames in which the features of an instance are looked for, to learn whether it has moved.
        /// Source: chosen: with the spacing, the last two seconds, in which also people who sway have left their place.
        displacement_frames: usize = 8, in 1..=100, "frames";
        /// The smallest time between two of these frames.
        /// Source: chosen: the time of a slow step.
        displacement_spacing_s: f64 = 0.25, in 0.0..=60.0, "s";
        /// The distance from the camera up to which such a frame is compared.
        /// Source: chosen: farther away, features look different.
        displacement_max_distance_m: f64 = 0.5, in 0.0..=1000.0, "m";
        /// The angle to the camera's orientation up to which such a frame is compared.
        /// Source: chosen: see `displacement_max_distance_m`.
        displacement_max_angle_deg: f64 = 20.0, in 0.0..=180.0, "degrees";
        /// The distance from its place within which a feature is looked for in the earlier frame, in pixels of the finest level.
        /// Source: chosen: three standard deviations of the position in two images; at 2 m, 12 mm.
        displacement_px: f32 = 3.0, in 0.1..=100.0, "px";
        /// The largest Hamming distance between the descriptors of a feature in both frames.
        /// Source: chosen: as `tracking.hamming_low`.
        displacement_max_bits: u32 = 50, in 0..=256, "bits";
        /// The number of features of an instance from which on they can show whether it moves.
        /// Source: chosen: fewer say little about a share.
        displacement_min_features: u32 = 15, in 1..=100_000, "features";
        /// The share of its features that is found, relative to that of the background, from which on an instance stands still.
        /// Source: chosen: the features of a body that sits are found like those of the background, but for its arms and its edge.
        still_share: f32 = 0.6, in 0.0..=1.0;
        /// The same share below which an instance moves.
        /// Source: chosen: half of `still_share`.
        moving_share: f32 = 0.3, in 0.0..=1.0;
        /// The distance from its place within which a feature that is not there is looked for in the earlier frame, in pixels.
        /// Source: chosen: in a quarter of a second, an object 1.5 m away that moves by 0.9 m/s.
        second_motion_px: f32 = 80.0, in 1.0..=1000.0, "px";
        /// The number of features that must move together to count as an object that no detector knows.
        /// Source: chosen: fewer move together by chance.
        second_motion_min_features: usize = 12, in 4..=100_000, "features";
        /// The share of the image from which on a person mask is doubted as long as it has not moved.
        /// Source: chosen: a mask that covers most of the image is often false, and leaves too little for a pose.
        max_unproven_share: f32 = 0.5, in 0.0..=1.0;
        /// The distance from a person mask within which a feature counts as part of its edge, in pixels of the finest level.
        /// Source: chosen: depth edges are exact to a few pixels.
        edge_px: f32 = 3.0, in 0.0..=100.0, "px";
        /// The number of frames with detections for which a track continues without a bounding box.
        /// Source: chosen: one second at 30 frames per second.
        max_misses: usize = 30, in 0..=100_000, "frames";
        /// The overlap (IoU) with a continued track's bounding box from which on a new bounding box that contains only background is given to
        /// that track.
        /// Source: chosen: bounding boxes with such an overlap are nearly the same.
        same_box_iou: f32 = 0.7, in 0.0..=1.0;
        /// The trust of features in bounding boxes in a frame that cannot be tracked without them.
        /// Source: chosen: half, as bounding box and map contradict each other.
        doubted_box_trust: f32 = 0.5, in 0.0..=0.99;
        /// The largest change of a person's depth over frames without a bounding box.
        /// Source: chosen: a person moves less between frames.
        max_jump_m: f32 = 0.2, in 0.001..=100.0, "m";
        /// The share of its former size from which on a person mask counts as completely visible, so that the bounding box follows it.
        /// Source: chosen: masks vary by less from frame to frame.
        full_visibility_share: f32 = 0.9, in 0.0..=1.0;
        /// The share of a bounding box covered by nearer surfaces from which on a missing person counts as occluded and the track continues.
        /// Source: chosen: half of the box.
        occlusion_share: f32 = 0.5, in 0.0..=1.0;
        /// A landmark counts as gone when the measured depth around it is larger by this margin plus `free_space_margin_share` of its depth.
        /// Source: chosen: most moving objects stand clear of walls.
        free_space_margin_m: f32 = 0.3, in 0.000_1..=1000.0, "m";
        /// The share of a landmark's depth that is added to `free_space_margin_m`.
        /// Source: chosen: noise grows with distance.
        free_space_margin_share: f32 = 0.08, in 0.0..=1.0;
    }
}

config_section! {
    /// Dynamic filter: which features are kept out of tracking and mapping (YF-SLAM, section 3.3).
    DynamicConfig {
        /// The dynamic filter: none (ORB-SLAM2), boxes (all features in bounding boxes are dropped), yf (YF-SLAM), ds (DS-SLAM),
        /// dyna (DynaSLAM), dms (DMS-SLAM) or full (the method of this project).
        /// Source: chosen: the method of this project.
        method: Method = Method::Full, any, "none, boxes, yf, ds, dyna, dms, full", basic;
        /// The search for the largest depth group in a bounding box: seeded random draws as in the paper (ransac), or all groups (exact).
        /// Source: YF-SLAM, section 3.3, for ransac; exact chosen: it needs no random draws.
        grouping: Grouping = Grouping::Exact, any, "ransac, exact";
        /// The names of the detector's classes that can move.
        /// Source: YF-SLAM, section 3.3.
        movable: Vec<String> = vec!["person".to_owned()], any, "names of classes of the detector", basic;
        /// The number of frames from one detection to the next, between which the methods `full` and `yf` continue the tracks.
        /// Source: chosen: every image is searched.
        detect_every: usize = 1, in 1..=10_000, "frames", basic;
        /// The longest time from one detection to the next, if no track is uncertain, nothing moves that no track covers, and the view has
        /// not changed; 0 for a detection on every frame that `detect_every` leaves.
        /// Source: chosen: every image is searched; 0.15 is meant for boards.
        detect_max_gap_s: f64 = 0.0, in 0.0..=60.0, "s", basic;
        /// Whether frames do not wait for the detector once there is a map, which makes results differ from run to run.
        /// Source: chosen: results repeat exactly without it; it is meant for boards whose detector is slower than the camera.
        detect_async: bool = false, any, basic;
        /// The roll of the camera against its average above which the detector gets an upright image; 180 turns it off.
        /// Source: chosen: detectors find people who stand upright.
        roll_compensation_deg: f64 = 20.0, in 0.0..=180.0, "degrees", basic;
        /// The score from which on a detection starts a track, and is used by the method `boxes`.
        /// Source: threshold of the demo program of YOLO-FastestV2.
        open_score: f32 = 0.3, in 0.0..=1.0, basic;
        /// The score from which on a detection continues a track.
        /// Source: chosen: a person who was detected before needs less evidence.
        keep_score: f32 = 0.1, in 0.0..=1.0;
        /// The overlap (IoU) of a detection with the predicted bounding box of a track from which on it can continue the track.
        /// Source: chosen: usual in tracking by detection.
        track_min_iou: f32 = 0.3, in 0.0..=1.0;
        /// The depth difference between a track and a detection up to which both can be the same person.
        /// Source: chosen: about half the depth of a person.
        track_max_depth_gap_m: f32 = 0.3, in 0.0..=100.0, "m";
        /// The number of frames for which a track continues without a bounding box.
        /// Source: chosen: a third of a second.
        max_misses: usize = 10, in 0..=100_000, "frames";
        /// Half the depth extent of a person.
        /// Source: NGD-SLAM.
        group_half_width_m: f32 = 0.33, in 0.01..=10.0, "m";
        /// The distance in depth from the person within which arms and legs are added to the mask.
        /// Source: chosen: with half the depth extent, the length of an arm.
        limb_reach_m: f32 = 0.3, in 0.0..=10.0, "m";
        /// The depth difference between a depth group and a group in front of it.
        /// Source: NGD-SLAM's gap between clusters.
        group_gap_m: f32 = 0.1, in 0.01..=10.0, "m";
        /// The share of the pixels of a bounding box from which on a depth group can be a person.
        /// Source: chosen: a person covers more of a bounding box.
        group_min_share: f32 = 0.15, in 0.0..=1.0;
        /// The largest change of a person's depth between two frames.
        /// Source: chosen: a fast walk at 15 frames per second.
        max_depth_step_m: f32 = 0.15, in 0.0..=10.0, "m";
        /// The share of its size by which a bounding box is enlarged on each side.
        /// Source: chosen: arms and legs reach beyond bounding boxes.
        box_margin_share: f32 = 0.1, in 0.0..=2.0;
        /// The distance from a moving region within which a feature counts as part of its edge, in pixels of the finest level.
        /// Source: chosen: the patch of a feature covers the edge.
        edge_px: f32 = 6.0, in 0.0..=100.0, "px";
        /// The number of features that must stay trusted, for which the features of the least certain bounding boxes are trusted again.
        /// Source: chosen: twice the inliers that a tracked frame needs.
        min_trusted: usize = 60, in 0..=100_000, "features";
        /// The largest factor on `features.count` that makes up for features on moving objects.
        /// Source: chosen: it makes up for people on six tenths of an image; NGD-SLAM has 1.5.
        max_feature_factor: f64 = 2.5, in 1.0..=10.0;
        /// The seed of the random draws.
        /// Source: chosen: any number will do.
        seed: u64 = 0, in 0..=MAX_SEED;
        /// The keys of the method `full`.
        full: FullConfig = FullConfig::default(), section;
    }
}
