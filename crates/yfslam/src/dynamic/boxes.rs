//! Method `boxes`: whatever is inside a box moves.

use crate::config::DynamicConfig;
use crate::detection::Detection;
use crate::dynamic::Region;

/// The boxes that are certain enough, as they are.
pub fn regions<'a>(config: &DynamicConfig, movable: &'a [Detection]) -> impl Iterator<Item = Region> + 'a {
    let min_score = config.open_score;
    movable.iter().filter(move |d| d.score >= min_score).map(|d| Region {
        bbox: d.bbox,
        score: d.score,
        misses: 0,
        depth_m: None,
    })
}
