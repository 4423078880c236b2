//! The door of the live view.

use std::io;
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::json;
use yfslam::{Camera, Frame, Slam, Tracked};
use yfslam_eval::{AlignmentKind, DEFAULT_MAX_DIFF_NS, StampedPose};

use crate::address::Address;
use crate::align::Truth;
use crate::cells::{Cells, Keyframe};
use crate::encoder::Encoder;
use crate::guard::Guard;
use crate::map::MapCopy;
use crate::moment::{Moment, times_ms};
use crate::packet::seconds;
use crate::server::{Server, hello};
use crate::shared::{RunState, Shared, State};

/// Least time between two copies of the map.
const MAP_EVERY: Duration = Duration::from_millis(250);
/// The map is copied so seldom that it takes one of so many parts of the time.
const MAP_SHARE: u32 = 50;
/// Most poses of the ground truth that are shown.
const MAX_TRUTH: usize = 5000;
/// Time for which the end of a run waits for the encoder and the viewers.
const LAST_WORDS: Duration = Duration::from_secs(2);
/// Time between two looks at what else may end a wait.
const TICK: Duration = Duration::from_millis(100);
/// A pause ends when no page has asked for so long.
const PAUSE_WITHOUT_VIEWER: Duration = Duration::from_secs(20);

/// What the page shows besides frames.
#[derive(Clone, Debug)]
pub struct ViewOptions {
    /// Name of the recording or the robot.
    pub title: String,
    /// The camera of all runs.
    pub camera: Camera,
    /// Names of the runs that are shown beside each other, such as methods; at least one.
    pub runs: Vec<String>,
    /// Time stamp from which the page counts, ns: that of the first frame, if it is known.
    pub start_ns: Option<i64>,
    /// Number of frames, where it is known.
    pub frames: Option<usize>,
    /// Whether the page may pause: recordings can wait, cameras cannot.
    pub can_pause: bool,
    /// Ground truth, world from camera, sorted by time; empty if it is not known. It is only shown.
    pub truth: Vec<StampedPose>,
    /// How a trajectory is aligned with the ground truth.
    pub alignment: AlignmentKind,
    /// Largest difference between the time stamps of an estimated and a true pose, ns.
    pub max_diff_ns: u64,
}

impl ViewOptions {
    /// Returns the options for a live camera with one run.
    pub fn new(title: &str, camera: Camera) -> Self {
        Self {
            title: title.to_owned(),
            camera,
            runs: vec!["run".to_owned()],
            start_ns: None,
            frames: None,
            can_pause: false,
            truth: Vec::new(),
            alignment: AlignmentKind::Se3,
            max_diff_ns: DEFAULT_MAX_DIFF_NS,
        }
    }
}

/// A page that shows runs while they go on. It ends when it is dropped.
pub struct View {
    shared: Arc<Shared>,
    local: SocketAddr,
    url: String,
    threads: Vec<JoinHandle<()>>,
    /// Wall time and time stamp, ns, from which the speed of a recording is kept, and that speed.
    pace: std::sync::Mutex<Option<(Instant, i64, f64)>>,
}

impl View {
    /// Starts to serve the page.
    ///
    /// # Errors
    /// The address cannot be used, or a thread cannot be started.
    pub fn start(address: &Address, options: ViewOptions) -> io::Result<Self> {
        let listener = address.listen()?;
        let local = listener.local_addr()?;
        let runs = options.runs.iter().map(|_| RunState::default()).collect();
        let shared = Arc::new(Shared::default());
        shared.change(|state| (state.runs, state.start_ns, state.control_number) = (runs, options.start_ns, 1));
        let url = format!("http://{}/", address.with_port(local.port()));
        let server = Arc::new(Server {
            shared: shared.clone(),
            guard: Guard::new(&address.host, local),
            hello: described(&options),
        });
        let ViewOptions { camera, truth, alignment, max_diff_ns, .. } = options;
        let truth = Truth { poses: truth, alignment, max_diff_ns };
        let encoder = Encoder { shared: shared.clone(), cells: Cells::new(&camera), truth };
        let mut view = Self { shared, local, url, threads: Vec::new(), pace: std::sync::Mutex::default() };
        view.spawn("yfslam-view", move || encoder.run())?;
        view.spawn("yfslam-server", move || server.run(&listener))?;
        Ok(view)
    }

    /// Returns the address of the page.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Shows the frame that `slam` has just tracked, as one of run `run`, from 0.
    pub fn show(&self, run: usize, frame: &Frame, tracked: &Tracked, slam: &Slam) {
        let (number, is_watched, is_map_due) = {
            let mut state = self.shared.lock();
            let start_ns = *state.start_ns.get_or_insert(frame.timestamp_ns);
            let (is_watched, has_viewer) = (state.is_watched(run), state.has_viewer());
            let Some(run) = state.runs.get_mut(run) else { return };
            run.frames += 1;
            if is_watched {
                run.tick(figures(run.frames, tracked, start_ns));
            }
            let is_map_due = has_viewer && run.copy.is_none() && run.next_copy.is_none_or(|due| due <= Instant::now());
            (run.frames, is_watched, is_map_due)
        };
        // A keyframe is kept for viewers who come later.
        let keyframe = tracked.is_keyframe && frame.depth.is_some();
        if !is_watched && !is_map_due && !keyframe {
            return;
        }
        let moment = is_watched.then(|| Moment::new(number, frame, tracked, slam));
        let keyframe = keyframe.then(|| Keyframe::new(number, frame, slam));
        let copy = is_map_due.then(|| copied(slam));
        self.shared.change(|state| {
            let Some(run) = state.runs.get_mut(run) else { return };
            if let Some(moment) = moment {
                run.offer(moment);
            }
            if let Some(keyframe) = keyframe {
                run.offer_keyframe(keyframe);
            }
            if let Some((copy, next)) = copy {
                (run.copy, run.next_copy) = (Some(copy), Some(next));
            }
        });
    }

