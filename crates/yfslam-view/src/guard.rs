//! Refuses requests that come from pages of other origins, also through names that resolve to this machine (DNS rebinding).

use std::net::{IpAddr, SocketAddr};

use crate::request::Request;

/// What a request must name.
#[derive(Clone, Debug)]
pub struct Guard {
    /// The host that the user gave, in lower case.
    host: String,
    local: SocketAddr,
}

impl Guard {
    pub fn new(host: &str, local: SocketAddr) -> Self {
        Self { host: host.to_ascii_lowercase(), local }
    }

    /// Returns why a request is refused, if it is.
    pub fn refuses(&self, request: &Request) -> Option<&'static str> {
        let is_single = ["host", "origin"].iter().all(|name| request.is_single(name));
        let Some(host) = request.header("host").filter(|host| is_single && self.is_own(host)) else {
            return Some("the Host header does not name this server by an address of this machine");
        };
        let origin = request.header("origin");
        let is_foreign = origin.is_some_and(|origin| !origin.eq_ignore_ascii_case(&format!("http://{host}")));
        // A link from another page may lead to the page itself, which has no data.
        let from = request.header("sec-fetch-site").filter(|_| request.path != "/");
        if is_foreign || from.is_some_and(|from| !["same-origin", "none"].contains(&from)) {
            return Some("requests of pages of other origins are refused");
        }
        // Browsers send an origin with every POST, also with that of a form.
        (request.method != "GET" && origin.is_none() && from.is_some()).then_some("the request has no origin")
    }

    /// Returns whether a host with port is this server. Names that a stranger can give an address are none: only numbers, `localhost`, and the
    /// name that the user gave.
    fn is_own(&self, host: &str) -> bool {
        let (name, port) = match host.rsplit_once(':') {
            Some((name, port)) if !port.contains(']') => (name, port.parse().ok()),
            _ => (host, Some(80)),
        };
        let name = name.to_ascii_lowercase();
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(&name);
        let is_number = match bare.parse::<IpAddr>() {
            Ok(ip) => ip.is_loopback() || !self.local.ip().is_loopback(),
            Err(_) => false,
        };
        port == Some(self.local.port()) && (is_number || name == "localhost" || name == self.host)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(local: &str, head: &str) -> Option<&'static str> {
        let guard = Guard::new("robot.local", local.parse().unwrap());
        guard.refuses(&Request::read(&mut format!("{head}\r\n\r\n").as_bytes()).unwrap())
    }

    #[test]
    fn only_addresses_of_the_machine_are_accepted_as_host() {
        let ask = |local: &str, host: &str| answer(local, &format!("GET /next HTTP/1.1\r\nHost: {host}")).is_none();
        for own in ["127.0.0.1:8788", "localhost:8788", "LOCALHOST:8788", "[::1]:8788", "robot.local:8788"] {
            assert!(ask("127.0.0.1:8788", own), "{own}");
        }
        for foreign in
            ["evil.example:8788", "127.0.0.1", "127.0.0.1:80", "192.168.0.7:8788", "127.0.0.1.evil.example:8788", ""]
        {
            assert!(!ask("127.0.0.1:8788", foreign), "{foreign}");
        }
        assert!(ask("0.0.0.0:8788", "192.168.0.7:8788") && !ask("0.0.0.0:8788", "evil.example:8788"));
        assert!(answer("127.0.0.1:8788", "GET / HTTP/1.1").is_some());
        assert!(answer("127.0.0.1:1", "GET / HTTP/1.1\r\nHost: 127.0.0.1:1\r\nHost: localhost:1").is_some());
    }

    #[test]
    fn pages_of_other_origins_are_refused() {
        let ask = |method: &str, path: &str, headers: &str| {
            answer("127.0.0.1:8788", &format!("{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:8788\r\n{headers}"))
                .is_none()
        };
        assert!(ask("GET", "/next", "Sec-Fetch-Site: same-origin"));
        assert!(ask("POST", "/control", "Origin: http://127.0.0.1:8788"));
        assert!(ask("GET", "/", "Sec-Fetch-Site: cross-site"));
        for headers in [
            "Origin: http://evil.example",
            "Origin: null",
            "Origin: http://localhost:8788",
            "Sec-Fetch-Site: cross-site",
        ] {
            assert!(!ask("GET", "/next", headers) && !ask("POST", "/control", headers), "{headers}");
        }
    }
}
