//! The server of the live view over real connections, without a browser.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may")]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use yfslam::Slam;
use yfslam_synth::World;
use yfslam_view::{Address, View, ViewOptions};

fn world(frames: usize) -> World {
    let spec = format!("walking_xyz?people=1&width=320&height=240&frames={frames}");
    let camera = yfslam_synth::default_camera();
    World::new(&yfslam_synth::parse_with_camera(&spec, camera, 5000.0).unwrap()).unwrap()
}

fn start(can_pause: bool) -> (View, SocketAddr) {
    let address: Address = "0".parse().unwrap();
    let options = ViewOptions { can_pause, ..ViewOptions::new("test", world(1).config().camera.clone()) };
    let view = View::start(&address, options).unwrap();
    let at = view.url().trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
    (view, at)
}

/// Sends a head and returns status, headers and body.
fn ask(at: SocketAddr, line: &str, headers: &str) -> (u16, String, Vec<u8>) {
    let mut stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream.write_all(format!("{line} HTTP/1.1\r\n{headers}\r\n").as_bytes()).unwrap();
    answer(&mut stream)
}

fn answer(stream: &mut TcpStream) -> (u16, String, Vec<u8>) {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        if stream.read(&mut byte).unwrap_or(0) == 0 {
            return (0, String::new(), Vec::new());
        }
        head.push(byte[0]);
    }
    let head = String::from_utf8(head).unwrap();
    let length = head.lines().find_map(|line| line.strip_prefix("Content-Length: ")).unwrap().parse().unwrap();
    let mut body = vec![0; length];
    stream.read_exact(&mut body).unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), head, body)
}

fn host(at: SocketAddr) -> String {
    format!("Host: {at}\r\n")
}

/// Returns the JSON of each packet.
fn packets(mut body: &[u8]) -> Vec<serde_json::Value> {
    let mut found = Vec::new();
    while !body.is_empty() {
        let number = |at: usize| u32::from_le_bytes(body[at..at + 4].try_into().unwrap()) as usize;
        let (length, head) = (number(0), number(4));
        let json: serde_json::Value = serde_json::from_slice(&body[8..8 + head]).unwrap();
        let parts: usize =
            json["parts"].as_array().unwrap().iter().map(|part| part[1].as_u64().unwrap() as usize).sum();
        assert_eq!(length, 4 + head + parts);
        found.push(json);
        body = &body[4 + length..];
    }
    found
}

