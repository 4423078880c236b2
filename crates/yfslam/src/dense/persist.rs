//! Pieces as bytes: what `yfslam run --dense` leaves behind.
//!
//! In: a survey. Out: bytes, and back. Depth and colour are kept as differences from the cell to the left, which pack better.

use serde::{Deserialize, Serialize};

use crate::dense::piece::{CellGrid, Piece};
use crate::dense::{Survey, SurveyPiece};
use crate::map::persist::{CameraRecord, pose_of, pose_record};
use crate::packed::{Kind, PackedError};

/// What the bytes of every survey begin with.
const KIND: Kind = Kind { magic: "yfslam dense map", version: 1 };

#[derive(Serialize, Deserialize)]
struct Records {
    camera: CameraRecord,
    stride_px: u32,
    pieces: Vec<PieceRecord>,
}

#[derive(Serialize, Deserialize)]
struct PieceRecord {
    timestamp_ns: i64,
    /// `t_world_cam`: x y z, quaternion x y z w.
    pose: [f64; 7],
    depth: Vec<i16>,
    color: Vec<u8>,
}

/// The survey as bytes.
///
/// # Errors
/// If it cannot be written, which would be a fault of this program.
pub fn encode(survey: &Survey) -> Result<Vec<u8>, PackedError> {
    KIND.pack(&Records {
        camera: CameraRecord::of(survey.grid.camera()),
        stride_px: survey.grid.stride_px() as u32,
        pieces: survey.pieces.iter().map(PieceRecord::of).collect(),
    })
}

/// The survey in `bytes`, checked.
///
/// # Errors
/// If the bytes are no survey, of another version, cut, altered, or contradict themselves.
pub fn decode(bytes: &[u8]) -> Result<Survey, PackedError> {
    let Records { camera, stride_px, pieces } = KIND.unpack(bytes)?;
    let camera = camera.into_camera();
    let wrong = |what: String| Err(PackedError::Records(what));
    if stride_px == 0 || stride_px as usize > camera.width.min(camera.height) {
        return wrong(format!("cells of {stride_px} px in a picture of {} × {}", camera.width, camera.height));
    }
    // A grid is made from these: they must be worth the memory.
    if camera.width.saturating_mul(camera.height) > 1 << 28 {
        return wrong(format!("a camera of {} × {} px", camera.width, camera.height));
    }
    let grid = CellGrid::new(&camera, stride_px as usize);
    let pieces = pieces.into_iter().enumerate().map(|(number, record)| record.into_piece(number, &grid));
    Ok(Survey { pieces: pieces.collect::<Result<_, _>>()?, grid })
}

impl PieceRecord {
    fn of(one: &SurveyPiece) -> Self {
        let Piece { depth, color } = &one.piece;
        let (mut last_depth, mut last_color) = (0u16, [0u8; 3]);
        Self {
            timestamp_ns: one.timestamp_ns,
            pose: pose_record(&one.t_world_cam),
            depth: depth.iter().map(|&d| d.wrapping_sub(std::mem::replace(&mut last_depth, d)) as i16).collect(),
            color: color
                .iter()
                .flat_map(|&rgb| {
                    let last = std::mem::replace(&mut last_color, rgb);
                    [0, 1, 2].map(|channel| rgb[channel].wrapping_sub(last[channel]))
                })
                .collect(),
        }
    }

    fn into_piece(self, number: usize, grid: &CellGrid) -> Result<SurveyPiece, PackedError> {
        let cells = grid.columns() * grid.rows();
        if self.depth.len() != cells || self.color.len() != 3 * cells {
            let (depth, color) = (self.depth.len(), self.color.len());
            return Err(PackedError::Records(format!(
                "piece {number} has {depth} depths and {color} colour values for {cells} cells"
            )));
        }
        let Some(t_world_cam) = pose_of(&self.pose) else {
            return Err(PackedError::Records(format!("the pose of piece {number} is none: {:?}", self.pose)));
        };
        let (mut depth, mut color) = (0u16, [0u8; 3]);
        let depths = self.depth.iter().map(|&step| {
            depth = depth.wrapping_add(step as u16);
            depth
        });
        let depth = depths.collect();
        let colors = self.color.as_chunks::<3>().0.iter().map(|step| {
            color = [0, 1, 2].map(|channel| color[channel].wrapping_add(step[channel]));
            color
        });
        let color = colors.collect();
        Ok(SurveyPiece { timestamp_ns: self.timestamp_ns, t_world_cam, piece: Piece { depth, color } })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::dense::scene;

    fn survey() -> Survey {
        let grid = CellGrid::new(&scene::camera(), 4);
        let piece = |number: i64| SurveyPiece {
            timestamp_ns: number * 1_000_000_007,
            t_world_cam: Isometry3::new(Vector3::new(0.1 * number as f64, 0.0, 0.3), Vector3::y() * 0.2),
            piece: scene::wall(&grid, 2.5, Some(1.0 + 0.1 * number as f32)),
        };
        let mut pieces: Vec<_> = (0..3).map(piece).collect();
        pieces[1].piece.color.iter_mut().enumerate().for_each(|(i, rgb)| *rgb = [i as u8, (i * 7) as u8, 255]);
        pieces[2].piece.depth.iter_mut().for_each(|d| *d |= 1 << 15);
        Survey { pieces, grid }
    }

    #[test]
    fn a_survey_read_back_is_the_one_that_was_written() {
        let survey = survey();
        let read = decode(&encode(&survey).unwrap()).unwrap();
        assert_eq!(read.pieces, survey.pieces);
        assert_eq!(read.grid, survey.grid);
    }

    #[test]
    fn no_cut_and_no_flipped_bit_goes_unnoticed() {
        let bytes = encode(&survey()).unwrap();
        for length in (0..bytes.len()).step_by(97) {
            assert!(decode(&bytes[..length]).is_err(), "cut to {length} bytes");
        }
        for bit in (0..8 * bytes.len()).step_by(101) {
            let mut altered = bytes.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&altered).is_err(), "bit {bit} flipped");
        }
        let error = decode(b"yfslam map").unwrap_err().to_string();
        assert!(error.contains("no yfslam dense map"), "{error}");
    }
}
