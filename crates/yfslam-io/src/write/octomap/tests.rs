use std::collections::BTreeSet;

use super::*;

fn cube(side: i32, log_odds: f32) -> Vec<OctreeVoxel> {
    let at = |i: i32| [i % side, i / side % side, i / (side * side)];
    (0..side * side * side).map(|i| OctreeVoxel { voxel: at(i), log_odds, color: [0; 3] }).collect()
}

fn write(path: &Path, resolution_m: f64, voxels: &[OctreeVoxel], format: OctreeFormat) -> Result<OctreeSize> {
    let block = |one: &OctreeVoxel| one.voxel.map(|v| v.div_euclid(SIDE));
    let blocks: BTreeSet<Block> = voxels.iter().map(block).collect();
    let within = |wanted| voxels.iter().filter(move |one| block(one) == wanted).copied();
    write_octomap(path, resolution_m, blocks, within, format)
}

/// Reads the voxels of the finest level from `.ot` data, with colours if there are any; leaves of higher levels are only counted.
fn read(colors: bool, data: &mut &[u8], key: [u32; 3], level: u32, out: &mut Vec<OctreeVoxel>, leaves: &mut usize) {
    let (log_odds, rest) = data.split_first_chunk::<4>().unwrap();
    let (color, rest) = if colors { rest.split_first_chunk::<3>().unwrap() } else { (&[0; 3], rest) };
    let (&children, rest) = rest.split_first().unwrap();
    *data = rest;
    if children == 0 {
        *leaves += 1;
        if level == 0 {
            let voxel = key.map(|k| k as i32 - (1 << 15));
            out.push(OctreeVoxel { voxel, log_odds: f32::from_le_bytes(*log_odds), color: *color });
        }
        return;
    }
    for number in (0..8).filter(|number| children >> number & 1 == 1) {
        let step = |axis: u32| ((number >> axis & 1) as u32) << (level - 1);
        let key = [key[0] | step(0), key[1] | step(1), key[2] | step(2)];
        read(colors, data, key, level - 1, out, leaves);
    }
}

#[test]
fn voxels_are_read_from_the_tree_at_their_places() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ot");
    for (format, id) in [(OctreeFormat::LogOdds, "id OcTree\n"), (OctreeFormat::Colors, "id ColorOcTree\n")] {
        let colors = format == OctreeFormat::Colors;
        let voxel = |i: i32| OctreeVoxel {
            voxel: [i * 7 - 100, -i, 3 * i],
            log_odds: 0.1 * i as f32 - 1.0,
            color: if colors { [i as u8, 200, 7] } else { [0; 3] },
        };
        let mut voxels: Vec<OctreeVoxel> = (0..50).map(voxel).collect();
        let size = write(&path, 0.05, &voxels, format).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = b"data\n";
        let start = bytes.windows(5).position(|w| w == end).unwrap() + 5;
        assert!(String::from_utf8_lossy(&bytes[..start]).contains(id));
        let (mut back, mut leaves) = (Vec::new(), 0);
        let mut data = &bytes[start..];
        read(colors, &mut data, [0; 3], DEPTH, &mut back, &mut leaves);
        assert!(data.is_empty());
        assert_eq!((back.len(), leaves), (50, size.leaves));
        let key = |v: &OctreeVoxel| v.voxel;
        back.sort_by_key(key);
        voxels.sort_by_key(key);
        assert_eq!(back, voxels);
    }
}

#[test]
fn eight_equal_leaves_become_one_only_if_their_colours_are_equal_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ot");
    let mut voxels = cube(2, 2.0);
    let leaves = |voxels: &[OctreeVoxel], format| write(&path, 0.1, voxels, format).unwrap().leaves;
    assert_eq!(leaves(&voxels, OctreeFormat::Colors), 1);
    voxels[3].color = [255, 0, 0];
    assert_eq!((leaves(&voxels, OctreeFormat::Colors), leaves(&voxels, OctreeFormat::LogOdds)), (8, 1));
}

#[test]
fn eight_equal_leaves_become_one_and_a_binary_tree_has_two_bytes_for_each_inner_node() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.bt");
    // A cube of four voxels becomes one leaf two levels up: below the root is a chain of 13 inner nodes.
    let size = write(&path, 0.1, &cube(4, 2.0), OctreeFormat::Binary).unwrap();
    assert_eq!(size, OctreeSize { nodes: 15, leaves: 1 });
    let text = std::fs::read(&path).unwrap();
    let header = b"# Octomap OcTree binary file\n# frame map: z up, x to the front of the first image, y to its left (REP 103), m\nid OcTree\nsize 15\nres 0.1\ndata\n";
    assert_eq!(&text[..header.len()], header);
    assert_eq!(text.len() - header.len(), 2 * 14);
}

#[test]
fn equal_blocks_become_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.bt");
    // Eight blocks become one leaf four levels up: below the root is a chain of 11 inner nodes.
    assert_eq!(write(&path, 0.1, &cube(16, 2.0), OctreeFormat::Binary).unwrap(), OctreeSize { nodes: 13, leaves: 1 });
    let mut voxels = cube(16, 2.0);
    voxels[0].log_odds = -1.0;
    let size = write(&path, 0.1, &voxels, OctreeFormat::Binary).unwrap();
    // From the former leaf down to one voxel: eight leaves at the last level and seven at each level above.
    assert_eq!(size.leaves, 3 * 7 + 8);
    let header = format!(
        "# Octomap OcTree binary file\n# frame map: z up, x to the front of the first image, y to its left (REP 103), m\nid OcTree\nsize {}\nres 0.1\ndata\n",
        size.nodes
    );
    assert_eq!(std::fs::read(&path).unwrap().len(), header.len() + 2 * (size.nodes - size.leaves));
}

#[test]
fn a_voxel_beyond_the_keys_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ot");
    let far = [OctreeVoxel { voxel: [0, 40_000, 0], log_odds: 1.0, color: [0; 3] }];
    let error = write(&path, 0.05, &far, OctreeFormat::LogOdds).unwrap_err().to_string();
    assert!(error.contains("map.ot") && error.contains("40000"), "{error}");
    assert!(!path.exists());
}
