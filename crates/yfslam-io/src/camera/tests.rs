use proptest::prelude::*;
use yfslam::Camera;

use super::*;

const SETTINGS: &str = "%YAML:1.0\n\n#----\n# Camera\n#----\nCamera.fx: 517.3 # px\nCamera.fy:516.5\n\"Camera.cx\": 318.6\r\n\
    Camera.cy: 255.3\nCamera.k1: 0.26\nCamera.k3: 1.1\nCamera.width: 640\nCamera.height: 480\nCamera.bf: 40.5\nDepthMapFactor: 5000.\n\
    Viewer.PointSize:2\nSystem.File: \"a # b\"\n";

fn settings(text: &str) -> Result<CameraSource> {
    parse_camera(text, Path::new("cam.yaml"))
}

fn refusal(text: &str) -> String {
    settings(text).unwrap_err().to_string()
}

#[test]
fn a_settings_file_with_unusual_spacing_and_quotes_is_read() {
    let source = settings(SETTINGS).unwrap();
    let camera = &source.camera;
    assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (517.3, 516.5, 318.6, 255.3));
    assert_eq!(camera.distortion, [0.26, 0.0, 0.0, 0.0, 1.1]);
    assert_eq!(
        (camera.width, camera.height, camera.bf, source.depth_factor, camera.fps),
        (640, 480, 40.5, 5000.0, 30.0)
    );
    assert_eq!(source.unused_keys, ["System.File", "Viewer.PointSize"]);
}

#[test]
fn keys_of_orb_slam3_and_indented_keys_are_read() {
    let source = settings(
        "File.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 500\nCamera1.fy: 501\nCamera1.cx: 320\nCamera1.cy: 240\n\
         Camera:\n  width: 640\n  height: 480\nStereo.b: 0.08\nRGBD.DepthMapFactor: 1000.0\n\
         Tbc: !!opencv-matrix\n   rows: 4\n   data: [1.0, 0.0,\n     0.0, 1.0]\nStereo.T: [1,\n 2]\n",
    )
    .unwrap();
    assert_eq!((source.camera.fx, source.camera.width, source.depth_factor), (500.0, 640, 1000.0));
    assert!((source.camera.bf - 40.0).abs() < 1e-9);
    assert_eq!(settings(&SETTINGS.replace("Camera.cy", "  Camera.cy")).unwrap().camera.cy, 255.3);
}

#[test]
fn a_missing_key_is_named_with_file_and_cure() {
    for (line, key) in [("Camera.fx: 517.3 # px\n", "Camera.fx"), ("Camera.fy:516.5\n", "Camera.fy")] {
        let error = refusal(&SETTINGS.replace(line, ""));
        assert!(
            error.contains("cam.yaml") && error.contains(&format!("the key {key} is missing")) && error.contains("add"),
            "{error}"
        );
    }
}

#[test]
fn invalid_numbers_lines_without_colon_and_repeated_keys_are_refused() {
    let error = refusal(&SETTINGS.replace("517.3", "517,3"));
    assert!(error.contains("cam.yaml:6") && error.contains("517,3"), "{error}");
    assert!(refusal(&SETTINGS.replace("517.3", "nan")).contains("Camera.fx is 'nan'"));
    assert!(refusal(&SETTINGS.replace("640", "640.5")).contains("Camera.width is 640.5"));
    assert!(refusal(&SETTINGS.replace("fy:516.5", "fy 516.5")).contains("cam.yaml:7"));
    assert!(refusal(&format!("{SETTINGS}Camera.fx: 1\n")).contains("on line 6 already, with another value"));
    assert!(refusal(&format!("{SETTINGS}Camera.type: KannalaBrandt8\n")).contains("KannalaBrandt8"));
}

#[test]
fn values_that_no_camera_has_are_refused() {
    let good = preset("tum1").unwrap();
    let check = |change: fn(&mut Camera)| {
        let mut source = CameraSource { origin: "here".into(), ..good.clone() };
        change(&mut source.camera);
        check_camera(&source).unwrap_err().to_string()
    };
    check_camera(&good).unwrap();
    assert!(check(|c| c.fx = 0.0).contains("camera here: fx is 0"));
    assert!(check(|c| c.fy = -1.0).contains("fy is -1"));
    assert!(check(|c| c.cx = f64::NAN).contains("NaN"));
    assert!(check(|c| c.width = 0).contains("width is 0"));
    assert!(check(|c| c.bf = 0.0).contains("bf is 0"));
    let negative = check_camera(&CameraSource { depth_factor: -5.0, ..good.clone() }).unwrap_err().to_string();
    assert!(negative.contains("depth factor is -5"), "{negative}");
    assert!(check(|c| c.fps = f64::INFINITY).contains("fps is inf"));
    assert!(check(|c| c.distortion[0] = -40.0).contains("folds the image"));
}

