//! Where the server listens.

use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv4Addr, TcpListener, ToSocketAddrs};
use std::str::FromStr;

/// The port that is tried first where none is given.
const PORT: u16 = 8788;

/// Host and port of the server: by default a port of the loopback interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Name or number of the interface.
    pub(crate) host: String,
    /// `None`: the usual port or, if it is in use, any free one.
    port: Option<u16>,
}

impl Default for Address {
    fn default() -> Self {
        Self { host: Ipv4Addr::LOCALHOST.to_string(), port: None }
    }
}

impl FromStr for Address {
    type Err = String;

    /// Parses `PORT`, `HOST` or `HOST:PORT`; a number of IPv6 with a port stands in brackets.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}' is no address; give a port, a host, or both, such as 8788 or 0.0.0.0:8788");
        if let Ok(port) = text.parse() {
            return Ok(Self { port: Some(port), ..Self::default() });
        }
        if let Ok(ip) = text.parse::<IpAddr>() {
            return Ok(Self { host: ip.to_string(), port: None });
        }
        let (host, port) = match text.rsplit_once(':') {
            Some((host, port)) => (host, Some(port.parse().map_err(|_| wrong())?)),
            None => (text, None),
        };
        let host = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
        let is_name = |c: char| c.is_ascii_alphanumeric() || ".-:".contains(c);
        if host.is_empty() || !host.chars().all(is_name) {
            return Err(wrong());
        }
        Ok(Self { host: host.to_owned(), port })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let host = if self.host.contains(':') { format!("[{}]", self.host) } else { self.host.clone() };
        match self.port {
            Some(port) => write!(f, "{host}:{port}"),
            None => f.write_str(&host),
        }
    }
}

impl Address {
    /// Returns the address with the port that is in use.
    pub(crate) fn with_port(&self, port: u16) -> Self {
        Self { host: self.host.clone(), port: Some(port) }
    }

    /// Begins to listen.
    ///
    /// # Errors
    /// The host is not one of this machine, or the port is in use or not allowed.
    pub(crate) fn listen(&self) -> io::Result<TcpListener> {
        let bind = |port: u16| {
            let addresses: Vec<_> = (self.host.as_str(), port).to_socket_addrs()?.collect();
            TcpListener::bind(&addresses[..])
        };
        let cure = |error: io::Error| {
            let text = format!(
                "the live view cannot listen on {self}: {error}; choose another port, such as --view=0 for any"
            );
            io::Error::new(error.kind(), text)
        };
        match self.port {
            Some(port) => bind(port).map_err(cure),
            None => bind(PORT).or_else(|_| bind(0)).map_err(cure),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_port_a_host_or_both() {
        let parsed = |text: &str| text.parse::<Address>().map(|address| address.to_string());
        assert_eq!(parsed("9000").unwrap(), "127.0.0.1:9000");
        assert_eq!(parsed("0.0.0.0").unwrap(), "0.0.0.0");
        assert_eq!(parsed("robot.local:80").unwrap(), "robot.local:80");
        assert_eq!(parsed("::1").unwrap(), "[::1]");
        assert_eq!(parsed("[::1]:9000").unwrap(), "[::1]:9000");
        for wrong in ["", ":80", "a b", "host:port", "http://x/", "host:70000"] {
            assert!(parsed(wrong).unwrap_err().contains("such as 8788"), "{wrong}");
        }
    }

    #[test]
    fn a_port_in_use_is_an_error_with_the_cure_and_without_a_port_another_is_taken() {
        let first = Address::from_str("0").unwrap().listen().unwrap();
        let port = first.local_addr().unwrap().port();
        let error = Address::from_str(&port.to_string()).unwrap().listen().unwrap_err().to_string();
        assert!(error.contains(&format!("127.0.0.1:{port}")) && error.contains("choose another port"), "{error}");
        let (a, b) = (Address::default().listen().unwrap(), Address::default().listen().unwrap());
        assert_ne!(a.local_addr().unwrap(), b.local_addr().unwrap());
    }
}
