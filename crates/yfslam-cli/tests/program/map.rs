//! `yfslam map`: the products can be read by other programs, are the same on every run, and show the world without people.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{fails, succeeds};
use yfslam::Method;
use yfslam::dense::{DenseConfig, DenseMap, PlacedPatch, Up, Volume};
use yfslam_bench::dense::background_metrics;
use yfslam_bench::dense::dense_run::{DenseRun, RunOptions, run_all};
use yfslam_bench::dense::ghost_metrics::{ExactSurfaces, Occupancy, with_exact_poses};
use yfslam_bench::dense::wall_thickness::wall_thickness;
use yfslam_synth::{World, parse};

/// Two people walk through the image.
const WORLD: &str = "synth:walking_xyz?width=320&height=240&frames=60";

/// Returns the text at the beginning of a file.
fn head(path: &Path) -> String {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    String::from_utf8_lossy(&bytes[..bytes.len().min(600)]).into_owned()
}

/// Returns the number behind `key` in a text.
fn number(text: &str, key: &str) -> usize {
    let rest = text.split(key).nth(1).unwrap_or_else(|| panic!("no '{key}' in {text}"));
    rest.trim_start().split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
}

#[test]
fn the_products_of_a_run_agree_with_each_other_and_are_the_same_on_every_run() {
    let folder = tempfile::tempdir().unwrap();
    let make = |out: &str| {
        let saved = format!("{out}.map");
        succeeds(folder.path(), &["run", WORLD, "--dense", "--save-map", &saved, "--out", out, "-q"]);
        let printed = succeeds(folder.path(), &["map", out]).stdout;
        (folder.path().join(out), printed)
    };
    let (first, printed) = make("first");
    let map = first.join("map");
    let points = number(&printed, "cloud: ");
    assert!(points > 1000, "{printed}");
    assert_eq!(number(&head(&map.join("cloud.ply")), "element vertex "), points);
    let pcd = fs::read(map.join("cloud.pcd")).unwrap();
    assert_eq!(number(&head(&map.join("cloud.pcd")), "POINTS "), points);
    assert_eq!(pcd.len() - (pcd.windows(12).position(|w| w == b"DATA binary\n").unwrap() + 12), 16 * points);
    assert_eq!(number(&head(&map.join("octomap.bt")), "size "), number(&printed, "octomap: "));
    let mesh = head(&map.join("mesh.ply"));
    assert_eq!(number(&mesh, "element vertex "), number(&printed, "mesh: "));
    let triangles = number(&mesh, "element face ");
    assert!(triangles > 1000, "{triangles}");
    let (grid, yaml) = (fs::read(map.join("grid.pgm")).unwrap(), head(&map.join("grid.yaml")));
    let (width, height) = (number(&printed, "grid: "), number(&printed, " × "));
    assert!(grid.starts_with(format!("P5\n{width} {height}\n255\n").as_bytes()), "{printed}");
    assert!(yaml.contains("image: grid.pgm\n") && yaml.contains("resolution: 0.05\n"), "{yaml}");
    assert!([0, 205, 254].iter().all(|shade| grid[15..].contains(shade)), "occupied, unknown and free");
    let mut image = yfslam::RgbImage::default();
    yfslam_io::decode::decode_color(&fs::read(map.join("grid.png")).unwrap(), None, &mut image).unwrap();
    for (color, what) in [([0; 3], "occupied"), ([205; 3], "unknown"), ([254; 3], "free"), ([20, 90, 220], "path")] {
        assert!(image.data().iter().filter(|pixel| **pixel == color).count() > 100, "{what} is drawn");
    }

    let (again, _) = make("again");
    succeeds(folder.path(), &["map", "first.map", "--out", "saved"]);
    for other in [again.join("map"), folder.path().join("saved")] {
        let mut compared = 0;
        for entry in fs::read_dir(&map).unwrap().flatten().filter(|entry| entry.path().is_file()) {
            let other = other.join(entry.file_name());
            assert_eq!(fs::read(entry.path()).unwrap(), fs::read(&other).unwrap(), "{other:?}");
            compared += 1;
        }
        assert_eq!(compared, 12);
    }
    assert_eq!(fs::read(first.join("dense.map")).unwrap(), fs::read(again.join("dense.map")).unwrap());
    let mut saved = fs::read(folder.path().join("first.map")).unwrap();
    *saved.last_mut().unwrap() ^= 4;
    fs::write(folder.path().join("altered.map"), saved).unwrap();
    fails(folder.path(), &["map", "altered.map"], &["altered.map", "it was altered"]);

    octomap_reads(&map);
    reports_show_the_map(folder.path());
}

