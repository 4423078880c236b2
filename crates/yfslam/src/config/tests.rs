use super::section::{Check, Entry, Key, Number, Section};
use super::*;

/// Returns all keys with their full names and default numbers.
fn keys() -> Vec<(String, &'static Key, Option<Number>)> {
    let mut keys = Vec::new();
    Config::default().visit_keys("", &mut |path, key, number| keys.push((path.to_owned(), key, number)));
    keys
}

/// Returns all numeric keys with both ends of their ranges.
fn ranges() -> Vec<(String, &'static Key, [Number; 2])> {
    let range = |(path, key, _): (String, &'static Key, _)| match &key.check {
        Check::Range(range) => Some((path, key, range())),
        Check::Any | Check::Section(_) => None,
    };
    keys().into_iter().filter_map(range).collect()
}

fn config_with(path: &str, number: Number) -> Config {
    let mut config = Config::default();
    config.set(path, number);
    config
}

/// Returns the values just below and just above a range, as far as the type has them.
fn beyond([from, to]: [Number; 2]) -> [Option<Number>; 2] {
    let below = match from {
        Number::Integer(value) => value.checked_sub(1).map(Number::Integer),
        Number::Single(value) => Some(Number::Single(value.next_down())),
        Number::Double(value) => Some(Number::Double(value.next_down())),
    };
    let above = match to {
        Number::Integer(value) => Number::Integer(value + 1),
        Number::Single(value) => Number::Single(value.next_up()),
        Number::Double(value) => Number::Double(value.next_up()),
    };
    [below, Some(above)]
}

#[test]
fn every_number_is_accepted_at_both_ends_of_its_range_and_refused_beyond() {
    assert!(ranges().len() > 150, "{}", ranges().len());
    for (path, key, [from, to]) in ranges() {
        for number in [from, to] {
            assert_eq!(config_with(&path, number).validate(), Ok(()));
        }
        for number in beyond([from, to]).into_iter().flatten() {
            let message = config_with(&path, number).validate().unwrap_err().to_string();
            assert!(message.contains(&format!("{path} = {number} ")), "{message}");
            assert!(message.contains(&format!("from {from} to {to}")) && message.ends_with(key.unit), "{message}");
        }
    }
}

#[test]
fn negative_integers_are_refused_and_floating_point_numbers_are_finite() {
    for (path, _, [from, _]) in ranges() {
        match from {
            Number::Integer(_) => {
                let error = Config::from_toml(&format!("{path} = -1\n")).unwrap_err().to_string();
                assert!(error.contains(&path), "{error}");
            }
            Number::Single(_) => {
                for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                    assert_eq!(config_with(&path, Number::Single(value)).validate().unwrap_err().key, path);
                }
            }
            Number::Double(_) => {
                for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    assert_eq!(config_with(&path, Number::Double(value)).validate().unwrap_err().key, path);
                }
            }
        }
    }
}

#[test]
fn every_key_has_one_sentence_and_a_source_and_every_number_a_range() {
    for (path, key, number) in keys() {
        if matches!(key.check, Check::Section(_)) {
            continue;
        }
        assert_eq!(number.is_some(), matches!(key.check, Check::Range(_)), "{path}: only numbers have a range");
        let (sentence, source) = key.doc.split_once("Source: ").unwrap_or_else(|| panic!("{path} has no source"));
        for text in [sentence, source] {
            assert!(text.trim().ends_with('.') && text.matches(". ").count() == 0, "{path}: {text}");
        }
    }
}

#[test]
fn the_printed_configuration_reads_back_and_explains_every_key() {
    let mut config = Config::default();
    for config in [config.clone(), {
        config.set("dynamic.seed", Number::Integer(MAX_SEED));
        config.set("dense.occupied", Number::Single(0.15 + f32::EPSILON));
        config.set("bundle.relative_tolerance", Number::Double(1e-300));
        config.dynamic.movable = vec!["a \"quoted\" name".to_owned(), "dog".to_owned()];
        config.dynamic.method = Method::YfSlam;
        config
    }] {
        let text = config.to_commented_toml().unwrap();
        assert_eq!(Config::from_toml(&text).unwrap(), config);
        let lines: Vec<&str> = text.lines().collect();
        let is_key = |line: &str| line.contains(" = ") && !line.starts_with('#');
        let printed = lines.iter().filter(|line| is_key(line)).count();
        assert_eq!(printed, keys().iter().filter(|(_, key, _)| !matches!(key.check, Check::Section(_))).count());
        for pair in lines.windows(2).filter(|pair| is_key(pair[1])) {
            assert!(pair[0].starts_with("# ") && pair[0].contains(" Source: "), "no comment above {}", pair[1]);
        }
    }
}

#[test]
fn basic_keys_are_few_and_printed_first() {
    let text = Config::default().to_commented_toml().unwrap();
    let (basic, advanced) = text.split_once("# Advanced keys").unwrap();
    let count = |text: &str| text.lines().filter(|line| line.contains(" = ") && !line.starts_with('#')).count();
    assert!((12..=18).contains(&count(basic)), "{}", count(basic));
    assert!(basic.contains("\ndynamic.method = \"full\"\n") && advanced.contains("\nfeatures.scale_factor = 1.2\n"));
}

#[test]
fn sections_may_be_written_as_tables() {
    let config = Config::from_toml("[features]\ncount = 7\n[dynamic.full]\nhistory_frames = 2\n").unwrap();
    assert_eq!((config.features.count, config.dynamic.full.history_frames), (7, 2));
}

#[test]
fn the_limits_of_occupied_voxels_must_be_on_either_side_of_the_threshold() {
    for (clamp_min, clamp_max, occupied, key) in
        [(0.4, 0.97, 0.4, "dense.clamp_min"), (0.12, 0.6, 0.7, "dense.clamp_max")]
    {
        let dense = DenseConfig { clamp_min, clamp_max, occupied, ..DenseConfig::default() };
        assert_eq!(dense.validate().unwrap_err().key, key);
        assert_eq!(Config { dense, ..Config::default() }.validate().unwrap_err().key, key);
    }
}

#[test]
fn values_that_once_ended_in_a_panic_or_an_endless_run_are_refused() {
    for text in [
        "dynamic.group_gap_m = 0.0",
        "tracking.hamming_high = 4294967295",
        "pose_optimizer.rounds = 65535",
        "stereo.row_band_px = -1.0",
        "dynamic.full.history_frames = 9223372036854775807",
    ] {
        let (key, _) = text.split_once(" = ").unwrap();
        assert_eq!(Config::from_toml(text).unwrap().validate().unwrap_err().key, key);
    }
}

#[test]
fn an_unknown_key_is_refused_with_the_keys_that_exist() {
    let error = Config::from_toml("[tracking]\nlocal_raduis_px = 4.0\n").unwrap_err().to_string();
    assert!(error.contains("local_raduis_px") && error.contains("local_radius_px"), "{error}");
}
