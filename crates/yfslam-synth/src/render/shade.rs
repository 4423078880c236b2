//! Computes the colour of a surface where a ray meets it: filtered texture times light.
//!
//! In: a projected triangle and a ray. Out: linear RGB. Attributes are interpolated with perspective: attribute/z is linear over
//! the image (Olano and Greer 1997, section 3.2), and so the size of a pixel on the texture, which selects the mip level (Williams,
//! "Pyramidal parametrics", SIGGRAPH 1983), follows in closed form.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::project::Projected;
use crate::bake::LightMap;
use crate::light::{Lights, Occluder};
use crate::mesh::{Lighting, Mesh, Vec3, Vertex};
use crate::rig::Rig;
use crate::surfaces::Surfaces;
use crate::texture::Texture;

/// The input of shading.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Meshes by [`Projected::mesh`]: the static one and that of the actors.
    pub meshes: [&'a Mesh; 2],
    /// The bones and the light of the actors, if their mesh is in the coordinates of bones.
    pub carried: Option<Carried<'a>>,
    /// Textures and light maps.
    pub surfaces: &'a Surfaces,
    /// Brightness of flickering lamps.
    pub brightness: f32,
    /// Bodies that darken their surroundings; positions in camera coordinates.
    pub occluders: &'a [Occluder],
    /// Pose of the world in the camera.
    pub t_cam_world: Isometry3<f64>,
    /// Its rotation.
    pub r_cam_world: UnitQuaternion<f32>,
    /// Size of a pixel in normalised coordinates.
    pub pitch: [f32; 2],
}

/// What places the mesh of the actors at the time of a view.
#[derive(Clone, Copy)]
pub struct Carried<'a> {
    /// The mesh with the bones of its vertices.
    pub rig: &'a Rig,
    /// Poses of the bones.
    pub bones: &'a [Isometry3<f32>],
    /// Light at that time.
    pub lights: &'a Lights,
}

type Plane = [f32; 3];

/// Reflectance of the glass of a screen, whatever it displays.
const GLASS: f32 = 0.04;

/// The surface that a ray meets.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaded {
    /// Linear RGB.
    pub color: [f32; 3],
    /// Share of the infrared light of the projector that the surface reflects: that of its material as a whole, since most inks and
    /// dyes transmit infrared light.
    pub reflectance: f32,
}

/// A triangle ready to be shaded: its attributes as planes over the image.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    texture: &'a Texture,
    light_map: Option<&'a LightMap>,
    inverse_depth: Plane,
    u: Plane,
    v: Plane,
    light: [Plane; 3],
    reflectance: f32,
    normal: Vec3,
}

fn at(plane: &Plane, x: f32, y: f32) -> f32 {
    plane[0] * x + plane[1] * y + plane[2]
}

impl<'a> View<'a> {
    /// Returns vertex `index` of the mesh numbered `mesh` in camera coordinates, m.
    pub fn in_camera(&self, mesh: u8, index: u32) -> Vector3<f64> {
        let position = match &self.carried {
            Some(carried) if mesh == 1 => carried.rig.position(carried.bones, index),
            _ => self.meshes[usize::from(mesh)].vertices[index as usize].position,
        };
        (self.t_cam_world * Point3::from(position.cast::<f64>())).coords
    }

    /// Returns vertex `index` of the mesh numbered `mesh` in world coordinates.
    fn vertex(&self, mesh: u8, index: u32) -> Vertex {
        match &self.carried {
            Some(carried) if mesh == 1 => carried.rig.vertex(carried.bones, carried.lights, index),
            _ => self.meshes[usize::from(mesh)].vertices[index as usize],
        }
    }

    /// Returns the instance (0 static, k actor) of a projected triangle.
    pub fn instance(&self, t: &Projected) -> u8 {
        let mesh = self.meshes[usize::from(t.mesh)];
        mesh.patches[mesh.triangles[t.triangle as usize].patch as usize].instance
    }

