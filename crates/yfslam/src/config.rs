//! Every constant of the system, with its meaning, unit and source.
//!
//! Each section is declared once by `config_section!`: the doc comment, the type and the default of a key stand together, and
//! [`Config::to_commented_toml`] prints the same words as comments.

use serde::{Deserialize, Serialize};

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
    /// The whole configuration.
    Config {
        /// Feature extraction.
        features: FeatureConfig = FeatureConfig::default(),
    }
}