/// The tools of OctoMap read both trees, and convert one into the other.
fn octomap_reads(map: &Path) {
    let convert = |from: &str, to: &str| Command::new("convert_octree").args([from, to]).current_dir(map).output();
    let Ok(output) = convert("octomap.ot", "theirs.bt") else {
        println!("skipped: convert_octree of octomap-tools is not installed");
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let data = |name: &str| {
        let bytes = fs::read(map.join(name)).unwrap();
        let start = bytes.windows(5).position(|w| w == b"data\n").unwrap() + 5;
        (number(&String::from_utf8_lossy(&bytes[..start]), "size "), bytes[start..].to_vec())
    };
    assert_eq!(data("theirs.bt"), data("octomap.bt"));
    assert!(convert("octomap.bt", "theirs.ot").unwrap().status.success());
}

fn reports_show_the_map(folder: &Path) {
    let world = "synth:walking_xyz?width=320&height=240&frames=20";
    succeeds(folder, &["run", world, "--method", "none,yf", "--dense", "--report", "--out", "both", "-q"]);
    let html = fs::read_to_string(folder.join("both/report.html")).unwrap();
    for alt in ["the map of none from above", "the map of yf from a corner"] {
        assert!(html.contains(alt), "{alt}");
    }
}

#[test]
fn unusable_input_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    fails(folder.path(), &["map", "nowhere"], &["nowhere", "yfslam run SEQUENCE --dense"]);
    fs::write(folder.path().join("dense.map"), b"%PDF-1.4").unwrap();
    fails(folder.path(), &["map", "."], &["dense.map", "this is no yfslam dense map"]);
    let world = "synth:walking_xyz?width=320&height=240&frames=3";
    succeeds(folder.path(), &["run", world, "--save-map", "room.map", "-q"]);
    fails(folder.path(), &["map", "room.map"], &["room.map cannot be used", "a run with --dense"]);
    fails(folder.path(), &["map", ".", "--resolution", "0.5"], &["dense.resolution_m = 0.5", "0.01 to 0.2"]);
    fails(folder.path(), &["map", ".", "--up", "sideways"], &["sideways", "0,-1,0"]);
    fails(folder.path(), &["map", ".", "--band", "2,1"], &["'2,1'", "LOW,HIGH"]);
}

#[test]
fn the_map_of_two_sessions_shows_what_both_have_observed() {
    let folder = tempfile::tempdir().unwrap();
    // Along a corridor to its corner, then from there into the next one.
    let world = "synth:corridor_loop?people=0&frames=440&fps=10&width=320&height=240";
    let first = ["run", world, "--end", "60", "--method", "none", "-q", "--dense"];
    succeeds(folder.path(), &[&first[..], &["--save-map", "first.map", "--out", "first"]].concat());
    let again = ["run", world, "--start", "40", "--end", "90", "--method", "none", "-q", "--load-map", "first.map"];
    fails(
        folder.path(),
        &[&again[..], &["--save-map", "both.map"]].concat(),
        &["first.map holds a dense map", "--dense"],
    );
    succeeds(folder.path(), &[&again[..], &["--dense", "--save-map", "both.map", "--out", "second"]].concat());
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let dense_map = |name: &str| DenseMap::from_bytes(&read(name)).unwrap();
    let (before, both) = (dense_map("first.map"), dense_map("both.map"));
    assert_eq!(dense_map("second/dense.map"), both);
    let earlier = before.patches.len();
    let patches = |map: &DenseMap| map.patches.iter().map(|one| one.patch.clone()).collect::<Vec<_>>();
    assert!(earlier >= 8 && both.patches.len() >= earlier + 6, "{earlier} of {} patches", both.patches.len());
    assert_eq!(patches(&both)[..earlier], patches(&before));
    // The patches of each session, where the map of both has them.
    let part = |patches: &[PlacedPatch]| DenseMap { patches: patches.to_vec(), ..both.clone() };
    let occupied = |map: &DenseMap| {
        let volume = map.volume(&DenseConfig::default(), &map.turn(Up::Camera), |_| {}).unwrap();
        let voxels = volume.voxels().filter(|known| known.occupied).map(|known| known.voxel);
        (voxels.collect::<Vec<_>>(), volume)
    };
    let parts = [occupied(&part(&both.patches[..earlier])).0, occupied(&part(&both.patches[earlier..])).0];
    let (voxels, volume) = occupied(&both);
    for part in parts {
        let kept = part.iter().filter(|voxel| volume.get(**voxel).is_some_and(|known| known.occupied)).count() as f64
            / part.len() as f64;
        let more = voxels.len() as f64 / part.len() as f64;
        println!("{} of {} voxels; {kept:.3} of them are in the map of both", part.len(), voxels.len());
        assert!(kept > 0.9 && more > 1.2, "{kept} of a part are in the map of both, which is {more} times as large");
    }
    let printed = succeeds(folder.path(), &["map", "both.map", "--cloud", "--out", "cloud"]).stdout;
    assert!(number(&printed, "cloud: ") * 10 > voxels.len() * 9, "{printed}");
    // Localisation changes nothing.
    succeeds(folder.path(), &[&again[..], &["--localise", "--out", "third"]].concat());
    assert_eq!(dense_map("first.map"), before);
}

