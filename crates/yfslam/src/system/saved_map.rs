//! A map from an earlier session.

use crate::camera::Camera;
use crate::config::FeatureConfig;
use crate::dense::{DenseMap, MapFrame};
use crate::map::Map;
#[cfg(feature = "persist")]
use crate::map::container::{MAP, Sections};
#[cfg(feature = "persist")]
use crate::map::persist::{MapError, MapParts, decode};

/// A map with what it was made with.
#[derive(Clone, Debug)]
pub struct SavedMap {
    pub(crate) map: Map,
    pub(crate) camera: Camera,
    /// Feature settings: with others nothing would be recognised.
    pub(crate) features: FeatureConfig,
    pub(crate) dense: Option<DenseMap>,
    pub(crate) frame: Option<MapFrame>,
}

impl SavedMap {
    /// Reads a map, and the dense map that was saved with it if there is one, and checks both; with the feature `persist`.
    ///
    /// # Errors
    /// If the bytes are no map, of another version, cut, altered, or contradict themselves.
    #[cfg(feature = "persist")]
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MapError> {
        let MapParts { map, camera, features } = decode(bytes)?;
        let sections = Sections::of(bytes, MAP)?;
        let dense = sections.dense_map.map(|_| DenseMap::from_bytes(bytes)).transpose()?;
        let frame = sections.frame.map(MapFrame::from_section).transpose()?;
        Ok(Self { map, camera, features, dense, frame })
    }

    /// Returns the keyframes and landmarks.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// Returns the dense map that was saved with it.
    pub fn dense(&self) -> Option<&DenseMap> {
        self.dense.as_ref()
    }
}
