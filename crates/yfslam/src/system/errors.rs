//! What can be wrong with a setup or a frame.

use crate::camera::CameraError;
use crate::config::ConfigError;
use crate::dense::DenseError;

/// Why a system could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// A movable class that the detector does not know.
    #[error("dynamic.movable names the class '{name}', which the detector does not know; it knows: {known}")]
    UnknownClass {
        /// The class asked for.
        name: String,
        /// The classes the detector has.
        known: String,
    },
    /// A calibration that no camera can have.
    #[error("the camera: {0}")]
    Camera(#[from] CameraError),
    /// A value of the configuration with which nothing can work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A stereo camera with lens distortion: points do not lie in the same row of both images.
    #[error(
        "depth.source is `stereo`, but the camera has distortion {0:?}: rectify the images and give the calibration without distortion"
    )]
    NotRectified([f64; 5]),
    /// A map made with other feature settings.
    #[error(
        "the map was made with {found} pyramid levels of scale {found_scale}, the configuration has {wanted} of {wanted_scale}: \
         set features.levels and features.scale_factor to the map's"
    )]
    MapFeatures {
        /// Levels of the map's features.
        found: usize,
        /// Their scale factor.
        found_scale: f32,
        /// Levels configured.
        wanted: usize,
        /// Scale factor configured.
        wanted_scale: f32,
    },
    /// A map made with another camera, which can be localised in but not extended.
    #[error(
        "the map was made with another camera ({0} px wide, fx {1}): use its calibration, or localise in the map instead of extending it"
    )]
    MapCamera(usize, f64),
    /// A map whose unit of length is not the metre, for a camera that measures metres.
    #[error(
        "the map was made by a camera without depth, in a unit of its own: use it with such a camera (--sensor mono, depth.source = \"motion\")"
    )]
    MapWithoutScale,
    /// A dense map for a camera without depth images.
    #[error("a dense map needs depth images: set depth.source to `image`, or leave the dense map out")]
    DenseWithoutDepth,
    /// A dense map that cannot be made or continued.
    #[error(transparent)]
    Dense(#[from] DenseError),
    /// A thread could not be started.
    #[error("a thread could not be started: {0}")]
    Thread(#[from] std::io::Error),
}

/// A frame that cannot be used. The system goes on with the next one as if this one had not come.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameRejected {
    /// The images do not fit the camera.
    #[error(
        "the {image} image is {width}x{height}, the camera {camera_width}x{camera_height}: give the calibration of this size"
    )]
    Size {
        /// Which image: colour, depth, right or mask.
        image: &'static str,
        /// Its width, px.
        width: usize,
        /// Its height, px.
        height: usize,
        /// The camera's width, px.
        camera_width: usize,
        /// The camera's height, px.
        camera_height: usize,
    },
    /// Depth is to come from a depth image, and there is none.
    #[error(
        "the frame has no depth image, but depth.source is `image`: give the frames of an RGB-D camera, or set depth.source to `stereo` \
         or `motion`"
    )]
    NoDepthImage,
    /// Depth is to come from stereo, and there is no right image.
    #[error(
        "the frame has no right image, but depth.source is `stereo`: give the frames of a stereo camera, or set depth.source to \
         `image` or `motion`"
    )]
    NoRightImage,
    /// The clock did not advance.
    #[error(
        "the time stamp {timestamp_ns} ns does not come after {last_ns} ns, that of the last frame: the frame is repeated or late"
    )]
    Time {
        /// Stamp of the frame, ns.
        timestamp_ns: i64,
        /// Stamp of the frame before, ns.
        last_ns: i64,
    },
}