fn kinds(body: &[u8]) -> Vec<String> {
    packets(body).iter().map(|packet| packet["kind"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn the_page_is_served_on_the_loopback_interface_and_loads_nothing() {
    let (view, at) = start(true);
    assert!(at.ip().is_loopback() && view.url().starts_with("http://127.0.0.1:"));
    let (status, head, body) = ask(at, "GET /", &host(at));
    assert_eq!(status, 200);
    assert!(body.len() <= 60_000, "{} bytes", body.len());
    assert!(head.contains("default-src 'none'") && head.contains("frame-ancestors 'none'"), "{head}");
    assert!(String::from_utf8(body).unwrap().ends_with("</html>"));
    assert_eq!(ask(at, "GET /etc/passwd", &host(at)).0, 404);
    assert_eq!(ask(at, "DELETE /", &host(at)).0, 405);
}

#[test]
fn other_origins_other_hosts_and_oversized_requests_are_refused() {
    let (_view, at) = start(true);
    let own = host(at);
    assert_eq!(ask(at, "GET /next?run=0", "Host: evil.example\r\n").0, 403);
    assert_eq!(ask(at, "GET /next?run=0", "").0, 403);
    assert_eq!(ask(at, "GET /next?run=0", &format!("{own}Origin: http://evil.example\r\n")).0, 403);
    assert_eq!(ask(at, "POST /control?do=pause", &format!("{own}Origin: null\r\n")).0, 403);
    assert_eq!(ask(at, "GET /hello", &format!("{own}Sec-Fetch-Site: cross-site\r\n")).0, 403);
    assert_eq!(ask(at, "GET /next", &format!("{own}X: {}\r\n", "a".repeat(20_000))).0, 431);
    assert_eq!(ask(at, "POST /control?do=pause", &format!("{own}Content-Length: 7\r\n")).0, 413);
    assert_eq!(ask(at, "POST /control?do=play", &format!("{own}Origin: http://{at}\r\n")).0, 200);
}

#[test]
fn too_many_connections_are_refused_and_all_end_with_the_view() {
    let (view, at) = start(true);
    let mut idle: Vec<TcpStream> = (0..40).map(|_| TcpStream::connect(at).unwrap()).collect();
    let last = idle.last_mut().unwrap();
    last.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    assert_eq!(answer(last).0, 503);
    drop(idle);
    let started = Instant::now();
    drop(view);
    assert!(started.elapsed() < Duration::from_secs(3));
}

#[test]
fn a_viewer_gets_frames_map_path_and_surfaces_and_only_what_is_newer() {
    let (view, at) = start(true);
    let world = world(12);
    let mut slam = Slam::builder(world.config().camera.clone()).build().unwrap();
    ask(at, "GET /next?run=0", &host(at));
    let mut all = Vec::new();
    let mut seen = [0; 4];
    for index in 0..world.len() {
        let shot = world.frame(index);
        let tracked = slam.track(&shot.frame).unwrap();
        view.show(0, &shot.frame, &tracked, &slam);
        let [frame, map, patch, path] = seen;
        let query = format!("GET /next?run=0&control=1&frame={frame}&map={map}&patch={patch}&paths={path}");
        let (status, _, body) = ask(at, &query, &host(at));
        assert_eq!(status, 200);
        for packet in packets(&body) {
            let number = packet["number"].as_u64().unwrap();
            let kind = packet["kind"].as_str().unwrap().to_owned();
            if let Some(last) = ["frame", "map", "patch", "path"].iter().position(|known| *known == kind) {
                assert!(number > seen[last], "{kind} {number} again");
                seen[last] = number;
            }
            all.push(kind);
        }
    }
    for kind in ["frame", "map", "patch", "path", "control"] {
        assert!(all.iter().any(|known| known == kind), "{kind} is missing: {all:?}");
    }
    // A hidden page learns the state of the controls only.
    assert_eq!(kinds(&ask(at, "GET /next?control=0", &host(at)).2), ["control"]);
    drop(view);
}

#[test]
fn a_slow_viewer_and_a_pause_without_effect_never_hold_up_the_run() {
    let (view, at) = start(true);
    let world = world(8);
    let mut slam = Slam::builder(world.config().camera.clone()).build().unwrap();
    // It asks for everything, again and again, and reads nothing.
    let mut slow = TcpStream::connect(at).unwrap();
    let request = format!("GET /hello HTTP/1.1\r\n{}\r\n", host(at));
    slow.set_write_timeout(Some(Duration::from_millis(200))).unwrap();
    ask(at, "GET /next?run=0", &host(at));
    let reader = std::thread::spawn(move || while slow.write_all(request.as_bytes()).is_ok() {});
    for index in 0..world.len() {
        let shot = world.frame(index);
        let tracked = slam.track(&shot.frame).unwrap();
        let started = Instant::now();
        view.show(0, &shot.frame, &tracked, &slam);
        view.pace(shot.frame.timestamp_ns, || false);
        assert!(started.elapsed() < Duration::from_secs(1));
    }
    drop(view);
    reader.join().unwrap();
}

#[test]
fn a_paused_run_waits_for_a_step_and_for_the_end_of_the_pause() {
    let (view, at) = start(true);
    let control =
        |what: &str| ask(at, &format!("POST /control?do={what}"), &format!("{}Origin: http://{at}\r\n", host(at))).0;
    ask(at, "GET /next?run=0", &host(at));
    assert_eq!(control("pause"), 200);
    let (sent, passed) = std::sync::mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for frame in 0..3 {
                view.pace(frame * 33_000_000, || false);
                sent.send(frame).unwrap();
            }
        });
        let wait = |ms| passed.recv_timeout(Duration::from_millis(ms)).ok();
        assert_eq!(wait(300), None);
        control("step");
        assert_eq!(wait(5000), Some(0));
        assert_eq!(wait(300), None);
        control("play");
        assert_eq!((wait(5000), wait(5000)), (Some(1), Some(2)));
    });
    // An interrupt ends a pause, too.
    control("pause");
    view.pace(0, || true);
}

#[test]
fn without_a_viewer_nothing_is_encoded() {
    let (view, at) = start(true);
    let world = world(3);
    let mut slam = Slam::builder(world.config().camera.clone()).build().unwrap();
    for index in 0..world.len() {
        let shot = world.frame(index);
        let tracked = slam.track(&shot.frame).unwrap();
        view.show(0, &shot.frame, &tracked, &slam);
    }
    // The points of keyframes are kept for viewers who come later; no image and no map is.
    std::thread::sleep(Duration::from_millis(300));
    let first = kinds(&ask(at, "GET /next?run=0&control=9", &host(at)).2);
    assert!(!first.iter().any(|kind| kind == "frame" || kind == "map"), "{first:?}");
}
