//! A process of `ffmpeg` that decodes a video from its first frame on.
//!
//! Pixels come through one pipe, and through another what the filter `showinfo` says of each frame: its time and size. So a frame that the
//! decoder leaves out is noticed, and no later one takes its place.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use super::probe::{MAX_MESSAGE, Probe, input, missing};
use crate::decode::{ImageSize, MAX_PIXELS};
use crate::error::{Error, Result};

/// Exact conversion to red, green and blue, which does not depend on the processor.
const FILTER: &str = "scale=flags=bicubic+accurate_rnd+full_chroma_int+bitexact,format=rgb24,showinfo=checksum=0";

/// Lines of messages that are kept.
const MAX_LINES: usize = 8;

/// What is said of a frame before its pixels come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Head {
    /// In units of the time base; `None` if it has no time.
    time: Option<i64>,
    size: ImageSize,
}

/// A running decoder.
#[derive(Debug)]
pub struct Decoder {
    child: Child,
    pixels: ChildStdout,
    heads: Receiver<Head>,
    messages: Arc<Mutex<VecDeque<String>>>,
    /// A frame whose pixels are read next, if its head was read already, and its index.
    next: Option<(usize, Head)>,
    /// Number of heads that were read.
    heads_read: usize,
    /// The first frame that can still be read.
    at: usize,
}

