//! Textures and light maps, made when a surface is first seen.
//!
//! In: what was ordered. Out: the texture and the light map of a surface. Most of a place is out of sight of any one
//! sequence; what is made depends on the order alone, not on when it is made.

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

/// Something to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Job {
    Paint(u32),
    Bake(u32),
}

impl Surfaces {
    /// Surfaces with `sharpness` times the texels per metre that were ordered, lit by `baker`.
    pub fn new(palette: Palette, sharpness: f32, mesh: &Mesh, baker: Baker) -> Self {
        let textures = (0..palette.len()).map(|_| OnceLock::new()).collect();
        let light_maps = mesh.patches.iter().map(|_| OnceLock::new()).collect();
        Self { palette, sharpness, baker, textures, light_maps }
    }

    /// The texture number `index`.
    pub fn texture(&self, index: u32) -> &Texture {
        self.textures[index as usize].get_or_init(|| self.palette.paint(index as usize, self.sharpness))
    }

    /// The light map of patch number `patch` of the static mesh.
    pub fn light_map(&self, mesh: &Mesh, patch: u32) -> &LightMap {
        self.light_maps[patch as usize].get_or_init(|| self.baker.bake(mesh, patch as usize))
    }

    /// Makes what the patches need and is not there yet, on all threads; `mesh` is the static one, by which alone
    /// patches with light maps count.
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
        // No job starts another, so that no thread ever waits for itself.
        let jobs: Vec<Job> = jobs.into_iter().collect();
        jobs.par_iter().with_max_len(1).for_each(|job| match *job {
            Job::Paint(texture) => drop(self.texture(texture)),
            Job::Bake(patch) => drop(self.light_map(mesh, patch)),
        });
    }
}
