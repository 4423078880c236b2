//! Point clouds as binary PCD 0.7, the format of the Point Cloud Library.

use std::io;
use std::path::Path;

use super::{Coordinates, Labels, PlyPoint};
use crate::atomic_file::write_atomically;
use crate::error::Result;

/// Writes `points`, which are in the map frame, as PCD with fields x, y, z (m) and rgb (packed as PCL packs it), and label (the class) with labels.
///
/// # Errors
/// The file cannot be written, or a position is not finite.
pub fn write_pcd<I>(path: &Path, points: I, labels: Option<Labels>) -> Result<()>
where
    I: IntoIterator<Item = PlyPoint, IntoIter: ExactSizeIterator>,
{
    let points = points.into_iter();
    write_atomically(path, |writer| {
        let count = points.len();
        let [fields, sizes, types, counts] = match labels {
            None => ["x y z rgb", "4 4 4 4", "F F F F", "1 1 1 1"],
            Some(_) => ["x y z rgb label", "4 4 4 4 4", "F F F F U", "1 1 1 1 1"],
        };
        write!(
            writer,
            "# .PCD v0.7 - Point Cloud Data file format\n# {}\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\n\
             WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n",
            Coordinates::Map
        )?;
        for (number, PlyPoint { position_m, color: [r, g, b] }) in points.enumerate() {
            if !position_m.iter().all(|v| v.is_finite()) {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("point {position_m:?} is not finite")));
            }
            position_m.iter().try_for_each(|v| writer.write_all(&v.to_le_bytes()))?;
            writer.write_all(&[b, g, r, 0])?;
            if let Some(labels) = labels {
                let class = labels.classes.get(number).copied().unwrap_or_default();
                writer.write_all(&u32::from(class).to_le_bytes())?;
            }
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
        let path = folder.path().join("cloud.pcd");
        let points = [
            PlyPoint { position_m: [1.0, -2.5, 0.125], color: [1, 2, 3] },
            PlyPoint { position_m: [0.0, 0.0, 4.0], color: [255, 0, 7] },
        ];
        write_pcd(&path, points, None).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = b"DATA binary\n";
        let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let text = std::str::from_utf8(&bytes[..header]).unwrap();
        assert!(text.contains("WIDTH 2\n") && text.contains("POINTS 2\n"), "{text}");
        assert_eq!(bytes.len() - header, 2 * 16);
        let rgb = u32::from_le_bytes(bytes[header + 28..].try_into().unwrap());
        assert_eq!(rgb, 0x00ff_0007);
    }

    #[test]
    fn a_class_is_a_label_of_four_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud.pcd");
        let point = PlyPoint { position_m: [0.0; 3], color: [1, 2, 3] };
        write_pcd(&path, [point; 2], Some(Labels { classes: &[0, 57], names: &[] })).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("FIELDS x y z rgb label\nSIZE 4 4 4 4 4\nTYPE F F F F U\n"), "{text}");
        assert_eq!(bytes[bytes.len() - 8..], [3, 2, 1, 0, 57, 0, 0, 0]);
        assert_eq!(bytes[bytes.len() - 28..bytes.len() - 20], [3, 2, 1, 0, 0, 0, 0, 0]);
    }
}
