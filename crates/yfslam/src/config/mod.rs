//! Every constant of the system, with its meaning, unit, range and source.
//!
//! Each key is declared once, by `config_section!` in the file of its section. [`Config::validate`] checks the declared ranges, and
//! [`Config::to_commented_toml`] prints the documentation of the keys as comments.

mod dense;
mod depth;
mod dynamic;
mod features;
mod keyframes;
mod mapping;
mod method;
mod monocular;
mod optimize;
mod places;
#[cfg(test)]
mod range_tests;
mod section;
#[cfg(test)]
mod tests;
mod tracking;
mod validate;

pub use dense::DenseConfig;
pub use depth::{DepthConfig, DepthSource, StereoConfig};
pub use dynamic::{DynamicConfig, FullConfig};
pub use features::FeatureConfig;
pub use keyframes::KeyframeConfig;
pub use mapping::MappingConfig;
pub use method::{Grouping, Method};
pub use monocular::MonocularConfig;
pub use optimize::{BundleConfig, PoseGraphConfig, PoseOptimizerConfig};
pub use places::{LoopConfig, PlaceConfig};
pub use tracking::{ReadoutEstimation, TrackingConfig};
pub use validate::ConfigError;

use section::{Check, Key, Section, config_section};

/// The largest seed: TOML has no greater integer.
const MAX_SEED: u64 = i64::MAX as u64;

config_section! {
    /// The configuration: every constant of the system.
    Config {
        /// The keys of feature extraction.
        features: FeatureConfig = FeatureConfig::default(), section;
        /// The keys of the depth of features.
        depth: DepthConfig = DepthConfig::default(), section;
        /// The keys of stereo matching.
        stereo: StereoConfig = StereoConfig::default(), section;
        /// The keys of the dynamic filter.
        dynamic: DynamicConfig = DynamicConfig::default(), section;
        /// The keys of tracking.
        tracking: TrackingConfig = TrackingConfig::default(), section;
        /// The keys of keyframe insertion.
        keyframes: KeyframeConfig = KeyframeConfig::default(), section;
        /// The keys of local mapping.
        mapping: MappingConfig = MappingConfig::default(), section;
        /// The keys of place recognition and relocalisation.
        place_recognition: PlaceConfig = PlaceConfig::default(), section;
        /// The keys of loop closing.
        loops: LoopConfig = LoopConfig::default(), section;
        /// The keys of pose optimisation.
        pose_optimizer: PoseOptimizerConfig = PoseOptimizerConfig::default(), section;
        /// The keys of bundle adjustment.
        bundle: BundleConfig = BundleConfig::default(), section;
        /// The keys of pose-graph optimisation.
        pose_graph: PoseGraphConfig = PoseGraphConfig::default(), section;
        /// The keys of a single camera without depth.
        monocular: MonocularConfig = MonocularConfig::default(), section;
        /// The keys of dense maps.
        dense: DenseConfig = DenseConfig::default(), section;
    }
}

impl Config {
    /// Reads a configuration; keys that are left out keep their defaults, unknown keys are refused.
    ///
    /// # Errors
    /// With line, key and the keys that exist, if the text is not TOML or holds an unknown key or a value of the wrong type.
    pub fn from_toml(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// Returns the configuration as TOML, first the basic keys and then the advanced ones, each under a comment with its meaning, unit,
    /// range and source. [`Config::from_toml`] reads it back.
    ///
    /// # Errors
    /// If a value has no TOML form, such as a seed beyond 2^63.
    pub fn to_commented_toml(&self) -> Result<String, toml::ser::Error> {
        let table = toml::Table::try_from(self)?;
        let mut basic = String::new();
        push_comment(&mut basic, Self::ABOUT);
        basic += "\n# Basic keys\n# ----------\n\n";
        let mut advanced = "# Advanced keys\n# -------------\n\n".to_owned();
        self.visit_keys("", &mut |path, key, number| {
            if let Check::Section(about) = key.check {
                advanced += &format!("# Section {path}\n");
                push_comment(&mut advanced, about);
                advanced.push('\n');
                return;
            }
            // As text, a number has no more digits than its own precision needs.
            let value = number.map(|number| number.to_toml());
            let value = value.or_else(|| value_at(&table, path).map(ToString::to_string)).unwrap_or_default();
            let text = if key.basic { &mut basic } else { &mut advanced };
            push_doc(text, key);
            *text += &format!("{path} = {value}\n\n");
        });
        Ok(basic + &advanced)
    }

    /// Returns the configuration as the stages use it: for a camera without depth, section `monocular` replaces keys of other sections.
    #[must_use]
    pub(crate) fn for_sensor(mut self) -> Self {
        if self.depth.source == DepthSource::Motion {
            let m = &self.monocular;
            self.keyframes.reference_ratio = m.reference_ratio;
            self.keyframes.min_observation_weight = m.reference_observation_weight;
            self.keyframes.min_frames = m.min_frames;
            self.tracking.local_radius_factor = m.local_radius_factor;
            self.mapping.triangulation_neighbours = m.triangulation_neighbours;
            self.mapping.min_observation_weight = m.min_observation_weight;
        }
        self
    }
}

/// Returns the value of a key, given its full name.
fn value_at<'a>(table: &'a toml::Table, path: &str) -> Option<&'a toml::Value> {
    let (name, rest) = path.split_once('.').unwrap_or((path, ""));
    let value = table.get(name)?;
    if rest.is_empty() { Some(value) } else { value_at(value.as_table()?, rest) }
}

/// Appends the sentence of a key; then unit, range or values, and source.
fn push_doc(text: &mut String, key: &Key) {
    let (sentence, source) = key.doc.split_once("Source:").unwrap_or((key.doc, ""));
    push_comment(text, sentence);
    match key.check {
        Check::Range(range) => {
            let [from, to] = range();
            if !key.unit.is_empty() {
                *text += &format!("# Unit: {}.", key.unit);
            }
            *text += if key.unit.is_empty() { "# " } else { " " };
            *text += &format!("Range: {from} to {to}.");
        }
        Check::Any | Check::Section(_) if key.unit.is_empty() => *text += "# Values: true or false.",
        Check::Any | Check::Section(_) => *text += &format!("# Values: {}.", key.unit),
    }
    let words: Vec<&str> = source.split_whitespace().collect();
    *text += &format!(" Source: {}\n", words.join(" "));
}

fn push_comment(text: &mut String, doc: &str) {
    for line in doc.lines().filter(|line| !line.trim().is_empty()) {
        *text += &format!("#{line}\n");
    }
}
