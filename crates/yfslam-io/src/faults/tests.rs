use yfslam::{BoundingBox, Detection};

use super::*;

/// Returns frame `k` at 10 Hz, with `k` in its grey level and depth, and with one box.
fn frame(k: i64) -> Frame {
    let color = RgbImage::from_vec(4, 2, vec![[100 + k as u8; 3]; 8]).unwrap();
    let raw = Image::from_vec(4, 2, vec![1000 + k as u16; 8]).unwrap();
    let bbox = BoundingBox { x_min: k as f32, ..Default::default() };
    let mut frame = Frame::rgbd(7_000_000_000 + k * 100_000_000, color, DepthImage { raw, metres_per_unit: 0.0002 });
    frame.depth_timestamp_ns = Some(frame.timestamp_ns + 5_000_000);
    frame.with_detections(vec![Detection { class: 0, score: 1.0, bbox }])
}

/// Returns the deliveries of ten frames.
fn deliver(faults: &[&str]) -> Vec<Delivery> {
    let faults = faults.iter().map(|text| text.parse().unwrap()).collect();
    let mut injector = FaultInjector::new(faults, frame(0).timestamp_ns);
    (0..10).for_each(|k| injector.push(frame(k)));
    injector.finish();
    std::iter::from_fn(|| injector.pop()).collect()
}

/// Returns the numbers of the frames from their stamps.
fn order(deliveries: &[Delivery]) -> Vec<i64> {
    deliveries.iter().map(|d| (d.frame.timestamp_ns - 7_000_000_000) / 100_000_000).collect()
}

fn grey(delivery: &Delivery) -> u8 {
    delivery.frame.color.data()[0][0]
}

fn depth(delivery: &Delivery) -> u16 {
    delivery.frame.depth.as_ref().unwrap().raw.data()[0]
}

#[test]
fn without_a_fault_frames_pass_unchanged() {
    let passed = deliver(&["black@60+5", "blank@0.5+0"]);
    assert_eq!(order(&passed), (0..10).collect::<Vec<_>>());
    assert!(passed.iter().enumerate().all(|(k, d)| usize::from(grey(d)) == 100 + k && d.has_stamp));
}

#[test]
fn a_fault_affects_frames_from_its_start_until_its_end() {
    assert_eq!(order(&deliver(&["dropped@0.3+0.2"])), [0, 1, 2, 5, 6, 7, 8, 9]);
}

#[test]
fn stamps_are_repeated_out_of_order_or_missing() {
    assert_eq!(order(&deliver(&["repeated@0.8+0.2"])), [0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 9, 9]);
    assert_eq!(order(&deliver(&["late@0.2+0.4"])), [0, 1, 3, 2, 5, 4, 6, 7, 8, 9]);
    assert_eq!(
        order(&deliver(&["late@0.2+0.3"])),
        [0, 1, 3, 2, 5, 4, 6, 7, 8, 9],
        "the last one held comes after the next"
    );
    assert_eq!(order(&deliver(&["late@0.9+5"])), (0..10).collect::<Vec<_>>(), "nothing is held back for ever");
    let unstamped = deliver(&["nan-stamp@0.4+0.2"]);
    assert_eq!((0..10).filter(|&k| !unstamped[k].has_stamp).collect::<Vec<_>>(), [4, 5]);
}

#[test]
fn images_become_white_black_dark_or_frozen() {
    for (fault, expected) in [("blank@0.3+0.1", 255), ("black@0.3+0.1", 0)] {
        let affected = &deliver(&[fault])[3];
        assert_eq!((grey(affected), depth(affected)), (expected, 1003));
        assert!(affected.frame.detections.as_ref().unwrap().is_empty());
    }
    let covered = &deliver(&["covered@0.3+0.1"])[3];
    assert!(covered.frame.color.data().iter().flatten().all(|v| (4..20).contains(v)) && depth(covered) == 0);
    let blind = &deliver(&["depth-dropout@0.3+0.1"])[3];
    assert_eq!((grey(blind), depth(blind), blind.frame.detections.as_ref().unwrap().len()), (103, 0, 1));
    let frozen = deliver(&["frozen@0.3+0.3"]);
    assert_eq!(frozen.iter().map(grey).collect::<Vec<_>>(), [100, 101, 102, 103, 103, 103, 106, 107, 108, 109]);
    assert_eq!(frozen.iter().map(depth).collect::<Vec<_>>()[3..7], [1003, 1003, 1003, 1006]);
    assert_eq!(frozen[5].frame.detections, frozen[3].frame.detections);
    let depth_after = |one: &Delivery| one.frame.depth_timestamp_ns.unwrap() - one.frame.timestamp_ns;
    assert!(frozen.iter().all(|one| depth_after(one) == 5_000_000), "the stamps of depth continue, too");
    assert_eq!(order(&frozen), (0..10).collect::<Vec<_>>());
}

