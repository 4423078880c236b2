//! Point clouds as binary PCD 0.7, the format of the Point Cloud Library.

use std::io;
use std::path::Path;

use crate::error::Result;
use crate::write::{PlyPoint, write_atomically};

/// Writes `points` as PCD with fields x, y, z (m) and rgb (packed as PCL packs it).
///
/// # Errors
/// The file cannot be written, or a position is not finite.
pub fn write_pcd<I>(path: &Path, points: I) -> Result<()>
where
    I: IntoIterator<Item = PlyPoint, IntoIter: ExactSizeIterator>,
{
    let points = points.into_iter();
    write_atomically(path, |writer| {
        let count = points.len();
        write!(
            writer,
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n\
             WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
        )?;
        for PlyPoint { position_m, color: [r, g, b] } in points {
            if !position_m.iter().all(|v| v.is_finite()) {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("point {position_m:?} is not finite")));
            }
            position_m.iter().try_for_each(|v| writer.write_all(&v.to_le_bytes()))?;
            writer.write_all(&[b, g, r, 0])?;
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
        write_pcd(&path, points).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = b"DATA binary\n";
        let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let text = std::str::from_utf8(&bytes[..header]).unwrap();
        assert!(text.contains("WIDTH 2\n") && text.contains("POINTS 2\n"), "{text}");
        assert_eq!(bytes.len() - header, 2 * 16);
        let rgb = u32::from_le_bytes(bytes[header + 28..].try_into().unwrap());
        assert_eq!(rgb, 0x00ff_0007);
    }
}
