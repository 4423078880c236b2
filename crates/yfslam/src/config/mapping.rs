//! Keys of local mapping.

use super::section::config_section;

config_section! {
    /// Local mapping (ORB-SLAM2, IEEE T-RO 2017, section III; ORB-SLAM, IEEE T-RO 2015, section VI).
    MappingConfig {
        /// The number of nearest features of a keyframe that become landmarks also beyond the close limit of the depth.
        /// Source: chosen: the 100 of ORB-SLAM2 are too few where people cover what is near.
        min_depth_landmarks: usize = 1000, in 0..=100_000, "landmarks";
        /// A young landmark is removed when it is matched in less than this share of the frames that should show it.
        /// Source: ORB-SLAM2.
        min_found_ratio: f64 = 0.25, in 0.0..=1.0;
        /// The number of keyframes for which a new landmark is young.
        /// Source: ORB-SLAM2.
        probation_keyframes: u64 = 3, in 0..=100_000, "keyframes";
        /// The observation weight that a landmark needs after two keyframes, where an observation with depth weighs 2 and any other 1.
        /// Source: ORB-SLAM2.
        min_observation_weight: usize = 4, in 0..=1000;
        /// The number of covisible keyframes with which the features of a new keyframe are triangulated.
        /// Source: ORB-SLAM2.
        triangulation_neighbours: usize = 10, in 0..=1000, "keyframes";
        /// The largest ratio of the best to the second-best Hamming distance of a match that is triangulated.
        /// Source: ORB-SLAM2.
        triangulation_ratio: f32 = 0.6, in 0.0..=1.0;
        /// The cosine of the parallax angle above which a match is not triangulated.
        /// Source: ORB-SLAM2.
        max_parallax_cosine: f64 = 0.9998, in 0.0..=1.0;
        /// The number of covisible keyframes in which duplicates of landmarks are searched.
        /// Source: ORB-SLAM2.
        fuse_neighbours: usize = 10, in 0..=1000, "keyframes";
        /// The number of neighbours of each covisible keyframe in which duplicates of landmarks are searched too.
        /// Source: ORB-SLAM2.
        fuse_second_neighbours: usize = 5, in 0..=1000, "keyframes";
        /// The search radius for duplicates of landmarks, in pixels of the finest level.
        /// Source: ORB-SLAM2.
        fuse_radius_px: f32 = 3.0, in 0.1..=1000.0, "px";
        /// The largest number of keyframes that local bundle adjustment moves, the best covisible ones first.
        /// Source: chosen: it bounds the time of local bundle adjustment.
        window_keyframes: usize = 30, in 1..=200, "keyframes", basic;
        /// The largest number of further keyframes whose observations local bundle adjustment uses while their poses stay fixed.
        /// Source: chosen: it bounds the time of local bundle adjustment.
        window_fixed: usize = 40, in 0..=2000, "keyframes";
        /// A keyframe is removed when more than this share of its landmarks is observed by at least `redundant_views` other keyframes.
        /// Source: ORB-SLAM2, section III-E.
        redundant_share: f64 = 0.9, in 0.0..=1.0;
        /// The number of other keyframes that must observe a landmark at the same or a finer scale to make an observation redundant.
        /// Source: ORB-SLAM2, section III-E.
        redundant_views: usize = 3, in 1..=1000, "keyframes";
    }
}