    /// Computes the textures and light maps of the visible surfaces.
    pub fn prepare<'t>(&self, visible: impl Iterator<Item = &'t Projected>) {
        let patches = visible.map(|t| {
            let mesh = self.meshes[usize::from(t.mesh)];
            (mesh, mesh.triangles[t.triangle as usize].patch)
        });
        self.surfaces.prepare(self.meshes[0], patches);
    }

    /// Returns a number that distinguishes the patches of all meshes.
    pub fn patch(&self, t: &Projected) -> u32 {
        (self.meshes[usize::from(t.mesh)].triangles[t.triangle as usize].patch << 1) | u32::from(t.mesh)
    }

    /// Collects the values that the pixels of the triangle share.
    pub fn surface(&self, t: &Projected) -> Surface<'a> {
        let mesh = self.meshes[usize::from(t.mesh)];
        let triangle = mesh.triangles[t.triangle as usize];
        let patch = mesh.patches[triangle.patch as usize];
        let v = triangle.vertices.map(|i| self.vertex(t.mesh, i));
        let scaled = t.edges.map(|e| e.map(|c| c * t.edge_scale));
        let plane = |a: [f32; 3]| -> Plane {
            std::array::from_fn(|k| a[0] * scaled[0][k] + a[1] * scaled[1][k] + a[2] * scaled[2][k])
        };
        let constant = |value: f32| t.inverse_depth.map(|c| c * value);
        let (light_map, light) = match patch.lighting {
            Lighting::Baked => (Some(self.surfaces.light_map(self.meshes[0], triangle.patch)), [[0.0; 3]; 3]),
            Lighting::Vertex => (None, std::array::from_fn(|k| plane(v.map(|v| v.light[k])))),
            Lighting::Emissive(factor) => (None, [constant(factor); 3]),
            Lighting::Lamp(factor) => (None, [constant(factor * self.brightness); 3]),
        };
        Surface {
            texture: self.surfaces.texture(patch.texture),
            light_map,
            inverse_depth: t.inverse_depth,
            u: plane(v.map(|v| v.uv[0])),
            v: plane(v.map(|v| v.uv[1])),
            light,
            reflectance: match patch.lighting {
                Lighting::Emissive(_) => GLASS,
                _ => self.surfaces.texture(patch.texture).mean(),
            },
            normal: self.r_cam_world * (v[0].normal + v[1].normal + v[2].normal).normalize(),
        }
    }

    /// Shades the surface where the ray (x, y, 1) meets it; the occluders `near` darken it.
    pub fn shade(&self, surface: &Surface, near: &[Occluder], x: f32, y: f32) -> Shaded {
        let z = 1.0 / at(&surface.inverse_depth, x, y);
        let (u, v) = (at(&surface.u, x, y) * z, at(&surface.v, x, y) * z);
        let [w, h] = surface.texture.size();
        // Derivatives of (u, v) in texels along the image axes, per pixel.
        let slope = |axis: usize| {
            let du = (surface.u[axis] - u * surface.inverse_depth[axis]) * z * self.pitch[axis] * w;
            let dv = (surface.v[axis] - v * surface.inverse_depth[axis]) * z * self.pitch[axis] * h;
            [du, dv]
        };
        let (along_x, along_y) = (slope(0), slope(1));
        let squared = |d: [f32; 2]| d[0] * d[0] + d[1] * d[1];
        let (sx, sy) = (squared(along_x), squared(along_y));
        let (major, long, short) = if sx > sy { (along_x, sx, sy) } else { (along_y, sy, sx) };
        // Surfaces at a grazing angle get two samples along the longer axis, each with half its length.
        let color = if long > 2.0 * short && long > 2.0 {
            let lod = 0.5 * log2(long) - 1.0;
            let (ou, ov) = (0.25 * major[0] / w, 0.25 * major[1] / h);
            let a = surface.texture.sample(u + ou, v + ov, lod);
            let b = surface.texture.sample(u - ou, v - ov, lod);
            std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
        } else {
            surface.texture.sample(u, v, 0.5 * log2(long))
        };
        let light = match surface.light_map {
            Some(map) => {
                let [r, g, b, flickering] = map.sample(u, v);
                let gain = 1.0 + flickering * (self.brightness - 1.0);
                [r * gain, g * gain, b * gain, 0.0]
            }
            None => {
                let [r, g, b] = surface.light.map(|plane| at(&plane, x, y) * z);
                [r, g, b, 0.0]
            }
        };
        let shadow: f32 = if surface.light_map.is_some() {
            let point = Vec3::new(x * z, y * z, z);
            near.iter().map(|o| o.visibility(&point, &surface.normal)).product()
        } else {
            1.0
        };
        let albedo: [f32; 3] = std::array::from_fn(|k| color[k] * color[k]);
        Shaded { color: std::array::from_fn(|k| albedo[k] * light[k] * shadow), reflectance: surface.reflectance }
    }
}

/// Returns the base-two logarithm, with an error of at most 0.01, from the bits of the float.
fn log2(x: f32) -> f32 {
    let bits = x.max(1e-12).to_bits();
    let exponent = (bits >> 23) as f32 - 127.0;
    let mantissa = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000) - 1.0;
    exponent + mantissa * (1.346 - 0.346 * mantissa)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_logarithm_is_within_a_hundredth() {
        for i in 1..2000 {
            let x = i as f32 * 0.05;
            assert!((log2(x) - x.log2()).abs() < 0.01, "{x}");
        }
    }
}
