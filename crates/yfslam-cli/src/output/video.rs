//! `--video`: the overlay of every frame as a film.
//!
//! In: images. Out: MP4 or GIF, which the program `ffmpeg` encodes, or an animated PNG, which needs no other program.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use yfslam::RgbImage;
use yfslam_io::write_atomically;

use crate::draw::animated_png::AnimatedPng;
use crate::draw::shrink::shrink;

/// Most images of an animated PNG, which has no compression over time.
const MAX_PNG_IMAGES: usize = 400;
/// Longest message of ffmpeg that is passed on, bytes.
const MAX_MESSAGE: u64 = 2000;
/// Colours and size of a GIF.
const GIF_FILTER: &str = "scale='min(iw,480)':-1,split[a][b];[a]palettegen[p];[b][p]paletteuse";
/// MP4 players need an even width and height.
const MP4_FILTER: &str = "pad=ceil(iw/2)*2:ceil(ih/2)*2";

/// Writes a film.
pub struct Video {
    path: PathBuf,
    fps: f64,
    encoder: Encoder,
}

enum Encoder {
    /// ffmpeg starts with the first image, whose size it must be told.
    Waiting,
    Ffmpeg {
        child: Child,
        part: PathBuf,
        size: [usize; 2],
    },
    Png {
        film: AnimatedPng,
        step: usize,
        images: usize,
    },
}

impl Video {
    /// Prepares a film of `total` images at most.
    ///
    /// # Errors
    /// The ending of the name is not one of a film, or the program `ffmpeg` is needed and missing.
    pub fn create(path: &Path, fps: f64, total: usize) -> Result<Self> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let encoder = match extension.as_deref() {
            Some("mp4" | "gif") => {
                let found = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
                ensure!(
                    found.is_ok_and(|status| status.success()),
                    "--video {}: the program ffmpeg is needed and was not found; install it, or give a name that ends in .apng, for which it is \
                     not needed",
                    path.display()
                );
                Encoder::Waiting
            }
            Some("apng" | "png") => {
                Encoder::Png { film: AnimatedPng::default(), step: total.div_ceil(MAX_PNG_IMAGES).max(1), images: 0 }
            }
            _ => bail!("--video {} is no film; give a name that ends in .mp4, .gif or .apng", path.display()),
        };
        Ok(Self { path: path.to_owned(), fps: if (1.0..=240.0).contains(&fps) { fps } else { 30.0 }, encoder })
    }

    /// Adds an image. All must have the same size.
    ///
    /// # Errors
    /// The image cannot be encoded.
    pub fn write(&mut self, image: &RgbImage) -> Result<()> {
        if matches!(self.encoder, Encoder::Waiting) {
            self.encoder = self.start([image.width(), image.height()])?;
        }
        match &mut self.encoder {
            Encoder::Waiting => Ok(()),
            Encoder::Ffmpeg { child, size, .. } => {
                ensure!(*size == [image.width(), image.height()], "--video: the size of the images has changed");
                let Some(pipe) = &mut child.stdin else { return Ok(()) };
                match pipe.write_all(image.data().as_flattened()) {
                    Ok(()) => Ok(()),
                    // It has ended, and says why.
                    Err(_) => bail!("--video {}: ffmpeg has failed: {}", self.path.display(), message(child)),
                }
            }
            Encoder::Png { film, step, images } => {
                let is_shown = images.is_multiple_of(*step);
                *images += 1;
                if is_shown { film.push(&shrink(image.clone())) } else { Ok(()) }
            }
        }
    }

    /// Ends the film and puts the file in its place; without images there is none.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> Result<()> {
        match std::mem::replace(&mut self.encoder, Encoder::Waiting) {
            Encoder::Waiting => Ok(()),
            Encoder::Ffmpeg { mut child, part, .. } => {
                drop(child.stdin.take());
                let text = message(&mut child);
                let status = child.wait()?;
                if !status.success() {
                    let _ = std::fs::remove_file(&part);
                    bail!("--video {}: ffmpeg has failed: {text}", self.path.display());
                }
                std::fs::rename(&part, &self.path).with_context(|| format!("cannot write {}", self.path.display()))
            }
            Encoder::Png { film, step, .. } => {
                let bytes = film.finish(step as f64 / self.fps);
                Ok(write_atomically(&self.path, |file| file.write_all(&bytes))?)
            }
        }
    }

    /// Starts ffmpeg, which writes a file beside that of the user.
    fn start(&self, size: [usize; 2]) -> Result<Encoder> {
        let is_gif = self.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gif"));
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        yfslam_io::prepare_folder(folder)?;
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let part = folder.join(format!(".yfslam-video-{}-{name}", std::process::id()));
        let mut command = Command::new("ffmpeg");
        command.args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"]);
        command.arg(format!("{}x{}", size[0], size[1])).arg("-r").arg(self.fps.to_string()).args(["-i", "-"]);
        match is_gif {
            true => command.args(["-filter_complex", GIF_FILTER, "-f", "gif"]),
            false => command.args(["-vf", MP4_FILTER, "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]),
        };
        command.arg(&part).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let child = command
            .spawn()
            .context("--video: ffmpeg cannot be started; install it, or use a name that ends in .apng")?;
        Ok(Encoder::Ffmpeg { child, part, size })
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        if let Encoder::Ffmpeg { child, part, .. } = &mut self.encoder {
            // The film is not wanted: what ffmpeg says about it does not matter.
            let _ = child.kill();
            let _ = child.wait();
            let _ = std::fs::remove_file(part);
        }
    }
}

/// Returns what ffmpeg has written to standard error.
fn message(child: &mut Child) -> String {
    let mut text = Vec::new();
    if let Some(pipe) = child.stderr.take() {
        let _ = pipe.take(MAX_MESSAGE).read_to_end(&mut text);
    }
    String::from_utf8_lossy(&text).trim().to_owned()
}