impl Decoder {
    /// Starts `ffmpeg`.
    pub fn start(path: &Path, probe: &Probe) -> Result<Self> {
        let mut command = Command::new("ffmpeg");
        command.args([
            "-hide_banner",
            "-nostdin",
            "-nostats",
            "-loglevel",
            "level+info",
            "-protocol_whitelist",
            "file",
        ]);
        command.args(["-copyts", "-i"]).arg(input(path)).args(["-map", "0:V:0", "-vf", FILTER]);
        command.args([if probe.is_recent { "-fps_mode" } else { "-vsync" }, "passthrough"]);
        command.args(["-pix_fmt", "rgb24", "-f", "rawvideo", "-"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C ends the program in order; the frame in work must not be lost by it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|error| missing(path, "ffmpeg", &error))?;
        let (Some(pixels), Some(log)) = (child.stdout.take(), child.stderr.take()) else {
            let _ = child.kill();
            return Err(missing(path, "ffmpeg", &std::io::ErrorKind::BrokenPipe.into()));
        };
        let (sender, heads) = channel();
        let messages = Arc::default();
        let to = Arc::clone(&messages);
        let started = thread::Builder::new().name("yfslam-ffmpeg".into()).spawn(move || {
            listen(BufReader::new(log), &sender, &to);
        });
        let decoder = Self { child, pixels, heads, messages, next: None, heads_read: 0, at: 0 };
        match started {
            Ok(_) => Ok(decoder),
            Err(error) => {
                let problem = format!("cannot start a thread: {error}");
                Err(Error::argument(problem, "raise the limit of threads for this user"))
            }
        }
    }

    /// Returns whether a frame is still to come.
    pub fn can_read(&self, frame: usize) -> bool {
        frame >= self.at
    }

    /// Reads the frame with this index in the list, and passes over those before it.
    pub fn read(&mut self, path: &Path, probe: &Probe, frame: usize, pixels: &mut Vec<u8>) -> Result<ImageSize> {
        loop {
            let (index, head) = match self.next.take() {
                Some(next) => next,
                None => self.head(path, probe, frame)?,
            };
            if index > frame {
                // It stays for its own turn.
                self.next = Some((index, head));
                self.at = frame + 1;
                let cure = "the video is damaged there; the other frames are used";
                return Err(Error::content(path, format!("ffmpeg does not decode frame {frame}"), cure));
            }
            self.at = index + 1;
            pixels.resize(head.size.width * head.size.height * 3, 0);
            if self.pixels.read_exact(pixels).is_err() {
                return Err(self.ended(path, frame));
            }
            if index == frame {
                return Ok(head.size);
            }
        }
    }

    /// Waits for the next frame that is in the list; returns its index.
    fn head(&mut self, path: &Path, probe: &Probe, frame: usize) -> Result<(usize, Head)> {
        loop {
            let Ok(head) = self.heads.recv() else { return Err(self.ended(path, frame)) };
            let count = self.heads_read;
            self.heads_read += 1;
            let size = head.size;
            if size.width.checked_mul(size.height).is_none_or(|pixels| pixels == 0 || pixels > MAX_PIXELS) {
                return Err(Error::content(
                    path,
                    format!("has frames of {size} pixels"),
                    "scale the video with ffmpeg",
                ));
            }
            let index = match (&probe.times, head.time) {
                (Some(times), Some(time)) => times.binary_search(&time).ok(),
                (Some(_), None) => None,
                (None, _) => Some(count).filter(|count| *count < probe.frames),
            };
            match index {
                Some(index) if index >= self.at => return Ok((index, head)),
                // A frame that was not listed, or comes twice.
                _ => {
                    let length = (size.width * size.height * 3) as u64;
                    let passed = std::io::copy(&mut (&mut self.pixels).take(length), &mut std::io::sink());
                    if !passed.is_ok_and(|passed| passed == length) {
                        return Err(self.ended(path, frame));
                    }
                }
            }
        }
    }

    /// Says why there are no more frames.
    fn ended(&mut self, path: &Path, frame: usize) -> Error {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
        let said: Vec<&str> = messages.iter().map(String::as_str).collect();
        let said = if said.is_empty() { String::new() } else { format!(": {}", said.join("; ")) };
        let problem = format!("ffmpeg ends before frame {frame}{said}");
        Error::content(path, problem, "check that a player shows the whole video")
    }
}

impl Drop for Decoder {
    fn drop(&mut self) {
        // Its frames are not wanted any more: what it says about that does not matter.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads what `ffmpeg` writes: heads of frames, and messages of errors.
fn listen(mut log: impl BufRead, heads: &Sender<Head>, messages: &Mutex<VecDeque<String>>) {
    let mut line = Vec::new();
    loop {
        line.clear();
        // A line of user data may be long; its rest is taken for another line, which says nothing.
        match (&mut log).take(MAX_MESSAGE).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        let text = String::from_utf8_lossy(&line);
        if let Some(head) = head(&text) {
            if heads.send(head).is_err() {
                return;
            }
        } else if text.contains("[error]") || text.contains("[fatal]") {
            let mut messages = messages.lock().unwrap_or_else(PoisonError::into_inner);
            messages.push_back(text.trim().to_owned());
            if messages.len() > MAX_LINES {
                messages.pop_front();
            }
        }
    }
}

/// Reads a line of `showinfo` such as `[Parsed_showinfo_2 @ 0x5d] [info] n:   1 pts:     33 pts_time:0.033 … s:64x48 i:P`.
fn head(line: &str) -> Option<Head> {
    let fields = line.strip_prefix("[Parsed_showinfo_")?.split_once("] [info] n:")?.1;
    let after = |key: &str| fields.split_once(key)?.1.split_whitespace().next();
    let (width, height) = after(" s:")?.split_once('x')?;
    let size = ImageSize { width: width.parse().ok()?, height: height.parse().ok()? };
    Some(Head { time: after(" pts:")?.parse().ok(), size })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_showinfo_are_read_and_others_are_not() {
        let size = ImageSize { width: 64, height: 48 };
        let line = "[Parsed_showinfo_2 @ 0x55] [info] n:   1 pts:     33 pts_time:0.033   pos: 1350 fmt:rgb24 sar:1/1 s:64x48 i:P \n";
        assert_eq!(head(line), Some(Head { time: Some(33), size }));
        assert_eq!(head(&line.replace("    33 ", "NOPTS ")), Some(Head { time: None, size }));
        for other in ["[Parsed_showinfo_2 @ 0x55] [info] config in time_base: 1/1000", "[info] n: 0 pts: 0 s:1x1", ""] {
            assert_eq!(head(other), None, "{other}");
        }
    }
}