#[test]
fn images_of_worn_or_badly_set_cameras_differ_from_the_true_ones_and_are_the_same_again() {
    let kinds = ["over-exposed", "blurred", "flicker", "dirt", "ir-pattern"];
    let textured = |k: i64| {
        let mut frame = frame(k);
        let value = |i: usize| [(i * 37 % 200) as u8, (i * 53 % 200) as u8, 90];
        frame.color = Arc::new(RgbImage::from_vec(64, 48, (0..64 * 48).map(value).collect()).unwrap());
        frame.right = Some(frame.color.clone());
        frame
    };
    for kind in kinds {
        let images = || -> Vec<Frame> {
            let mut injector = FaultInjector::new(vec![format!("{kind}@0+9").parse().unwrap()], frame(0).timestamp_ns);
            (0..3).for_each(|k| injector.push(textured(k)));
            std::iter::from_fn(|| injector.pop()).map(|delivery| delivery.frame).collect()
        };
        let (once, again) = (images(), images());
        assert!(once.iter().zip(&again).all(|(a, b)| a.color == b.color), "{kind}");
        assert!(
            once.iter().all(|a| a.color != textured(0).color && a.right.as_ref() != Some(&textured(0).color)),
            "{kind}"
        );
        assert_eq!(once[0].color != once[2].color, kind == "flicker", "{kind}: what is on the lens stays where it is");
    }
    let half = &deliver(&["wrong-size@0.3+0.1"])[3].frame;
    assert_eq!((half.color.width(), half.color.height()), (2, 1));
    assert_eq!(half.depth.as_ref().map(|depth| (depth.raw.width(), depth.raw.height())), Some((2, 1)));
}

#[test]
fn depth_becomes_noise_larger_saturated_or_late() {
    let readings = |kind: &str| -> Vec<u16> {
        let delivered = deliver(&[&format!("{kind}@0.5+0.1")]);
        assert_eq!(delivered.iter().map(depth).take(5).collect::<Vec<_>>(), [1000, 1001, 1002, 1003, 1004]);
        delivered[5].frame.depth.as_ref().unwrap().raw.data().to_vec()
    };
    let noise = readings("depth-noise");
    assert!(noise.iter().all(|v| (804..=1206).contains(v)) && noise.iter().any(|v| v.abs_diff(1005) > 20), "{noise:?}");
    assert_eq!(readings("depth-scale"), [1507; 8]);
    assert_eq!(readings("depth-saturated"), [[u16::MAX; 4], [1005; 4]].concat());
    assert_eq!(readings("depth-late"), [1002; 8]);
}

#[test]
fn a_wrong_clock_shifts_all_stamps_and_a_blind_detector_reports_nothing() {
    let clock = |kind: &str| deliver(&[&format!("{kind}@0.5+0.2")]);
    assert_eq!(order(&clock("clock-ahead")), [0, 1, 2, 3, 4, 105, 106, 7, 8, 9]);
    let behind = clock("clock-behind");
    assert_eq!(order(&behind), [0, 1, 2, 3, 4, -95, -94, 7, 8, 9]);
    assert!(behind.iter().all(|one| one.frame.depth_timestamp_ns == Some(one.frame.timestamp_ns + 5_000_000)));
    assert_eq!(deliver(&["no-boxes@0.5+0.1"])[5].frame.detections, Some(Vec::new()));
}

#[test]
fn faults_at_the_same_time_add_up() {
    let both = deliver(&["black@0.3+0.1", "depth-dropout@0.3+0.1", "repeated@0.3+0.1"]);
    assert!(both[3..5].iter().all(|d| (grey(d), depth(d)) == (0, 0)));
    assert_eq!(order(&both)[3..5], [3, 3]);
}

#[test]
fn a_malformed_fault_is_refused_with_the_format_and_all_kinds() {
    for (text, words) in [
        ("blak@1+2", "unknown kind 'blak'"),
        ("black", "has no '@' and '+'"),
        ("black@1", "has no '@' and '+'"),
        ("black@x+2", "start 'x' is not a number"),
        ("black@1+-2", "duration '-2' is negative"),
        ("black@1+nan", "duration 'nan' is not a number"),
    ] {
        let error = text.parse::<Fault>().unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("KIND@START+SECONDS"), "{error}");
        assert!(FaultKind::ALL.iter().all(|(name, ..)| error.contains(name)), "{error}");
    }
    let fault: Fault = "covered@4+1.5".parse().unwrap();
    assert_eq!(fault.to_string().parse::<Fault>().unwrap(), fault);
}
