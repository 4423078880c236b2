//! Lists the frames of a video with `ffprobe`, from its index and without decoding.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;
use std::process::{Command, Stdio};

use super::INSTALL;
use crate::error::{Error, Result};

/// Most frames that are listed: four days at 60 Hz. It bounds the memory that a forged file can request.
const MAX_FRAMES: usize = 20_000_000;

/// Longest message of a program that is passed on, bytes.
pub const MAX_MESSAGE: u64 = 2000;

/// What `ffprobe` says of the video stream.
#[derive(Debug)]
pub struct Probe {
    /// Number of frames.
    pub frames: usize,
    /// Times of the frames in units of the time base, ascending; `None` if some have no time.
    pub times: Option<Vec<i64>>,
    /// The unit of the times, seconds: numerator and denominator.
    pub time_base: (i64, i64),
    /// Whether `ffmpeg` is of version 5 or later, in which the name of an option is another one.
    pub is_recent: bool,
}

impl Probe {
    /// Asks `ffprobe`.
    pub fn of(path: &Path) -> Result<Self> {
        let is_recent = is_recent(path)?;
        let mut command = Command::new("ffprobe");
        command.args(["-v", "error", "-protocol_whitelist", "file", "-select_streams", "V:0"]);
        command.args(["-show_entries", "stream=time_base:packet=pts,flags", "-of", "csv"]).arg(input(path));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| missing(path, "ffprobe", &error))?;
        let (Some(stdout), Some(mut stderr)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(missing(path, "ffprobe", &ErrorKind::BrokenPipe.into()));
        };
        // Its messages are few; they are read beside the list, so that neither waits for the other.
        let messages = std::thread::spawn(move || {
            let mut text = Vec::new();
            let _ = (&mut stderr).take(MAX_MESSAGE).read_to_end(&mut text);
            let _ = std::io::copy(&mut stderr, &mut std::io::sink());
            String::from_utf8_lossy(&text).trim().to_owned()
        });
        let mut listed = Listed::default();
        for line in BufReader::new(stdout).lines() {
            listed.add(&line.map_err(|source| Error::read(path, source))?);
        }
        let status = child.wait().map_err(|source| Error::read(path, source))?;
        let message = messages.join().unwrap_or_default();
        let cure = "check that a player shows it; a damaged file may be repaired with ffmpeg -i OLD -c copy NEW.mkv";
        match listed.time_base {
            Some(time_base) if status.success() && listed.frames > 0 => {
                let times = (listed.times.len() == listed.frames).then_some(listed.times);
                let times = times.map(|mut times| {
                    times.sort_unstable();
                    times.dedup();
                    times
                });
                let frames = times.as_ref().map_or(listed.frames, Vec::len);
                Ok(Self { frames, times, time_base, is_recent })
            }
            _ if message.is_empty() => Err(Error::content(path, "has no video that ffprobe can read", cure)),
            _ => Err(Error::content(path, format!("ffprobe cannot read it: {message}"), cure)),
        }
    }

    /// Returns the times of the frames, ns.
    pub fn stamps_ns(&self) -> Option<Vec<i64>> {
        let (numerator, denominator) = (i128::from(self.time_base.0), i128::from(self.time_base.1));
        let nanoseconds = |&time: &i64| {
            let scaled = i128::from(time) * numerator * 1_000_000_000;
            let half = if scaled < 0 { -denominator / 2 } else { denominator / 2 };
            i64::try_from((scaled + half) / denominator).ok()
        };
        self.times.as_ref()?.iter().map(nanoseconds).collect()
    }
}

/// What the lines of `ffprobe` say.
#[derive(Default)]
struct Listed {
    frames: usize,
    times: Vec<i64>,
    time_base: Option<(i64, i64)>,
}

impl Listed {
    fn add(&mut self, line: &str) {
        let mut words = line.trim().split(',');
        match (words.next(), words.next(), words.next()) {
            // A packet that an edit list discards gives no frame.
            (Some("packet"), Some(_), Some(flags)) if flags.contains('D') => {}
            (Some("packet"), Some(time), _) if self.frames < MAX_FRAMES => {
                self.frames += 1;
                self.times.extend(time.parse::<i64>().ok());
            }
            (Some("stream"), Some(base), _) => {
                let parts = base.split_once('/').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
                self.time_base = parts.filter(|(a, b): &(i64, i64)| *a > 0 && *b > 0);
            }
            _ => {}
        }
    }
}

/// Names a file for both programs, whatever its name looks like.
pub fn input(path: &Path) -> OsString {
    let mut name = OsString::from("file:");
    name.push(path);
    name
}

/// Says that a program cannot be started.
pub fn missing(path: &Path, program: &str, error: &std::io::Error) -> Error {
    if error.kind() == ErrorKind::NotFound {
        let problem = format!("is a video, and the program {program} was not found: ffmpeg and ffprobe decode videos");
        return Error::content(path, problem, INSTALL);
    }
    Error::content(path, format!("the program {program} cannot be started: {error}"), INSTALL)
}

/// Returns whether `ffmpeg` is of version 5 or later; builds without a version number are.
fn is_recent(path: &Path) -> Result<bool> {
    let output = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output();
    let text = output.map_err(|error| missing(path, "ffmpeg", &error))?.stdout;
    Ok(major_version(&String::from_utf8_lossy(&text)).is_none_or(|major| major >= 5))
}

fn major_version(text: &str) -> Option<u32> {
    let version = text.strip_prefix("ffmpeg version ")?.trim_start_matches('n');
    version.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_of_distributions_and_of_development_are_read() {
        for (text, major) in [
            ("ffmpeg version 4.4.2-0ubuntu0.22.04.1 Copyright", Some(4)),
            ("ffmpeg version 5.1.9-0+deb12u1 Copyright", Some(5)),
            ("ffmpeg version n7.1 Copyright", Some(7)),
            ("ffmpeg version N-109542-g4b0b1b5 Copyright", None),
            ("", None),
        ] {
            assert_eq!(major_version(text), major, "{text}");
        }
    }

    #[test]
    fn times_are_sorted_discarded_packets_left_out_and_rounded_to_nanoseconds() {
        let mut listed = Listed::default();
        for line in ["packet,0,K_", "packet,2048,__", "packet,512,__", "packet,-1024,KD", "stream,1/15360"] {
            listed.add(line);
        }
        assert_eq!((listed.frames, &listed.times[..], listed.time_base), (3, &[0, 2048, 512][..], Some((1, 15360))));
        let probe = Probe { frames: 3, times: Some(vec![-512, 0, 512, 2048]), time_base: (1, 15360), is_recent: true };
        assert_eq!(probe.stamps_ns().unwrap(), [-33_333_333, 0, 33_333_333, 133_333_333]);
        listed.add("packet,N/A,K_");
        assert!(listed.times.len() < listed.frames);
    }
}