    /// Shows the map of a run as it is at its end.
    pub fn show_end(&self, run: usize, slam: &Slam) {
        if !self.shared.lock().has_viewer() {
            return;
        }
        let (copy, _) = copied(slam);
        self.shared.change(|state| {
            if let Some(run) = state.runs.get_mut(run) {
                // What the page has is older, even if no frame has come since.
                run.frames += 1;
                run.copy = Some(copy);
            }
        });
    }

    /// Waits until a page is open, at most for `at_most`, or until `stops`.
    pub fn wait_for_viewer(&self, at_most: Duration, stops: impl Fn() -> bool) {
        let until = Instant::now() + at_most;
        let mut state = self.shared.lock();
        while !state.has_viewer() && Instant::now() < until && !stops() {
            state = self.shared.wait(state, until.min(Instant::now() + TICK)).0;
        }
    }

    /// Waits while a viewer has paused the run, or until the next frame of a recording is due at the speed that a viewer has chosen. A pause
    /// ends when all pages are closed.
    pub fn pace(&self, next_ns: i64, stops: impl Fn() -> bool) {
        let mut state = self.shared.lock();
        while state.control.paused && !stops() {
            if state.control.steps > 0 {
                state.control.steps -= 1;
                return;
            }
            if state.asked.is_none_or(|asked| asked.elapsed() > PAUSE_WITHOUT_VIEWER) {
                state.control.paused = false;
            }
            *self.last_pace() = None;
            state = self.shared.wait(state, Instant::now() + TICK).0;
        }
        loop {
            let speed = state.control.speed;
            if speed <= 0.0 || stops() || state.control.paused {
                *self.last_pace() = None;
                return;
            }
            let now = Instant::now();
            let due = {
                let mut pace = self.last_pace();
                let (since, from_ns, _) = *pace.filter(|pace| pace.2 == speed).get_or_insert((now, next_ns, speed));
                *pace = Some((since, from_ns, speed));
                let passed_s = next_ns.saturating_sub(from_ns) as f64 / 1e9 / speed;
                since + Duration::try_from_secs_f64(passed_s).unwrap_or_default()
            };
            if due <= now {
                return;
            }
            state = self.shared.wait(state, due.min(now + TICK)).0;
        }
    }

    fn last_pace(&self) -> std::sync::MutexGuard<'_, Option<(Instant, i64, f64)>> {
        self.pace.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        self.threads.push(std::thread::Builder::new().name(name.into()).spawn(work)?);
        Ok(())
    }
}

impl Drop for View {
    /// Sends the last state to the pages that are open, and stops.
    fn drop(&mut self) {
        let until = Instant::now() + LAST_WORDS;
        self.shared.change(|state| state.hurries = true);
        let mut state = self.shared.lock();
        let is_idle = |state: &State| !state.has_viewer() || state.runs.iter().all(RunState::is_idle);
        while !is_idle(&state) && Instant::now() < until {
            state = self.shared.wait(state, until).0;
        }
        let has_viewer = state.has_viewer();
        drop(state);
        self.shared.change(|state| {
            (state.ended, state.control.paused) = (true, false);
            state.control_number += 1;
        });
        if has_viewer {
            // A page asks again at once: its next question, which gets the end, is answered in far less than this.
            std::thread::sleep(LAST_WORDS / 4);
        }
        self.shared.change(|state| state.closing = true);
        // The thread that accepts connections waits for one.
        let woken = TcpStream::connect_timeout(&reachable(self.local), TICK).is_ok();
        for thread in self.threads.drain(..) {
            if woken || thread.thread().name() == Some("yfslam-view") {
                // A panic there concerns the page only.
                let _ = thread.join();
            }
        }
    }
}

/// Returns an address at which a listener is reached from this machine.
fn reachable(mut local: SocketAddr) -> SocketAddr {
    if local.ip().is_unspecified() {
        local.set_ip(match local {
            SocketAddr::V4(_) => std::net::Ipv4Addr::LOCALHOST.into(),
            SocketAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
        });
    }
    local
}

/// Copies the map; returns when it is to be copied again.
fn copied(slam: &Slam) -> (MapCopy, Instant) {
    let started = Instant::now();
    let copy = MapCopy::new(slam);
    (copy, Instant::now() + MAP_EVERY.max(started.elapsed() * MAP_SHARE))
}

/// Returns number, time, inliers and duration of a frame.
fn figures(number: u64, tracked: &Tracked, start_ns: i64) -> [f64; 4] {
    let ms = times_ms(&tracked.times).iter().sum();
    [number as f64, seconds(tracked.timestamp_ns, start_ns), tracked.inliers as f64, ms]
}

/// Returns what the page learns once.
fn described(options: &ViewOptions) -> Vec<u8> {
    let ViewOptions { title, camera, runs, frames, can_pause, truth, .. } = options;
    let Camera { width, height, fx, fy, cx, cy, .. } = camera;
    let head = json!({
        "title": title,
        "runs": runs,
        "frames": frames,
        "can_pause": can_pause,
        "camera": { "width": width, "height": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy },
        "version": env!("CARGO_PKG_VERSION"),
    });
    let step = truth.len().div_ceil(MAX_TRUTH).max(1);
    let shown = || truth.iter().step_by(step);
    let positions = shown().map(|pose| pose.t_world_cam.translation.vector);
    let positions = positions.map(|v| [v.x as f32, v.y as f32, v.z as f32]);
    hello(head, positions, shown().map(|pose| seconds(pose.timestamp_ns, options.start_ns.unwrap_or_default()) as f32))
}
