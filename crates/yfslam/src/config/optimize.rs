//! Keys of the optimisers.

use super::section::config_section;

config_section! {
    /// Pose optimisation with fixed landmarks (ORB-SLAM2, IEEE T-RO 2017, section III-B).
    PoseOptimizerConfig {
        /// The number of rounds, each of which minimises the error and then classifies outliers again.
        /// Source: ORB-SLAM2.
        rounds: usize = 4, in 1..=50, "rounds";
        /// The number of rounds that use the Huber kernel before the remaining rounds use plain least squares.
        /// Source: ORB-SLAM2.
        robust_rounds: usize = 2, in 0..=50, "rounds";
        /// The largest number of Levenberg-Marquardt steps in a round.
        /// Source: ORB-SLAM2.
        iterations: usize = 10, in 1..=200, "steps";
        /// A round ends when a step reduces the cost by less than this share.
        /// Source: chosen: later steps gain little.
        relative_tolerance: f64 = 1e-5, in 0.0..=0.5;
        /// The first damping, relative to the diagonal of the normal equations.
        /// Source: chosen: the first estimate is near the minimum.
        initial_damping: f64 = 1e-5, in 0.0..=1000.0;
    }
}

config_section! {
    /// Bundle adjustment (Triggs et al. 2000; ORB-SLAM2, IEEE T-RO 2017, section III-B).
    BundleConfig {
        /// The largest number of steps before outliers are removed.
        /// Source: ORB-SLAM2.
        first_iterations: usize = 5, in 0..=200, "steps";
        /// The largest number of steps after outliers were removed.
        /// Source: ORB-SLAM2.
        second_iterations: usize = 10, in 0..=200, "steps";
        /// The adjustment ends when a step reduces the cost by less than this share.
        /// Source: chosen: later steps gain little.
        relative_tolerance: f64 = 1e-4, in 0.0..=0.5;
        /// The first damping, relative to the diagonal of the normal equations.
        /// Source: chosen: the first estimate is near the minimum.
        initial_damping: f64 = 1e-4, in 0.0..=1000.0;
    }
}

config_section! {
    /// Pose-graph optimisation (ORB-SLAM, IEEE T-RO 2015, section VII-D).
    PoseGraphConfig {
        /// The largest number of steps.
        /// Source: ORB-SLAM2.
        iterations: usize = 20, in 1..=500, "steps";
        /// The optimisation ends when a step reduces the cost by less than this share.
        /// Source: chosen: later steps gain little.
        relative_tolerance: f64 = 1e-4, in 0.0..=0.5;
        /// The first damping, relative to the diagonal of the normal equations.
        /// Source: chosen: relative poses make the problem nearly linear.
        initial_damping: f64 = 1e-8, in 0.0..=1000.0;
    }
}
