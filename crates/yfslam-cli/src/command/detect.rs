//! `yfslam detect`: detections in images.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Args;
use yfslam::{Detection, Detector, RgbImage, RollCompensation};
use yfslam_detect::DetectorConfig;
use yfslam_io::decode::decode_photo;
use yfslam_io::write::write_color_png;
use yfslam_io::{prepare_folder, read_file};

use crate::input::detector::{self, DetectorArgs, LoadedDetector};
use crate::input::instance_detector::InstanceDetector;
use crate::output::detections_file::{DetectionsFile, ImageDetections, ImageResult, ObjectBox};
use crate::output::folder::{OutputFolder, remove_files};
use crate::stats::stages::StageSummary;
use crate::ui::failures::Failures;
use crate::ui::interrupt::Interrupt;
use crate::ui::progress::Progress;
use crate::ui::terminal::{Terminal, explain};

const HELP: &str = "\
Examples:
  yfslam detect photo.jpg --images
  yfslam detect rgbd_bonn_crowd/rgb --score 0.5 -o crowd
  yfslam detect images/ --detector yolo-fastestv2.onnx --class person,chair
  yfslam detect images/ --roll 90      images of a camera that lay on its right side

Files in the output folder:
  boxes.json   one line for each image: class, score and bounding box (left, top, right, bottom, px) of each object; from a network
               that segments also its mask as COCO's run-length encoding, column by column
  images/      with --images, each image with boxes and masks; the bar in a box shows the score

Exit status:
  Success if every image could be read. Otherwise the boxes of the other images are written.";

/// Extensions of the files that are read from a folder.
const EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];
/// Largest number of images whose detections are printed one by one.
const MAX_PRINTED: usize = 20;

/// Detect people in images; writes bounding boxes as JSON, and images with boxes.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct DetectArgs {
    /// Images in PNG or JPEG format, and folders of images.
    #[arg(value_name = "IMAGE|FOLDER", required = true)]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    detector: DetectorArgs,
    /// Lowest score of a box, between 0 and 1.
    #[arg(long, value_name = "SCORE", default_value_t = 0.3, allow_negative_numbers = true, help_heading = "System")]
    score: f32,
    /// Intersection over union above which only the better of two boxes of a class is kept.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, allow_negative_numbers = true, help_heading = "System")]
    iou: f32,
    /// Report only these classes [default: all classes of the network].
    #[arg(long = "class", value_name = "NAME,NAME", value_delimiter = ',', help_heading = "System")]
    classes: Vec<String>,
    /// Clockwise roll of the camera, degrees; images are turned upright for the detector.
    #[arg(long, value_name = "DEGREES", default_value_t = 0, allow_negative_numbers = true, help_heading = "System")]
    #[arg(value_parser = clap::value_parser!(i32).range(-180..=180))]
    roll: i32,
    /// Output folder.
    #[arg(short, long, value_name = "DIR", default_value = "yfslam-out/detect", help_heading = "Output")]
    out: PathBuf,
    /// Write each image with its boxes.
    #[arg(long, alias = "pictures", help_heading = "Output")]
    images: bool,
}

