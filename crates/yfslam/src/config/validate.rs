//! Values with which nothing can work, refused before a run rather than after it.

use super::Config;

/// A value of the configuration with which nothing can work.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} = {value} in the configuration cannot work: it must be {must}")]
pub struct ConfigError {
    /// Section and key.
    pub key: &'static str,
    /// The value found.
    pub value: String,
    /// What would do.
    pub must: &'static str,
}

impl Config {
    /// Checks the values that would otherwise make a run fail without a word.
    ///
    /// # Errors
    /// For the first such value.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let (f, d, s, t) = (&self.features, &self.depth, &self.stereo, &self.tracking);
        let checks: [(&'static str, String, bool, &'static str); 33] = [
            ("features.count", f.count.to_string(), f.count > 0, "at least 1"),
            ("features.levels", f.levels.to_string(), (1..=16).contains(&f.levels), "from 1 to 16"),
            (
                "features.scale_factor",
                f.scale_factor.to_string(),
                f.scale_factor > 1.0 && f.scale_factor <= 2.0,
                "above 1, at most 2",
            ),
            ("features.cell_px", f.cell_px.to_string(), f.cell_px > 0, "at least 1 px"),
            (
                "depth.corner_sigma_px",
                d.corner_sigma_px.to_string(),
                positive(d.corner_sigma_px),
                "a positive length in px",
            ),
            ("depth.noise_per_m", d.noise_per_m.to_string(), positive(d.noise_per_m), "positive, in 1/m"),
            (
                "depth.close_limit_baselines",
                d.close_limit_baselines.to_string(),
                positive(d.close_limit_baselines),
                "a positive number of baselines",
            ),
            ("depth.max_m", d.max_m.to_string(), positive(d.max_m), "a positive length in m"),
            (
                "stereo.right_features",
                s.right_features.to_string(),
                (1.0..=10.0).contains(&s.right_features),
                "from 1 to 10",
            ),
            (
                "stereo.min_depth_baselines",
                s.min_depth_baselines.to_string(),
                positive(s.min_depth_baselines),
                "a positive number of baselines",
            ),
            (
                "stereo.min_disparity_px",
                s.min_disparity_px.to_string(),
                positive(s.min_disparity_px.into()),
                "a positive length in px",
            ),
            (
                "stereo.disparity_sigma_px",
                s.disparity_sigma_px.to_string(),
                positive(s.disparity_sigma_px),
                "a positive length in px",
            ),
            ("stereo.window_px", s.window_px.to_string(), (1..=15).contains(&s.window_px), "from 1 to 15 px"),
            ("stereo.slide_px", s.slide_px.to_string(), (1..=30).contains(&s.slide_px), "from 1 to 30 px"),
            (
                "dynamic.detect_every",
                self.dynamic.detect_every.to_string(),
                self.dynamic.detect_every > 0,
                "at least 1 frame",
            ),
            (
                "dynamic.upright_roll_deg",
                self.dynamic.upright_roll_deg.to_string(),
                (0.0..=180.0).contains(&self.dynamic.upright_roll_deg),
                "from 0 to 180 degrees",
            ),
            (
                "dynamic.open_score",
                self.dynamic.open_score.to_string(),
                share(self.dynamic.open_score.into()),
                "from 0 to 1",
            ),
            (
                "dynamic.keep_score",
                self.dynamic.keep_score.to_string(),
                share(self.dynamic.keep_score.into()),
                "from 0 to 1",
            ),
            (
                "dynamic.group_half_width_m",
                self.dynamic.group_half_width_m.to_string(),
                positive(self.dynamic.group_half_width_m.into()),
                "a positive length in m",
            ),
            (
                "dynamic.full.max_jump_m",
                self.dynamic.full.max_jump_m.to_string(),
                positive(self.dynamic.full.max_jump_m.into()),
                "a positive length in m",
            ),
            (
                "dynamic.full.whole_share",
                self.dynamic.full.whole_share.to_string(),
                share(self.dynamic.full.whole_share.into()),
                "from 0 to 1",
            ),
            (
                "dynamic.full.doubted_trust",
                self.dynamic.full.doubted_trust.to_string(),
                share(self.dynamic.full.doubted_trust.into()) && self.dynamic.full.doubted_trust < 1.0,
                "from 0 to less than 1",
            ),
            (
                "dynamic.full.same_box_iou",
                self.dynamic.full.same_box_iou.to_string(),
                share(self.dynamic.full.same_box_iou.into()),
                "from 0 to 1",
            ),
            (
                "dynamic.full.through_m",
                self.dynamic.full.through_m.to_string(),
                positive(self.dynamic.full.through_m.into()),
                "a positive length in m",
            ),
            (
                "dynamic.full.through_share",
                self.dynamic.full.through_share.to_string(),
                share(self.dynamic.full.through_share.into()),
                "from 0 to 1",
            ),
            (
                "dynamic.full.hidden_share",
                self.dynamic.full.hidden_share.to_string(),
                share(self.dynamic.full.hidden_share.into()),
                "from 0 to 1",
            ),
            (
                "dynamic.max_extra_features",
                self.dynamic.max_extra_features.to_string(),
                self.dynamic.max_extra_features.is_finite() && self.dynamic.max_extra_features >= 1.0,
                "at least 1",
            ),
            (
                "tracking.motion_radius_px",
                t.motion_radius_px.to_string(),
                positive(t.motion_radius_px.into()),
                "a positive length in px",
            ),
            (
                "tracking.local_radius_px",
                t.local_radius_px.to_string(),
                positive(t.local_radius_px.into()),
                "a positive length in px",
            ),
            ("tracking.max_gap_s", t.max_gap_s.to_string(), positive(t.max_gap_s), "a positive time in s"),
            (
                "monocular.start_features",
                self.monocular.start_features.to_string(),
                self.monocular.start_features.is_finite() && self.monocular.start_features >= 1.0,
                "at least 1",
            ),
            (
                "monocular.start_radius_px",
                self.monocular.start_radius_px.to_string(),
                positive(self.monocular.start_radius_px.into()),
                "a positive length in px",
            ),
            ("pose.rounds", self.pose.rounds.to_string(), self.pose.rounds > 0, "at least 1"),
        ];
        match checks.into_iter().find(|(.., holds, _)| !holds) {
            Some((key, value, _, must)) => Err(ConfigError { key, value, must }),
            None => self.dense.validate(),
        }
    }
}
