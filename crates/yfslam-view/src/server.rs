//! Answers the page: one thread for each connection, whose number is bounded.

use std::io::{self, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::guard::Guard;
use crate::packet::PacketBuilder;
use crate::request::{NoRequest, Request};
use crate::shared::{Control, Seen, Shared, State};

/// Most connections at once.
const MAX_CONNECTIONS: usize = 24;
/// Time after which a connection that neither sends nor receives is closed.
const PATIENCE: Duration = Duration::from_secs(10);
/// Longest time for which the answer waits for something new.
const LONGEST_WAIT: Duration = Duration::from_secs(1);
/// Largest multiple of the speed of a recording.
const MAX_SPEED: f64 = 100.0;

/// Returns the page: markup, style and scripts.
fn page() -> [&'static str; 7] {
    [
        include_str!("page/head.html"),
        include_str!("page/view.css"),
        include_str!("page/body.html"),
        crate::SCENE_SCRIPT,
        include_str!("page/plot.js"),
        include_str!("page/view.js"),
        "</script></body></html>",
    ]
}

/// The page may load nothing from elsewhere and may not be put into other pages.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src blob: data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What a connection needs to answer.
pub struct Server {
    pub shared: Arc<Shared>,
    pub guard: Guard,
    /// What the page learns once.
    pub hello: Vec<u8>,
}

impl Server {
    /// Accepts connections until the view is closed.
    pub fn run(self: Arc<Self>, listener: &TcpListener) {
        for stream in listener.incoming() {
            if self.shared.lock().closing {
                return;
            }
            let Ok(stream) = stream else {
                // Such as too many open files: later there may be fewer.
                std::thread::sleep(Duration::from_millis(100));
                continue;
            };
            let is_free = self.shared.change(|state| {
                let is_free = state.connections < MAX_CONNECTIONS;
                state.connections += usize::from(is_free);
                is_free
            });
            if !is_free {
                refuse(&stream, 503, "too many pages are open");
                continue;
            }
            let server = self.clone();
            let thread = std::thread::Builder::new().name("yfslam-viewer".into()).spawn(move || {
                // A connection that fails concerns this viewer only.
                let _ = server.serve(&stream);
                server.shared.change(|state| state.connections -= 1);
            });
            if thread.is_err() {
                self.shared.change(|state| state.connections -= 1);
            }
        }
    }

    fn serve(&self, stream: &TcpStream) -> io::Result<()> {
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        let mut reader = BufReader::new(stream);
        loop {
            match Request::read(&mut reader) {
                Err(NoRequest::Closed) => return Ok(()),
                Err(NoRequest::Bad(status, reason)) => {
                    refuse(stream, status, reason);
                    return Ok(());
                }
                Ok(request) => match self.guard.refuses(&request) {
                    Some(reason) => {
                        refuse(stream, 403, reason);
                        return Ok(());
                    }
                    None => self.answer(&request, stream)?,
                },
            }
        }
    }

    fn answer(&self, request: &Request, stream: &TcpStream) -> io::Result<()> {
        match (request.method.as_str(), request.path.as_str()) {
            ("GET", "/") => send(stream, "200 OK", "text/html; charset=utf-8", &page().map(str::as_bytes)),
            ("GET", "/hello") => send(stream, "200 OK", "application/octet-stream", &[&self.hello]),
            ("GET", "/next") => self.next(request, stream),
            ("POST", "/control") => {
                self.shared.change(|state| control(state, request));
                send(stream, "200 OK", "text/plain", &[])
            }
            ("GET" | "POST", _) => send(stream, "404 Not Found", "text/plain", &[b"there is no such page\n"]),
            _ => send(stream, "405 Method Not Allowed", "text/plain", &[b"use GET or POST\n"]),
        }
    }

    /// Answers with what is newer than what the viewer has, as soon as there is anything.
    fn next(&self, request: &Request, stream: &TcpStream) -> io::Result<()> {
        let numbers = |text: &str| text.split(',').map(|number| number.parse().unwrap_or(0)).collect();
        let seen = Seen {
            run: request.value("run").and_then(|run| run.parse().ok()),
            frame: request.number("frame"),
            map: request.number("map"),
            patch: request.number("patch"),
            control: request.number("control"),
            paths: request.value("paths").map(numbers).unwrap_or_default(),
        };
        let until = Instant::now() + LONGEST_WAIT;
        self.shared.change(|state| asked(state, &seen));
        let mut state = self.shared.lock();
        let mut packets = loop {
            let packets = state.newer(&seen);
            let has_news = !packets.is_empty() || state.control_number != seen.control;
            let (now, goes_on) = if has_news { (state, false) } else { self.shared.wait(state, until) };
            state = now;
            if !goes_on {
                break packets;
            }
        };
        asked(&mut state, &seen);
        packets.push(status(&state));
        drop(state);
        let parts: Vec<&[u8]> = packets.iter().map(|packet| &**packet).collect();
        send(stream, "200 OK", "application/octet-stream", &parts)
    }
}

/// Notes that a viewer has asked.
fn asked(state: &mut State, seen: &Seen) {
    let now = Some(Instant::now());
    state.asked = now;
    if let Some(run) = seen.run.and_then(|run| state.runs.get_mut(run)) {
        run.asked = now;
    }
}

/// Returns the packet with the state of the controls.
fn status(state: &State) -> crate::packet::Packet {
    let Control { paused, speed, .. } = state.control;
    let head = json!({ "number": state.control_number, "paused": paused, "speed": speed, "ended": state.ended });
    PacketBuilder::new("control", head).build()
}

/// Does what a viewer asks for; what is not understood is ignored.
fn control(state: &mut State, request: &Request) {
    let control = &mut state.control;
    match request.value("do") {
        Some("pause") => (control.paused, control.steps) = (true, 0),
        Some("play") => control.paused = false,
        Some("step") => (control.paused, control.steps) = (true, control.steps.saturating_add(1)),
        Some("speed") => {
            let speed = request.value("speed").and_then(|speed| speed.parse().ok());
            control.speed = speed.filter(|speed: &f64| (0.0..=MAX_SPEED).contains(speed)).unwrap_or(control.speed);
        }
        _ => return,
    }
    state.control_number += 1;
}

/// Returns what the page learns once.
pub fn hello(head: Value, truth: impl Iterator<Item = [f32; 3]>, stamps_s: impl Iterator<Item = f32>) -> Vec<u8> {
    PacketBuilder::new("hello", head).floats("truth", truth.flatten()).floats("stamps", stamps_s).build().to_vec()
}

fn send(mut stream: &TcpStream, status: &str, kind: &str, parts: &[&[u8]]) -> io::Result<()> {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
         Content-Security-Policy: {POLICY}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    parts.iter().try_for_each(|part| stream.write_all(part))
}

fn refuse(mut stream: &TcpStream, status: u16, reason: &str) {
    let text = format!("{reason}\n");
    let head = format!("HTTP/1.1 {status} Refused\r\nContent-Type: text/plain\r\nContent-Length: {}\r\n", text.len());
    // The other side may have gone, which is what is wanted.
    let _ = stream.set_write_timeout(Some(PATIENCE));
    let _ = stream.write_all(format!("{head}Connection: close\r\n\r\n{text}").as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_less_than_60_kb_and_loads_nothing() {
        let page = page().concat();
        assert!(page.len() <= 60_000, "{} bytes", page.len());
        for foreign in ["http://", "https://", "src=\"", "@import", "url("] {
            let allowed = page.matches(foreign).filter(|_| foreign.starts_with("http")).count();
            let names = page.matches("http://www.w3.org").count();
            assert!(allowed == names && (foreign.starts_with("http") || !page.contains(foreign)), "{foreign}");
        }
    }
}
