//! The tracking state, and the reasons why a pose is unknown.

/// State of tracking.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrackingState {
    /// There is no map yet.
    #[default]
    NotInitialized,
    /// The pose is known.
    Tracking,
    /// The pose is unknown; the map is kept for relocalisation.
    Lost,
}

/// How tracking has begun, or resumed after the camera was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackingStart {
    /// A map or a submap was begun with the frame: its pose has no known relation to that of earlier frames.
    NewMap,
    /// A place of the map was recognised: the pose is in the world of that map.
    Recognised,
}

/// Reason why the pose of a frame is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LostReason {
    /// The image has too few features for initialisation.
    #[error("the image has {found} features, but initialisation needs {needed}")]
    TooFewFeatures {
        /// Number of features.
        found: usize,
        /// Least number of features (`tracking.init_min_features`).
        needed: usize,
    },
    /// Too few static features have a depth for initialisation.
    #[error("{found} static features have a depth, but initialisation needs {needed}")]
    TooFewDepths {
        /// Number of static features with depth.
        found: usize,
        /// Least number of features (`tracking.init_min_landmarks`).
        needed: usize,
    },
    /// A camera without depth has not moved far enough for initialisation.
    #[error("no two frames with enough parallax for initialisation yet")]
    NoSecondView,
    /// The mapping thread has not finished the last keyframe yet.
    #[error("the mapping thread is busy")]
    MappingBusy,
    /// Neither the last frame nor the reference keyframe has enough matches for a first pose.
    #[error("too few matches with the last frame and the reference keyframe")]
    TooFewMatches,
    /// Too few landmarks of the local map are inliers.
    #[error("{found} landmarks are inliers, but tracking needs {needed}")]
    TooFewInliers {
        /// Number of inliers.
        found: usize,
        /// Least number of inliers.
        needed: usize,
    },
    /// Tracking was lost, and relocalisation has not recognised a place of the map.
    #[error("relocalisation recognised no place of the map")]
    NotRecognised,
}