#[test]
fn every_preset_is_a_valid_camera() {
    for name in PRESETS {
        check_camera(&preset(name).unwrap()).unwrap();
        assert_eq!(load_camera(&name.to_uppercase(), None).unwrap().origin, format!("preset {name}"));
    }
}

#[test]
fn toml_with_unknown_or_missing_keys_is_refused_with_the_line() {
    let toml = "width = 640\nheight = 480\nfx = 500.0\nfy = 500.0\ncx = 320.0\ncy = 240.0\ndepth_factor = 1000.0\n";
    let source = parse_toml(toml, Path::new("cam.toml")).unwrap();
    assert_eq!((source.camera.fx, source.camera.distortion, source.camera.bf), (500.0, [0.0; 5], 40.0));
    let error = parse_toml(&format!("{toml}focal = 3.0\n"), Path::new("cam.toml")).unwrap_err().to_string();
    assert!(error.contains("cam.toml:8") && error.contains("focal"), "{error}");
    let error = parse_toml(&toml.replace("fx = 500.0\n", ""), Path::new("cam.toml")).unwrap_err().to_string();
    assert!(error.contains("fx"), "{error}");
}

#[test]
fn a_written_camera_is_read_back_whatever_its_comment() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.toml");
    let mut camera = preset("bonn").unwrap().camera.with_fps(29.97).with_bf(41.5);
    (camera.readout_ms, camera.depth_delay_ms) = (Some(-24.7), Some(0.0));
    write_camera(&path, &camera, 5208.0, "made by hand\r\nfx = \u{7}\n\nlast line").unwrap();
    let source = load_camera(path.to_str().unwrap(), None).unwrap();
    assert_eq!((source.camera, source.depth_factor), (camera, 5208.0));
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("# made by hand\n# fx =\n#\n# last line\nwidth = 640\n"), "{text}");
}

#[test]
fn a_camera_is_loaded_by_path_or_from_the_folder_or_refused_with_the_names_of_the_presets() {
    let folder = tempfile::tempdir().unwrap();
    let error = detect_camera(folder.path()).unwrap_err().to_string();
    assert!(error.contains("camera.yaml") && error.contains("tum1"), "{error}");
    std::fs::write(folder.path().join("camera.yaml"), SETTINGS).unwrap();
    assert_eq!(detect_camera(folder.path()).unwrap().camera.fx, 517.3);
    assert_eq!(load_camera("camera.yaml", Some(folder.path())).unwrap().camera.fx, 517.3);
    let error = load_camera("tum4", None).unwrap_err().to_string();
    assert!(error.contains("tum4") && error.contains("tum3"), "{error}");
    std::fs::write(folder.path().join("camera.yaml"), SETTINGS.replace("40.5", "0")).unwrap();
    let error = detect_camera(folder.path()).unwrap_err().to_string();
    assert!(error.contains("camera.yaml") && error.contains("bf is 0"), "{error}");
}

proptest! {
    #[test]
    fn camera_files_of_arbitrary_text_never_panic(text in "(Camera\\.f?[xy]|[:#\"\\[\\]%. \n0-9]|.){0,200}") {
        let _ = settings(&text);
        let _ = parse_toml(&text, Path::new("cam.toml"));
    }

    #[test]
    fn a_check_of_arbitrary_values_never_panics(v in prop::array::uniform12(any::<f64>()), width in 0usize..70_000, height: usize) {
        let distortion = [v[4], v[5], v[6], v[7], v[8]];
        let rational = [v[11], v[4], v[3]];
        let mut camera = Camera::pinhole(width, height, v[0], v[1], v[2], v[3])
            .with_distortion(distortion)
            .with_fps(v[10])
            .with_bf(v[11]);
        camera.rational = rational;
        let _ = check_camera(&CameraSource::new(camera, v[9], "here"));
    }
}
