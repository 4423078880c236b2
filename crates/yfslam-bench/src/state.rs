//! Finds out which state of the project is measured: commit, network, machine.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};

use crate::record::{Machine, State};

/// Digits of a SHA-256 that name a network.
const DIGITS: usize = 12;

/// The state of the working tree at `root`, with the network that is embedded in `program`.
///
/// # Errors
/// Git or the program does not answer, or, unless `quick`, files other than documentation have changes that are not committed.
pub fn find(root: &Path, program: &Path, quick: bool) -> Result<State> {
    let code = ["--", "crates", "Cargo.toml", "Cargo.lock", ".cargo", ":!*.md", ":!crates/yfslam-bench/src/render"];
    let changed = git(root, &[&["status", "--porcelain", "--untracked-files=no"][..], &code].concat())?;
    ensure!(
        quick || changed.is_empty(),
        "the working tree has changes that are not committed, so no commit would name what is measured; commit them:\n{changed}"
    );
    let commit = git(root, &[&["log", "-1", "--format=%H"][..], &code].concat())?;
    let commit = commit.chars().take(DIGITS).collect::<String>() + if changed.is_empty() { "" } else { "-changed" };
    Ok(State { commit, network: format!("embedded {}", embedded_network(program)?), machine: machine() })
}

fn git(root: &Path, arguments: &[&str]) -> Result<String> {
    let output = Command::new("git").current_dir(root).args(arguments).output().context("cannot run git")?;
    ensure!(output.status.success(), "git {}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr));
    Ok(String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}

/// The first digits of the SHA-256 of the network in the program, which `yfslam --version` prints.
fn embedded_network(program: &Path) -> Result<String> {
    let output = Command::new(program).arg("--version").output();
    let output =
        output.with_context(|| format!("cannot run {}; build it: cargo build --release", program.display()))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut words = text.split(|c: char| !c.is_ascii_hexdigit());
    let hash = words.find(|word| word.len() == 64).with_context(|| format!("no SHA-256 of a network in: {text}"))?;
    Ok(hash[..DIGITS].to_owned())
}

/// The name of a network in a file.
///
/// # Errors
/// The file cannot be read.
pub fn network_of_file(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let hash: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(format!("official COCO weights {}", &hash[..DIGITS]))
}

/// This machine.
pub fn machine() -> Machine {
    let information = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = information.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    Machine {
        cpu: model.map_or(std::env::consts::ARCH, |(_, name)| name.trim()).to_owned(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        simd: simd().to_owned(),
    }
}

fn simd() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512vnni") {
            return "AVX-512 with VNNI";
        }
        if is_x86_feature_detected!("avx512f") {
            return "AVX-512";
        }
        if is_x86_feature_detected!("avx2") { "AVX2" } else { "SSE" }
    }
    #[cfg(target_arch = "aarch64")]
    {
        "NEON"
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    {
        "scalar"
    }
}
