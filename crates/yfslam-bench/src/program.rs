//! Runs the program `yfslam` as a process of its own and reads what it leaves.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// The program, the folder of the recordings and a folder for outputs.
#[derive(Clone, Debug)]
pub struct Program {
    /// The program.
    pub path: PathBuf,
    /// The folder with `rgbd/` and `models/`.
    pub data: PathBuf,
    /// The folder for outputs, which is removed after each job.
    pub out: PathBuf,
}

impl Program {
    /// Runs the program with these arguments and waits for its end. Returns its standard output and the processor time of
    /// all its threads, in user and system mode, as the operating system counts it, s.
    ///
    /// # Errors
    /// The program cannot be started, or ends without success; the error has what it wrote to standard error.
    pub fn run(&self, arguments: &[String]) -> Result<(String, f64)> {
        let (text, processor_s, code) = self.try_run(arguments)?;
        if code != Some(0) {
            bail!("{} failed: {text}", self.command(arguments));
        }
        Ok((text, processor_s))
    }

    /// As [`run`](Self::run), but also takes a program that ends without success: the last value is its exit status,
    /// `None` if a signal ended it.
    ///
    /// # Errors
    /// The program cannot be started.
    pub fn try_run(&self, arguments: &[String]) -> Result<(String, f64, Option<i32>)> {
        std::fs::create_dir_all(&self.out).with_context(|| format!("cannot make {}", self.out.display()))?;
        let [stdout, stderr] = ["stdout.txt", "stderr.txt"].map(|name| self.out.join(name));
        let file =
            |path: &Path| std::fs::File::create(path).with_context(|| format!("cannot write {}", path.display()));
        let child = Command::new(&self.path)
            .args(arguments.iter().map(OsString::from))
            .stdin(Stdio::null())
            .stdout(file(&stdout)?)
            .stderr(file(&stderr)?)
            .spawn()
            .with_context(|| format!("cannot run {}", self.path.display()))?;
        let (code, processor_s) = wait(child)?;
        let text = std::fs::read_to_string(if code == Some(0) { stdout } else { stderr })?;
        Ok((text, processor_s, code))
    }

    /// The command as it is printed, with `DATA` and `OUT` for the folders of this machine.
    pub fn command(&self, arguments: &[String]) -> String {
        let shorten = |word: &String| {
            let word = word.replace(&*self.data.to_string_lossy(), "DATA").replace(&*self.out.to_string_lossy(), "OUT");
            if word.contains(['?', '&', ' ']) { format!("'{word}'") } else { word }
        };
        let words: Vec<_> = arguments.iter().map(shorten).collect();
        format!("yfslam {}", words.join(" "))
    }
}

/// `run.json` in the output folder of a run.
///
/// # Errors
/// The file is not there or is not JSON.
pub fn read_run(folder: &Path) -> Result<Value> {
    let path = folder.join("run.json");
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not JSON", path.display()))
}

/// Waits for the end of a process. The operating system accounts for exactly this process and the threads and children it waited for.
#[cfg(unix)]
fn wait(child: std::process::Child) -> Result<(Option<i32>, f64)> {
    let process = libc::pid_t::try_from(child.id()).context("the process number is too large")?;
    let mut status = 0;
    let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
    loop {
        // SAFETY: both pointers are to values that live through the call, and all bits of an `rusage` may be zero.
        let ended = unsafe { libc::wait4(process, &mut status, 0, usage.as_mut_ptr()) };
        if ended == process {
            break;
        }
        let error = std::io::Error::last_os_error();
        if error.kind() != std::io::ErrorKind::Interrupted {
            return Err(error).context("cannot wait for the process");
        }
    }
    // SAFETY: it was zeroed, and `wait4` has filled it.
    let usage = unsafe { usage.assume_init() };
    let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
    let code = libc::WIFEXITED(status).then(|| libc::WEXITSTATUS(status));
    Ok((code, seconds(usage.ru_utime) + seconds(usage.ru_stime)))
}

#[cfg(not(unix))]
fn wait(mut child: std::process::Child) -> Result<(Option<i32>, f64)> {
    let status = child.wait().context("cannot wait for the process")?;
    Ok((status.code(), f64::NAN))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn processor_time_of_a_finished_process_is_counted_and_its_failure_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().to_owned();
        let program = Program { path: "/bin/sh".into(), data: "/data".into(), out: out.clone() };
        let script = "i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done; echo $i".to_owned();
        let (text, processor_s) = program.run(&["-c".into(), script]).unwrap();
        assert_eq!(text.trim(), "100000");
        assert!(processor_s > 0.0);
        assert!(
            program.run(&["-c".into(), "echo cause >&2; exit 3".into()]).unwrap_err().to_string().contains("cause")
        );
        assert_eq!(
            program.command(&["run".into(), "/data/rgbd/a".into(), "synth:w?x".into()]),
            "yfslam run DATA/rgbd/a 'synth:w?x'"
        );
    }
}
