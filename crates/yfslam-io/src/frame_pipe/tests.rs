use proptest::prelude::*;

use super::*;

const CAMERA: &str = "width = 4\nheight = 2\nfx = 4.0\nfy = 4.0\ncx = 2.0\ncy = 1.0\ndepth_factor = 1000.0\n";

fn header(camera: &str) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend((camera.len() as u32).to_le_bytes());
    bytes.extend(camera.as_bytes());
    bytes
}

fn image(role: u8, encoding: u8, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = vec![role, encoding, 0, 0];
    bytes.extend((pixels.len() as u32).to_le_bytes());
    bytes.extend(pixels);
    bytes
}

fn frame(stamp_ns: i64, images: &[Vec<u8>]) -> Vec<u8> {
    let content = [stamp_ns.to_le_bytes().to_vec(), images.concat()].concat();
    [(content.len() as u32).to_le_bytes().to_vec(), content].concat()
}

fn rgbd(stamp_ns: i64) -> Vec<u8> {
    let depth: Vec<u8> = [1000_u16, 0, 65535, 1, 2, 3, 4, 5].iter().flat_map(|value| value.to_le_bytes()).collect();
    frame(stamp_ns, &[image(1, 2, &[1, 2, 3].repeat(8)), image(2, 4, &depth)])
}

fn read(bytes: &[u8]) -> Vec<std::result::Result<Frame, String>> {
    let header = PipeHeader::read(bytes).unwrap();
    let camera = header.camera.clone().unwrap();
    header.frames(&camera).collect()
}

#[test]
fn frames_come_with_their_stamp_and_pixels_and_a_length_of_zero_ends_them() {
    let bytes = [header(CAMERA), rgbd(5), rgbd(-7), vec![0; 4], b"more".to_vec()].concat();
    let frames: Vec<_> = read(&bytes).into_iter().map(|frame| frame.unwrap()).collect();
    assert_eq!(frames.iter().map(|frame| frame.timestamp_ns).collect::<Vec<_>>(), [5, -7]);
    assert_eq!(frames[0].color.data()[0], [3, 2, 1]);
    let depth = frames[0].depth.as_ref().unwrap();
    assert_eq!((depth.raw.data()[0], depth.raw.data()[2], depth.metres_per_unit), (1000, 0, 0.001));
}

#[test]
fn a_wrong_frame_is_reported_and_the_next_one_is_read() {
    let short = frame(1, &[image(1, 1, &[0; 5])]);
    let wrong_role = frame(2, &[image(9, 1, &[0; 24])]);
    let bytes = [header(CAMERA), short, wrong_role, frame(3, &[]), frame(4, &[image(1, 4, &[0; 24])]), rgbd(5)];
    let frames = read(&bytes.concat());
    let words = ["5 elements", "role 9", "no colour image", "encoding 4"];
    for (frame, words) in frames.iter().zip(words) {
        let error = frame.as_ref().unwrap_err();
        assert!(error.contains(words), "{error}");
    }
    assert!(frames[4].is_ok() && frames.len() == 5);
}

#[test]
fn a_stream_that_is_cut_is_reported_once() {
    let whole = [header(CAMERA), rgbd(1), rgbd(2)].concat();
    let frames = read(&whole[..whole.len() - 3]);
    assert!(frames[0].is_ok() && frames.len() == 2);
    assert!(frames[1].as_ref().unwrap_err().contains("ends after"));
    let huge = [header(CAMERA), u32::MAX.to_le_bytes().to_vec()].concat();
    assert!(read(&huge)[0].as_ref().unwrap_err().contains("claims"));
}

#[test]
fn another_format_or_version_is_refused_by_name() {
    let refused = |bytes: &[u8]| PipeHeader::read(bytes).err().unwrap().to_string();
    assert!(refused(b"\x89PNG, which is not ours").contains("YFSFRAME"));
    assert!(refused(b"YFSF").contains("16 bytes"));
    let mut later = header("");
    later[8] = 2;
    assert!(refused(&later).contains("version 2"));
    assert!(PipeHeader::read(&header("")[..]).unwrap().camera.is_none());
}

proptest! {
    #[test]
    fn no_bytes_cause_a_panic(bytes: Vec<u8>) {
        let _ = read(&[header(CAMERA), bytes.clone()].concat());
        let _ = read(&[header(CAMERA), frame(0, &[bytes])].concat());
    }
}
