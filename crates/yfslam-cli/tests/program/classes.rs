//! Classes in dense maps: detected objects have their class, and nothing else has.

use std::collections::BTreeSet;
use std::fs;
use std::sync::{Arc, Mutex};

use crate::common::succeeds;
use nalgebra::{Isometry3, Point3};
use yfslam::dense::{DenseConfig, DenseMap, Up, Volume, Voxel, classes, voxel_at};
use yfslam::{Detection, Detector, DetectorError, RgbImage, Slam};
use yfslam_bench::dense::ghost_metrics::{index_of, t_map_world};
use yfslam_synth::{CLASS_NAMES, World, parse};

/// Class of the static box, as an index into [`CLASS_NAMES`].
const BOX: usize = 3;

/// Detects the exact objects of the frame that is tracked.
struct Oracle {
    names: Vec<String>,
    boxes: Arc<Mutex<Vec<Detection>>>,
}

impl Detector for Oracle {
    fn class_names(&self) -> &[String] {
        &self.names
    }

    fn detect(&mut self, _image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        out.clone_from(&self.boxes.lock().unwrap());
        Ok(())
    }
}

/// Returns the dense map of a world with exact detections; in every second frame after the first without those of the static box, if
/// `misses` is set.
fn map_of(world: &World, misses: bool) -> DenseMap {
    let boxes = Arc::new(Mutex::new(Vec::new()));
    let oracle = Oracle { names: CLASS_NAMES.map(str::to_owned).to_vec(), boxes: boxes.clone() };
    let builder = Slam::builder(world.config().camera.clone()).detector(oracle);
    let mut slam = builder.dense(DenseConfig::default()).build().unwrap();
    for index in 0..world.len() {
        let shot = world.frame(index);
        let exact = |&(_, class, bbox): &(u8, usize, _)| Detection { class, score: 0.9, bbox };
        let is_detected = |&&(_, class, _): &&(u8, usize, _)| class != BOX || !misses || index % 2 == 0;
        *boxes.lock().unwrap() = shot.boxes.iter().filter(is_detected).map(exact).collect();
        slam.track(&shot.frame).unwrap();
    }
    slam.dense().unwrap().snapshot()
}

/// Returns the voxels with the exact surface of the box that the patches observe.
fn true_voxels(map: &DenseMap, volume: &Volume, world: &World) -> BTreeSet<Voxel> {
    let camera = &world.config().camera;
    let turn = volume.pose(0).unwrap() * map.patches[0].t_world_cam.inverse() * t_map_world(map, world);
    let mut voxels = BTreeSet::new();
    for one in &map.patches {
        let shot = world.frame(index_of(world, one.timestamp_ns));
        let pose: Isometry3<f32> = (turn * shot.t_world_cam).cast();
        let Some((instance, ..)) = shot.boxes.iter().find(|(_, class, _)| *class == BOX) else { continue };
        for (v, u) in (0..camera.height).flat_map(|v| (0..camera.width).map(move |u| (v, u))) {
            let z = *shot.exact_depth.get(u, v).unwrap();
            if shot.instances.get(u, v) == Some(instance) && z > 0.0 && z <= volume.config().max_range_m {
                let [x, y] = camera.undistort(u as f64, v as f64).map(|x| x as f32);
                voxels.insert(voxel_at(&(pose * Point3::new(x * z, y * z, z)), 1.0 / volume.config().resolution_m));
            }
        }
    }
    voxels
}

/// Returns the number of voxels of the box, of those with its class, of other voxels with its class, and of those with another class.
fn count_named(map: &DenseMap, world: &World) -> [usize; 4] {
    let volume = map.volume(&DenseConfig::default(), &map.turn(Up::Level), |_| {}).unwrap();
    let (truth, found) = (true_voxels(map, &volume, world), classes(map, &volume, |_| {}));
    let near = |[x, y, z]: Voxel| (0..27).any(|i| truth.contains(&[x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]));
    let mut counts = [0; 4];
    for voxel in volume.voxels().filter(|known| known.occupied).map(|known| known.voxel) {
        let (class, occupied) = (usize::from(found.get(voxel)), truth.contains(&voxel));
        let is_named = class == BOX + 1;
        let is = [occupied, occupied && is_named, !near(voxel) && is_named, class != 0 && !is_named];
        counts.iter_mut().zip(is).for_each(|(count, is)| *count += usize::from(is));
    }
    counts
}

#[test]
fn a_box_among_walking_people_has_its_class_also_if_it_is_not_detected_in_half_of_the_frames() {
    let config = parse("synth:walking_xyz?moved=on&width=320&height=240&frames=150&seed=4").unwrap();
    let world = World::new(&config).unwrap();
    let map = map_of(&world, false);
    assert_eq!(map.class_names, CLASS_NAMES);
    let [occupied, named, beyond, others] = count_named(&map, &world);
    println!("{named} of {occupied} voxels named, {beyond} beyond, {others} with another name");
    assert!(occupied > 100 && named * 100 >= occupied * 95 && beyond * 20 <= occupied && others == 0);

    products_have_classes(&map);

    let map = map_of(&world, true);
    let [occupied, named, beyond, others] = count_named(&map, &world);
    println!(
        "missed in half of the views: {named} of {occupied} voxels named, {beyond} beyond, {others} with another name"
    );
    assert!(named * 4 >= occupied * 3 && beyond * 20 <= occupied && others == 0);
}

/// `yfslam map` writes classes to all products that can hold them, and prints their counts.
fn products_have_classes(map: &DenseMap) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dense.map"), map.to_bytes().unwrap()).unwrap();
    let printed = succeeds(folder.path(), &["map", "dense.map", "--cloud", "--octomap", "--out", "out"]).stdout;
    assert!(printed.contains("classes, in voxels: box 1"), "{printed}");
    let read = |name: &str| fs::read(folder.path().join("out").join(name)).unwrap();
    let head = |name: &str| String::from_utf8_lossy(&read(name)[..500]).into_owned();
    assert!(
        head("cloud.ply").contains("comment class 4 box\n") && head("cloud.ply").contains("property uchar class\n")
    );
    assert!(head("cloud.pcd").contains("FIELDS x y z rgb label\n"));
    assert!(head("semantic.ot").contains("id ColorOcTree\n"));
    assert!(read("classes.png").len() > 1000);
    let legend: serde_json::Value = serde_json::from_slice(&read("classes.json")).unwrap();
    let entry = &legend["classes"][0];
    assert_eq!((entry["class"].as_u64(), entry["name"].as_str()), (Some(4), Some("box")));
    let named = entry["voxels"].as_u64().unwrap();
    assert!(printed.contains(&format!("box {named}; {} unknown", legend["unknown"])), "{printed}\n{legend}");
}
