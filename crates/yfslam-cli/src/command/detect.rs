//! `yfslam detect`: images in, the boxes that the network finds in them out.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Args;
use yfslam::image::RgbImage;
use yfslam::{Detection, Detector, Upright};
use yfslam_detect::DetectorConfig;
use yfslam_io::decode::decode_color;
use yfslam_io::write::write_color_png;

use crate::input::detector::{self, DetectorArgs, LoadedDetector};
use crate::input::instance_detector::InstanceDetector;
use crate::output::detections_file::{DetectionsFile, ImageDetections, ImageResult, ObjectBox};
use crate::output::folder::{OutputFolder, remove_files};
use crate::stats::stages::StageSummary;
use crate::ui::progress::Progress;
use crate::ui::terminal::{Terminal, explain};

const EXAMPLES: &str = "\
Examples:
  yfslam detect photo.jpg --pictures
  yfslam detect rgbd_bonn_crowd/rgb --score 0.5 --out crowd
  yfslam detect images/ --detector yolo-fastestv2.onnx --class person,chair
  yfslam detect images/ --roll 90      taken by a camera that lay on its right side

In the output folder:
  boxes.json   each image, a line: its boxes with class, score, and left, top, right and bottom edge in px; from a network that
               segments also the mask in COCO's form: size [height, width] and counts, the lengths of runs down the columns, of
               pixels beside and of the object in turns
  pictures/    with --pictures, each image with its boxes and masks; the bar in a box is as long as its score

Ends with success only if every image could be read; of the others boxes are written all the same.";

/// Kinds of file that are taken from a folder.
const KINDS: [&str; 3] = ["png", "jpg", "jpeg"];
/// Up to so many images are told one by one.
const TOLD: usize = 20;

/// Find people in images: boxes as JSON and as pictures.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct DetectArgs {
    /// Images, PNG or JPEG, and folders of them.
    #[arg(value_name = "IMAGE|FOLDER", required = true)]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    detector: DetectorArgs,
    /// Least score of a box, between 0 and 1.
    #[arg(long, value_name = "SCORE", default_value_t = 0.3, allow_negative_numbers = true, help_heading = "System")]
    score: f32,
    /// Of two boxes of one class that overlap by more than this (intersection over union), only the better one is kept.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, allow_negative_numbers = true, help_heading = "System")]
    iou: f32,
    /// Report these classes alone [default: all that the network knows].
    #[arg(long = "class", value_name = "NAME,NAME", value_delimiter = ',', help_heading = "System")]
    classes: Vec<String>,
    /// How far the camera was rolled clockwise, degrees: boxes are found in the images turned upright.
    #[arg(long, value_name = "DEGREES", default_value_t = 0, allow_negative_numbers = true, help_heading = "System")]
    #[arg(value_parser = clap::value_parser!(i32).range(-180..=180))]
    roll: i32,
    /// Where results go.
    #[arg(long, value_name = "DIR", default_value = "yfslam-out/detect", help_heading = "Output")]
    out: PathBuf,
    /// Write each image with its boxes.
    #[arg(long, help_heading = "Output")]
    pictures: bool,
}

