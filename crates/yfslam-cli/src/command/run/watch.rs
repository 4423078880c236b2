//! `--view`: a page that shows the run while it goes on.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use yfslam::Method;
use yfslam_view::{Address, View, ViewOptions};

use crate::input::settings::describe;
use crate::ui::interrupt::Interrupt;
use crate::ui::terminal::Terminal;

/// Time for which a run waits until a page is open.
const WAIT: Duration = Duration::from_secs(10);

/// How a run is watched.
#[derive(Args, Clone, Debug)]
pub struct WatchArgs {
    /// Serve a page that shows images, trajectory and map during the run; only programs of this machine reach it, unless an address such as
    /// 0.0.0.0:8788 is given [default of ADDR: 127.0.0.1].
    #[arg(
        long,
        value_name = "ADDR",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "127.0.0.1",
        help_heading = "Output"
    )]
    pub view: Option<Address>,
    /// Record the overlay, the camera, poses, the trajectory and landmarks as messages of ROS 2, for Foxglove, Rerun or `ros2 bag`.
    #[arg(long, value_name = "FILE.mcap", help_heading = "Output")]
    pub record: Option<PathBuf>,
    /// Make a film of the overlay: .mp4 and .gif need the program ffmpeg, .apng does not.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub video: Option<PathBuf>,
}

impl WatchArgs {
    /// Returns these options as arguments of `yfslam run`.
    pub fn arguments(&self) -> Vec<String> {
        let view = self.view.iter().map(|address| format!("--view={address}"));
        let files = [("record", &self.record), ("video", &self.video)];
        let files = files.into_iter().filter_map(|(name, path)| Some(format!("--{name}={}", path.as_ref()?.display())));
        view.chain(files).collect()
    }

    /// Starts the page, if it is asked for, and waits until it is open, but not for ever; `options` are completed.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn start_view(
        &self,
        options: ViewOptions,
        methods: &[Method],
        interrupt: &Interrupt,
        terminal: Terminal,
    ) -> Result<Option<View>> {
        let Some(address) = &self.view else { return Ok(None) };
        let runs = methods.iter().map(|method| describe(*method).0.to_owned()).collect();
        let view = View::start(address, ViewOptions { runs, can_pause: true, ..options })?;
        let (url, wait_s) = (view.url(), WAIT.as_secs());
        terminal.note(&format!("live view: {url} (the run begins when this page is opened, or after {wait_s} s)"));
        view.wait_for_viewer(WAIT, || interrupt.received().is_some());
        Ok(Some(view))
    }
}
