//! Whether the pose is known, and why not.

/// Whether the pose of the camera is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrackingState {
    /// There is no map yet.
    #[default]
    NotInitialized,
    /// The pose is known.
    Tracking,
    /// The pose is not known; the map stays.
    Lost,
}

/// Why the pose of a frame is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LostReason {
    /// The image has too few features to begin a map.
    #[error("{found} features, {needed} are needed to begin a map")]
    TooFewFeatures {
        /// Features found.
        found: usize,
        /// Features needed (`tracking.init_min_features`).
        needed: usize,
    },
    /// Too few static features have a depth to begin a map.
    #[error("{found} static features with depth, {needed} are needed to begin a map")]
    TooFewDepths {
        /// Static features with depth.
        found: usize,
        /// Features needed (`tracking.init_min_landmarks`).
        needed: usize,
    },
    /// A camera without depth has not moved far enough sideways to begin a map.
    #[error("no second view with enough parallax yet")]
    NoSecondView,
    /// The mapping thread has not finished the last keyframe.
    #[error("the mapping thread is busy")]
    MappingBusy,
    /// Neither the last frame nor the reference keyframe gives enough matches for a first pose.
    #[error("too few matches with the last frame and the reference keyframe")]
    TooFewMatches,
    /// Too few landmarks of the local map fit.
    #[error("{found} landmarks fit, {needed} are needed")]
    TooFewInliers {
        /// Landmarks that fit.
        found: usize,
        /// Landmarks needed.
        needed: usize,
    },
    /// The camera was lost, and no place of the map was recognised.
    #[error("no place of the map was recognised")]
    NotRecognised,
}
