//! `yfslam synth`: writes a synthetic world as a folder in TUM layout.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use rayon::prelude::*;
use yfslam_io::boxes::{FrameBoxes, InstanceBox};
use yfslam_io::write::ListedStamps;
use yfslam_io::{BoxList, Delivery, Fault, FaultInjector, RecordingWriter, StampedPose};
use yfslam_synth::{CLASS_NAMES, SUITE, SynthFrame, World};

use crate::input::source::SourceArgs;
use crate::ui::interrupt::Interrupt;
use crate::ui::progress::Progress;
use crate::ui::terminal::{Terminal, print};

/// Frames in memory at the same time, for each thread.
const BATCH_PER_THREAD: usize = 4;

const HELP: &str = "\
Examples:
  yfslam synth --list
  yfslam synth walking_xyz -o walk && yfslam run walk
  yfslam synth 'sitting_rpy?seed=7&frames=900' --camera tum1 -o sit
  yfslam synth 'walking_xyz?stereo=0.11' -o pairs             a stereo camera with a baseline of 0.11 m
  yfslam synth 'walking_rpy?readout=30' -o rolling            a rolling shutter: 30 ms from the first to the last row
  yfslam synth walking_static --fault covered@2+1 --fault nan-stamp@5+0.5 -o faulty

Files in the folder:
  rgb/ depth/ rgb.txt depth.txt associations.txt   images and lists, as in the TUM RGB-D benchmark
  right/ right.txt                                 right images instead of depth, of a stereo camera
  groundtruth.txt                                  exact pose of every frame, also of frames with faults
  camera.toml                                      camera, with the readout of its rows if the world mentions it
  boxes.json                                       class, instance and exact bounding box of movable objects, for `yfslam run`
  masks/                                           mask of each frame with instances, 0 for static pixels, for `yfslam run --masks`
  world.toml                                       all settings of the world

  The folder appears once it is complete. SIGINT (Ctrl-C) and SIGTERM end the command without it, with exit code 130 or 143.";

/// Write a synthetic world to a folder: images, exact poses, boxes and masks.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct SynthArgs {
    /// Synthetic world, such as `walking_xyz` or `walking_xyz?seed=7&people=3&frames=300`.
    #[arg(value_name = "WORLD", required_unless_present = "list")]
    world: Option<String>,
    /// Folder to write.
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// List the named worlds.
    #[arg(long)]
    list: bool,
    /// Replace an existing recording.
    #[arg(long)]
    force: bool,
    /// Camera: tum1, tum2, tum3, bonn, or a settings file [default: tum3, which has no distortion].
    #[arg(long, value_name = "PRESET|FILE")]
    camera: Option<String>,
    /// Inject a fault, as in `yfslam run`; the option can be given several times.
    #[arg(long = "fault", value_name = "KIND@START+SECONDS")]
    faults: Vec<Fault>,
}

pub fn run(args: &SynthArgs, terminal: Terminal) -> Result<()> {
    let (world, out) = match (&args.world, &args.out) {
        _ if args.list => return list(),
        (Some(world), Some(out)) => (world, out),
        _ => bail!("give a world and a folder, as in `yfslam synth walking_xyz --out walk`; --list prints the worlds"),
    };
    let interrupt = Interrupt::watch()?;
    let mut source = SourceArgs::new(world.clone());
    source.camera.clone_from(&args.camera);
    let config = source.world()?;
    // Created first, so that a folder in use is reported before the long work.
    let mut writer = RecordingWriter::create(out, config.stereo_m > 0.0, args.force)?;
    let world = World::new(&config)?;
    let mut progress = Progress::new(terminal, "rendering", world.len());
    let mut injector = FaultInjector::new(args.faults.clone(), world.timestamp_ns(0));
    let mut boxes = BoxList { classes: CLASS_NAMES.map(str::to_owned).to_vec(), frames: Vec::new() };
    let (mut number, mut offset_ns) = (0, 0);
    let batch = BATCH_PER_THREAD * rayon::current_num_threads();
    for start in (0..world.len()).step_by(batch) {
        // The unfinished folder is removed.
        interrupt.check()?;
        let end = (start + batch).min(world.len());
        let rendered: Vec<SynthFrame> = (start..end).into_par_iter().map(|index| world.frame(index)).collect();
        rendered.par_iter().try_for_each(|one| writer.write_mask(one.frame.timestamp_ns, &one.instances))?;
        for one in rendered {
            boxes.frames.push(frame_boxes(&one));
            offset_ns = one.depth_timestamp_ns - one.frame.timestamp_ns;
            injector.push(one.frame);
        }
        if end == world.len() {
            injector.finish();
        }
        let deliveries: Vec<Delivery> = std::iter::from_fn(|| injector.pop()).collect();
        deliveries.par_iter().enumerate().try_for_each(|(k, d)| writer.write_images(number + k, &d.frame))?;
        for delivery in &deliveries {
            let stamp = delivery.has_stamp.then_some(delivery.frame.timestamp_ns);
            writer.list(number, ListedStamps { color_ns: stamp, paired_ns: stamp.map(|ns| ns + offset_ns) });
            number += 1;
        }
        progress.frames(end, String::new);
    }
    progress.finish();
    writer.write_text("world.toml", &toml::to_string(&config)?)?;
    let truth = |index| StampedPose::new(world.timestamp_ns(index), world.pose(index));
    writer.finish(&config.camera, config.depth_factor, &(0..world.len()).map(truth).collect::<Vec<_>>(), &boxes)?;
    terminal.result(&format!(
        "{} frames of {} px × {} px, what moves covers {:.0} % of the image; written to {}\n",
        world.len(),
        config.camera.width,
        config.camera.height,
        100.0 * world.person_share(),
        out.display()
    ))
}

fn list() -> Result<()> {
    let width = SUITE.iter().map(|world| world.name.len()).max().unwrap_or(0);
    print(&SUITE.iter().map(|world| format!("{:width$}  {}\n", world.name, world.about)).collect::<String>())
}

fn frame_boxes(rendered: &SynthFrame) -> FrameBoxes {
    let boxes = rendered.boxes.iter().map(|(instance, class, b)| InstanceBox {
        instance: *instance,
        class: CLASS_NAMES[*class].to_owned(),
        bbox: [b.x_min, b.y_min, b.x_max, b.y_max],
    });
    FrameBoxes { timestamp_ns: rendered.frame.timestamp_ns, boxes: boxes.collect() }
}
