//! The light of a world.

use serde::{Deserialize, Serialize};

/// Light of a world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LightConfig {
    /// Shadow rays per lamp and light-map texel, twice as many for ambient light; 0 means light without shadows.
    pub shadow_rays: usize,
    /// Whether moving people darken the floor and furniture around them.
    pub moving_shadows: bool,
    /// Brightness of the image; 1 suits every scene, 0.2 is dark.
    pub exposure: f32,
    /// How much the brightness of the unsteady lamps changes, slowly all the time and sometimes suddenly: 0 not at all, 1 down to
    /// darkness. In the office all lamps but the window are unsteady, elsewhere half of them.
    pub flicker: f32,
}

impl Default for LightConfig {
    fn default() -> Self {
        Self { shadow_rays: 8, moving_shadows: true, exposure: 1.0, flicker: 0.0 }
    }
}
