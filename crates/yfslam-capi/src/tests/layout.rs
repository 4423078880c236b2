//! A C compiler gives the structures of the header the sizes and fields that Rust gives them.

use std::mem::offset_of;
use std::path::Path;
use std::process::Command;

use crate::structs::{Camera, Detection, Frame, GridInfo, Options, Point, Pose, Tracked};

/// Lists the size of a structure and the offsets of its fields, as Rust has them and as C code that prints them.
macro_rules! layouts {
    ($($c:ident = $rust:ty { $($field:ident),* })*) => {
        [$(
            (
                vec![size_of::<$rust>(), $(offset_of!($rust, $field)),*],
                stringify!($c),
                vec![$(stringify!($field)),*],
            )
        ),*]
    };
}

#[test]
fn structures_have_the_same_layout_in_c() {
    let layouts = layouts! {
        yfslam_camera = Camera {
            struct_size, width, height, reserved, fx, fy, cx, cy, distortion, fps, baseline_m, depth_scale, knows_readout, reserved2,
            readout_ms
        }
        yfslam_detection = Detection { x_min, y_min, x_max, y_max, score, class_index }
        yfslam_options = Options<'_> {
            struct_size, sensor, config_toml, method, detector, threaded, detector_file, detector_function, detector_user, map_file,
            localise, dense
        }
        yfslam_frame = Frame {
            struct_size, pixels, timestamp_ns, width, height, color, color_stride, depth_u16, depth_m, depth_stride, depth_scale,
            has_depth_timestamp, has_detections, depth_timestamp_ns, right, right_stride, mask, mask_stride, detections,
            detection_count
        }
        yfslam_pose = Pose { timestamp_ns, position_m, quaternion }
        yfslam_tracked = Tracked {
            struct_size, state, has_pose, has_covariance, is_keyframe, closed_loop, inliers, pose, matrix, covariance
        }
        yfslam_point = Point { position_m, color, reserved }
        yfslam_grid_info = GridInfo { struct_size, width, height, reserved, origin_m, resolution_m }
    };
    let folder = tempfile::tempdir().unwrap();
    let mut code = "#include <stdio.h>\n#include \"yfslam.h\"\nint main(void) {\n".to_owned();
    for (_, name, fields) in &layouts {
        code += &format!("printf(\"%zu\", sizeof({name}));\n");
        for field in fields {
            code += &format!("printf(\" %zu\", offsetof({name}, {field}));\n");
        }
        code += "printf(\"\\n\");\n";
    }
    let (source, program) = (folder.path().join("layout.c"), folder.path().join("layout"));
    std::fs::write(&source, code + "return 0; }\n").unwrap();
    // Rust links with this compiler, too, so it is there.
    let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"];
    let mut compile = Command::new(compiler);
    compile.args(flags).arg("-I").arg(include).arg(&source).arg("-o").arg(&program);
    assert!(compile.status().unwrap().success());
    let printed = String::from_utf8(Command::new(program).output().unwrap().stdout).unwrap();
    assert_eq!(printed.lines().count(), layouts.len());
    for (line, (rust, name, fields)) in printed.lines().zip(&layouts) {
        let c: Vec<usize> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        assert_eq!(&c, rust, "{name}: size, then {fields:?}");
    }
}