pub fn run(args: &DetectArgs, terminal: Terminal) -> Result<()> {
    let interrupt = Interrupt::watch()?;
    let files = args.files()?;
    let config = DetectorConfig { score_threshold: args.score, iou_threshold: args.iou, ..Default::default() };
    let LoadedDetector { detector, times, identity } = detector::load(&args.detector, config)?;
    let mut detector = InstanceDetector::new(detector);
    let class_names = detector.network_classes().to_vec();
    if let Some(unknown) = args.classes.iter().find(|class| !class_names.contains(class)) {
        bail!("the network does not have the class '{unknown}' (--class); its classes are: {}", class_names.join(", "));
    }
    let out = OutputFolder::prepare(Some(&args.out), "detect")?;
    let images = args.images.then(|| image_folder(&out)).transpose()?;
    let wanted = |class: &&str| args.classes.is_empty() || args.classes.iter().any(|asked| asked == class);
    let mut list = DetectionsFile {
        yfslam: env!("CARGO_PKG_VERSION"),
        model: &identity,
        score_threshold: args.score,
        classes: class_names.iter().map(String::as_str).filter(wanted).collect(),
        images: Vec::new(),
    };
    let mut progress = Progress::new(terminal, "detect", files.len());
    let mut upright = RollCompensation::default();
    let mut failures = Failures::new(terminal);
    let mut printed = Ok(());
    for (index, file) in files.iter().enumerate() {
        if interrupt.received().is_some() {
            break;
        }
        let result = match detect(file, &mut detector, &mut upright, args.roll) {
            Ok((image, detections)) => {
                let mask = upright.mask(&detector);
                let of = |d: Detection| {
                    let class = detector.class_names().get(d.class).map(String::as_str).filter(wanted)?;
                    Some(ObjectBox::new(d, class, mask))
                };
                let boxes: Vec<ObjectBox> = detections.into_iter().filter_map(of).collect();
                if let Some(folder) = &images {
                    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
                    let path = folder.join(format!("{index:06}-{stem}.png"));
                    failures.keep(write_color_png(&path, &list.draw(&image, &boxes)));
                }
                ImageResult::Detected { width: image.width(), height: image.height(), boxes }
            }
            Err(error) => ImageResult::Unreadable { error: explain(&error) },
        };
        let found = ImageDetections { file: file.display().to_string(), result };
        if found.is_unreadable() {
            terminal.warn(&found.to_string());
        } else if files.len() <= MAX_PRINTED {
            // Detection goes on for `boxes.json` although the results cannot be printed any more.
            printed = printed.and_then(|()| terminal.result(&format!("{found}\n")));
        }
        list.images.push(found);
        progress.at(index + 1, "images", String::new);
    }
    progress.finish();
    failures.keep(list.write(&out.path().join("boxes.json")));
    let took: Vec<Duration> = times.try_iter().map(|took| took.wall).collect();
    let median = StageSummary::of(&took).map_or(String::new(), |s| format!("; {:.2} ms an image", s.median_ms));
    let summary = format!("{}, with the {identity}{median}\nwritten to {}\n", list.summary(), out.path().display());
    printed = printed.and_then(|()| terminal.result(&summary));
    failures.check()?;
    interrupt.check()?;
    let unreadable = list.images.iter().filter(|image| image.is_unreadable()).count();
    ensure!(
        unreadable == 0,
        "{unreadable} of {} images could not be read; see the warnings, or `error` in boxes.json",
        files.len()
    );
    printed
}

impl DetectArgs {
    /// Returns the images; folders are replaced by their images in the order of names.
    fn files(&self) -> Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        for path in &self.paths {
            if path.is_dir() {
                files.extend(images_in(path)?);
            } else {
                ensure!(path.exists(), "{} does not exist; check the path", path.display());
                files.push(path.clone());
            }
        }
        Ok(files)
    }
}

fn images_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let cannot = || format!("cannot read the folder {}", folder.display());
    let is_image = |path: &PathBuf| {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        path.is_file() && extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str()))
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
        _ => bail!("{} holds no images, which are files named .png, .jpg or .jpeg", folder.display()),
    }
}

/// Returns the folder for images; removes the images of an earlier run.
fn image_folder(out: &OutputFolder) -> Result<PathBuf> {
    let folder = out.path().join("images");
    prepare_folder(&folder).with_context(|| format!("--images: the folder {} cannot be used", folder.display()))?;
    let is_ours = |name: &str| name.ends_with(".png") && name.bytes().take_while(u8::is_ascii_digit).count() >= 6;
    remove_files(&folder, is_ours)?;
    Ok(folder)
}

/// Reads an image and detects objects in it; the camera was rolled by `roll_deg`.
fn detect(
    file: &Path,
    detector: &mut InstanceDetector,
    upright: &mut RollCompensation,
    roll_deg: i32,
) -> Result<(RgbImage, Vec<Detection>)> {
    let bytes = read_file(file).with_context(|| format!("{} cannot be read", file.display()))?;
    let mut found = Vec::new();
    let image = decode_photo(&bytes).map_err(|error| anyhow!("{} {error}", file.display()))?;
    upright.detect(detector, &image, roll_deg, &mut found).with_context(|| file.display().to_string())?;
    Ok((image, found))
}
