//! Point clouds and meshes as binary little-endian PLY (G. Turk, Stanford, 1994), which MeshLab, CloudCompare and Open3D read.

use std::io;
use std::path::Path;

use super::Coordinates;
use crate::atomic_file::write_atomically;
use crate::error::Result;

/// A coloured point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlyPoint {
    /// Position, m.
    pub position_m: [f32; 3],
    /// Red, green, blue.
    pub color: [u8; 3],
}

/// Classes of points.
#[derive(Clone, Copy, Debug)]
pub struct Labels<'a> {
    /// Class of each point, 0 if it is unknown.
    pub classes: &'a [u8],
    /// Names of the classes, starting with class 1.
    pub names: &'a [String],
}

/// Writes `points` as PLY; labels become a property `class`, and their names comments in the header.
///
/// # Errors
/// The file cannot be written, or a position is not finite.
pub fn write_ply<I>(path: &Path, frame: Coordinates, points: I, labels: Option<Labels>) -> Result<()>
where
    I: IntoIterator<Item = PlyPoint, IntoIter: ExactSizeIterator>,
{
    write(path, frame, points.into_iter(), labels, &[])
}

/// Writes a mesh as PLY: coloured vertices, and triangles as indices of three vertices.
///
/// # Errors
/// The file cannot be written, or a position is not finite.
pub fn write_ply_mesh<I>(path: &Path, frame: Coordinates, vertices: I, triangles: &[[u32; 3]]) -> Result<()>
where
    I: IntoIterator<Item = PlyPoint, IntoIter: ExactSizeIterator>,
{
    write(path, frame, vertices.into_iter(), None, triangles)
}

fn write(
    path: &Path,
    frame: Coordinates,
    points: impl ExactSizeIterator<Item = PlyPoint>,
    labels: Option<Labels>,
    triangles: &[[u32; 3]],
) -> Result<()> {
    write_atomically(path, |writer| {
        write!(writer, "ply\nformat binary_little_endian 1.0\ncomment {frame}\n")?;
        for (class, name) in labels.iter().flat_map(|labels| (1..).zip(labels.names)) {
            // Without control characters each name takes one line.
            writeln!(writer, "comment class {class} {}", name.replace(char::is_control, " "))?;
        }
        write!(
            writer,
            "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\n",
            points.len()
        )?;
        if labels.is_some() {
            writer.write_all(b"property uchar class\n")?;
        }
        if !triangles.is_empty() {
            write!(writer, "element face {}\nproperty list uchar int vertex_indices\n", triangles.len())?;
        }
        writer.write_all(b"end_header\n")?;
        for (number, PlyPoint { position_m: [x, y, z], color: [r, g, b] }) in points.enumerate() {
            if !(x.is_finite() && y.is_finite() && z.is_finite()) {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("point ({x}, {y}, {z}) is not finite")));
            }
            let ([x0, x1, x2, x3], [y0, y1, y2, y3], [z0, z1, z2, z3]) =
                (x.to_le_bytes(), y.to_le_bytes(), z.to_le_bytes());
            writer.write_all(&[x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, r, g, b])?;
            if let Some(labels) = labels {
                writer.write_all(&[labels.classes.get(number).copied().unwrap_or_default()])?;
            }
        }
        for corners in triangles {
            writer.write_all(&[3])?;
            corners.iter().try_for_each(|corner| writer.write_all(&corner.to_le_bytes()))?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_packed_behind_a_header_that_counts_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud.ply");
        let points = [
            PlyPoint { position_m: [1.0, -2.5, 0.125], color: [1, 2, 3] },
            PlyPoint { position_m: [0.0, 0.0, 4.0], color: [255, 0, 7] },
        ];
        write_ply(&path, Coordinates::World, points, None).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = b"end_header\n";
        let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        assert!(std::str::from_utf8(&bytes[..header]).unwrap().contains("element vertex 2\n"));
        assert!(
            String::from_utf8_lossy(&bytes).starts_with("ply\nformat binary_little_endian 1.0\ncomment frame world: ")
        );
        assert_eq!(bytes.len() - header, 2 * 15);
        assert_eq!(bytes[header + 4..header + 8], (-2.5f32).to_le_bytes());
        assert_eq!(bytes[header + 12..header + 15], [1, 2, 3]);
        assert_eq!(bytes[bytes.len() - 3..], [255, 0, 7]);
    }

    #[test]
    fn classes_follow_the_colours_and_their_names_stand_in_the_header() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud.ply");
        let points = [1.0, 2.0].map(|x| PlyPoint { position_m: [x, 0.0, 0.0], color: [7, 8, 9] });
        let names = ["chair".to_owned(), "odd\nname".to_owned()];
        write_ply(&path, Coordinates::Map, points, Some(Labels { classes: &[0, 2], names: &names })).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("comment class 1 chair\ncomment class 2 odd name\nelement vertex 2\n"), "{text}");
        assert!(text.contains("property uchar blue\nproperty uchar class\nend_header\n"), "{text}");
        assert_eq!((bytes[bytes.len() - 17], &bytes[bytes.len() - 4..]), (0, [7, 8, 9, 2].as_slice()));
    }

    #[test]
    fn triangles_follow_the_vertices() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        let corner = |x: f32| PlyPoint { position_m: [x, 0.0, 1.0], color: [9; 3] };
        write_ply_mesh(&path, Coordinates::Map, [corner(0.0), corner(1.0), corner(2.0)], &[[0, 2, 1]]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("element face 1\nproperty list uchar int vertex_indices\nend_header\n"), "{text}");
        assert_eq!(bytes[bytes.len() - 13..], [3, 0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0]);
    }

    #[test]
    fn a_point_that_is_not_finite_is_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud.ply");
        let error =
            write_ply(&path, Coordinates::Map, [PlyPoint { position_m: [f32::NAN, 0.0, 0.0], color: [0; 3] }], None)
                .unwrap_err()
                .to_string();
        assert!(error.contains("cloud.ply") && error.contains("not finite"), "{error}");
        assert!(!path.exists());
    }
}