pub fn run(args: &DetectArgs, terminal: Terminal) -> Result<()> {
    let files = args.files()?;
    let config = DetectorConfig { score_threshold: args.score, iou_threshold: args.iou, ..Default::default() };
    let LoadedDetector { detector, times, identity } = detector::load(&args.detector, config)?;
    let mut detector = InstanceDetector::new(detector);
    let known = detector.network_classes().to_vec();
    if let Some(unknown) = args.classes.iter().find(|class| !known.contains(class)) {
        bail!("the network does not know the class '{unknown}' (--class); it knows: {}", known.join(", "));
    }
    let out = OutputFolder::prepare(Some(&args.out), "detect")?;
    let pictures = args.pictures.then(|| pictures(&out)).transpose()?;
    let wanted = |class: &&str| args.classes.is_empty() || args.classes.iter().any(|asked| asked == class);
    let mut list = DetectionsFile {
        yfslam: env!("CARGO_PKG_VERSION"),
        model: &identity,
        score_threshold: args.score,
        classes: known.iter().map(String::as_str).filter(wanted).collect(),
        images: Vec::new(),
    };
    let mut progress = Progress::new(terminal, "detect", files.len());
    let mut upright = Upright::default();
    for (index, file) in files.iter().enumerate() {
        let result = match detect(file, &mut detector, &mut upright, args.roll) {
            Ok((image, detections)) => {
                let mask = upright.mask(&detector);
                let of = |d: Detection| {
                    let class = detector.class_names().get(d.class).map(String::as_str).filter(wanted)?;
                    Some(ObjectBox::new(d, class, mask))
                };
                let boxes: Vec<ObjectBox> = detections.into_iter().filter_map(of).collect();
                if let Some(folder) = &pictures {
                    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
                    write_color_png(&folder.join(format!("{index:06}-{stem}.png")), &list.draw(&image, &boxes))?;
                }
                ImageResult::Detected { width: image.width(), height: image.height(), boxes }
            }
            Err(error) => ImageResult::Unreadable { error: explain(&error) },
        };
        let found = ImageDetections { file: file.display().to_string(), result };
        if found.is_unreadable() {
            terminal.warn(&found.to_string());
        } else if files.len() <= TOLD {
            terminal.result(&format!("{found}\n"))?;
        }
        list.images.push(found);
        progress.at(index + 1, "images", String::new);
    }
    progress.finish();
    list.write(&out.path().join("boxes.json"))?;
    let took: Vec<Duration> = times.try_iter().map(|took| took.wall).collect();
    let median = StageSummary::of(&took).map_or(String::new(), |s| format!("; {:.2} ms an image", s.median_ms));
    terminal.result(&format!(
        "{}, by the {identity}{median}\nwritten to {}\n",
        list.summary(),
        out.path().display()
    ))?;
    let unread = list.images.iter().filter(|image| image.is_unreadable()).count();
    ensure!(
        unread == 0,
        "{unread} of {} images could not be read; see the warnings, or `error` in boxes.json",
        files.len()
    );
    Ok(())
}

impl DetectArgs {
    /// The images, folders replaced by what they hold, in the order of names.
    fn files(&self) -> Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        for path in &self.paths {
            if path.is_dir() {
                files.extend(images_in(path)?);
            } else {
                ensure!(path.exists(), "there is no {}; check the path", path.display());
                files.push(path.clone());
            }
        }
        Ok(files)
    }
}

fn images_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let cannot = || format!("cannot read the folder {}", folder.display());
    let is_image = |path: &PathBuf| {
        let kind = path.extension().map(|kind| kind.to_string_lossy().to_ascii_lowercase());
        path.is_file() && kind.is_some_and(|kind| KINDS.contains(&kind.as_str()))
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        files.push(entry.with_context(cannot)?.path());
    }
    files.retain(is_image);
    files.sort();
    match folder.join("rgb") {
        _ if !files.is_empty() => Ok(files),
        colour if colour.is_dir() => {
            bail!("{} holds no images; did you mean {}?", folder.display(), colour.display())
        }
        _ => bail!("{} holds no images: files named .png, .jpg or .jpeg", folder.display()),
    }
}

/// The folder for pictures, without those of an earlier run.
fn pictures(out: &OutputFolder) -> Result<PathBuf> {
    let folder = out.path().join("pictures");
    let is_ours = |name: &str| name.ends_with(".png") && name.bytes().take_while(u8::is_ascii_digit).count() >= 6;
    remove_files(&folder, is_ours)?;
    Ok(folder)
}

/// Reads an image and finds boxes in it, where the camera was rolled by `roll_deg`.
fn detect(
    file: &Path,
    detector: &mut InstanceDetector,
    upright: &mut Upright,
    roll_deg: i32,
) -> Result<(RgbImage, Vec<Detection>)> {
    let bytes = std::fs::read(file).with_context(|| format!("{} cannot be read", file.display()))?;
    let (mut image, mut found) = (RgbImage::default(), Vec::new());
    decode_color(&bytes, None, &mut image).map_err(|error| anyhow!("{} {error}", file.display()))?;
    upright.detect(detector, &image, roll_deg, &mut found).with_context(|| file.display().to_string())?;
    Ok((image, found))
}
