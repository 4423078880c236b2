//! Textures and light maps, computed when a surface is first visible.
//!
//! In: the ordered textures. Out: the texture and the light map of a surface. Most of a scene is invisible in any one sequence; the
//! result depends on the order alone and not on the time of computation.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use rayon::prelude::*;

use crate::bake::{Baker, LightMap};
use crate::mesh::{Lighting, Mesh};
use crate::scene::builder::Palette;
use crate::texture::Texture;

/// All surfaces of a world.
#[derive(Debug)]
pub struct Surfaces {
    palette: Palette,
    sharpness: f32,
    baker: Baker,
    textures: Vec<OnceLock<Texture>>,
    /// By patch of the static mesh.
    light_maps: Vec<OnceLock<LightMap>>,
}

/// A texture or light map that is to be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Job {
    Paint(u32),
    Bake(u32),
}

impl Surfaces {
    /// Creates surfaces with `sharpness` times the ordered texels per metre, lit by `baker`.
    pub fn new(palette: Palette, sharpness: f32, mesh: &Mesh, baker: Baker) -> Self {
        let textures = (0..palette.len()).map(|_| OnceLock::new()).collect();
        let light_maps = mesh.patches.iter().map(|_| OnceLock::new()).collect();
        Self { palette, sharpness, baker, textures, light_maps }
    }

    /// Returns texture number `index`.
    pub fn texture(&self, index: u32) -> &Texture {
        self.textures[index as usize].get_or_init(|| self.palette.paint(index as usize, self.sharpness))
    }

    /// Returns the light map of patch number `patch` of the static mesh.
    pub fn light_map(&self, mesh: &Mesh, patch: u32) -> &LightMap {
        self.light_maps[patch as usize].get_or_init(|| self.baker.bake(mesh, patch as usize))
    }

    /// Computes the missing textures and light maps of the patches, on all threads; only patches of `mesh`, the static one, have
    /// light maps.
    pub fn prepare<'a>(&self, mesh: &Mesh, patches: impl Iterator<Item = (&'a Mesh, u32)>) {
        let mut jobs = BTreeSet::new();
        for (of, index) in patches {
            let patch = of.patches[index as usize];
            if self.textures[patch.texture as usize].get().is_none() {
                jobs.insert(Job::Paint(patch.texture));
            }
            if patch.lighting == Lighting::Baked && self.light_maps[index as usize].get().is_none() {
                jobs.insert(Job::Bake(index));
            }
        }
        // No job starts another, so that no thread waits for itself.
        let jobs: Vec<Job> = jobs.into_iter().collect();
        jobs.par_iter().with_max_len(1).for_each(|job| match *job {
            Job::Paint(texture) => drop(self.texture(texture)),
            Job::Bake(patch) => drop(self.light_map(mesh, patch)),
        });
    }
}
