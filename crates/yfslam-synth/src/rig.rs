//! Meshes that are carried by bones, so that any vertex of anything that moves can be placed for any time.
//!
//! In: meshes in the coordinates of their bones, then the poses of all bones and the light. Out: vertices in world coordinates.

use nalgebra::{Isometry3, Point3};

use crate::light::Lights;
use crate::mesh::{Mesh, Vec3, Vertex};

/// A mesh whose vertices are in the coordinates of bones. The light of a vertex is the share of light that its own body leaves.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    mesh: Mesh,
    /// Bone per vertex.
    bones: Vec<u16>,
}

impl Rig {
    /// Adds a mesh; `bone` gives the bone of each of its vertices.
    pub fn attach(&mut self, mesh: &Mesh, bone: impl Fn(usize) -> usize) {
        self.mesh.append(mesh, |_, vertex| *vertex);
        self.bones.extend((0..mesh.vertices.len()).map(|vertex| bone(vertex) as u16));
    }

    /// Returns the mesh in the coordinates of its bones.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the place of vertex number `index`, m.
    #[inline]
    pub fn position(&self, bones: &[Isometry3<f32>], index: u32) -> Vec3 {
        let index = index as usize;
        (bones[usize::from(self.bones[index])] * Point3::from(self.mesh.vertices[index].position)).coords
    }

    /// Returns vertex number `index`, lit by `lights`.
    #[inline]
    pub fn vertex(&self, bones: &[Isometry3<f32>], lights: &Lights, index: u32) -> Vertex {
        let vertex = &self.mesh.vertices[index as usize];
        let position = self.position(bones, index);
        let normal = bones[usize::from(self.bones[index as usize])].rotation * vertex.normal;
        let light = lights.on_vertex(&position, &normal);
        Vertex { position, normal, light: light.map(|l| l * vertex.light[0]), ..*vertex }
    }

    /// Returns the mesh in world coordinates, lit by `lights`.
    pub fn posed(&self, bones: &[Isometry3<f32>], lights: &Lights) -> Mesh {
        let vertices = (0..self.bones.len() as u32).map(|index| self.vertex(bones, lights, index)).collect();
        Mesh { vertices, triangles: self.mesh.triangles.clone(), patches: self.mesh.patches.clone() }
    }
}