fn world(spec: &str) -> World {
    let mut config = parse(spec).unwrap();
    config.detections = true;
    World::new(&config).unwrap()
}

fn mapped(world: &World, method: Method) -> (DenseMap, Volume) {
    let config = DenseConfig::default();
    let run = run_all(world, &[RunOptions { method, loops: true }], &config).unwrap().remove(0);
    let DenseRun { map, ms_per_keyframe, bytes } = run;
    println!("{method:?}: {} patches, {ms_per_keyframe:.1} ms each", map.patches.len());
    assert!(bytes < 20_000_000, "{bytes} bytes");
    let volume = map.volume(&config, &map.turn(Up::Level), |_| {}).unwrap();
    (map, volume)
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn walking_people_leave_no_ghosts_and_walls_are_where_they_should_be() {
    let world = world("synth:walking_xyz?width=320&height=240&frames=150");
    let of = |method| {
        let (map, volume) = mapped(&world, method);
        let found = ExactSurfaces::of(&map, &volume, &world).compare(&volume);
        println!("{found:?}");
        (map, volume, found)
    };
    let (.., none) = of(Method::None);
    assert!(none.ghosts > 0.005, "without a filter there are ghosts: {none:?}");
    for method in [Method::YfSlam, Method::Full] {
        let (map, volume, found) = of(method);
        let Occupancy { precision, recall, ghosts, occupied } = found;
        assert!(precision >= 0.95 && recall >= 0.90 && ghosts <= 0.001, "{method:?}: {found:?}");
        let exact = with_exact_poses(&map, &world);
        let exact = exact.volume(volume.config(), &exact.turn(Up::Level), |_| {}).unwrap();
        let exact = exact.voxels().filter(|known| known.occupied).count();
        assert!((occupied as f64 / exact as f64 - 1.0).abs() < 0.1, "as thin as with exact poses: {occupied}, {exact}");
        let views = background_metrics::compare(&map, &volume, &world).unwrap();
        println!("{views:?}");
        assert!(views.psnr_db >= 25.0 && views.valid >= 0.9, "{method:?}: {views:?}");
        assert!(views.filled_psnr_db >= 25.0 && views.filled >= 0.85 * views.fillable, "{method:?}: {views:?}");
    }
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn after_a_loop_walls_observed_twice_are_as_thin_as_without_drift() {
    let world = world("synth:corridor_loop?people=0&frames=440&fps=10&width=320&height=240");
    let config = DenseConfig::default();
    let options = |loops| RunOptions { method: Method::None, loops };
    let runs = run_all(&world, &[options(true), options(false)], &config).unwrap();
    let of = |map: &DenseMap| wall_thickness(map, &world, &config).unwrap();
    let (closed, open) = (of(&runs[0].map), of(&runs[1].map));
    let exact = of(&with_exact_poses(&runs[0].map, &world));
    println!("exact poses {exact:?}\nloop closed {closed:?}\nno loops    {open:?}");
    assert!(exact.patches > 1000 && open.patches > 1000);
    // A tenth of a voxel.
    assert!(exact.mean_m <= closed.mean_m && closed.mean_m < exact.mean_m + 0.1 * f64::from(config.resolution_m));
    assert!(open.mean_m > 5.0 * closed.mean_m, "without the loop they are double");
}
