//! Requests of HTTP/1.1, as far as the page needs them.
//!
//! In: bytes of a connection. Out: the head of a request. It is bounded; a request has no body.

use std::io::{self, BufRead, Read};

/// Longest head of a request, bytes.
pub const MAX_HEAD: u64 = 8192;

/// The head of a request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// GET, POST, …
    pub method: String,
    /// Path without the query.
    pub path: String,
    query: String,
    /// Names in lower case, and values.
    headers: Vec<(String, String)>,
}

/// Why there is no request.
#[derive(Debug)]
pub enum NoRequest {
    /// The connection has ended or failed, or nothing came for too long.
    Closed,
    /// Status and reason of the answer.
    Bad(u16, &'static str),
}

impl From<io::Error> for NoRequest {
    fn from(_: io::Error) -> Self {
        Self::Closed
    }
}

impl Request {
    /// Reads the head of the next request.
    ///
    /// # Errors
    /// There is none, or it is not understood.
    pub fn read(from: &mut impl BufRead) -> Result<Self, NoRequest> {
        let mut head = from.take(MAX_HEAD);
        let mut line = String::new();
        let mut next = |line: &mut String| -> Result<(), NoRequest> {
            line.clear();
            head.read_line(line).map_err(|error| match error.kind() {
                io::ErrorKind::InvalidData => NoRequest::Bad(400, "the head of the request is not text"),
                _ => NoRequest::Closed,
            })?;
            match line.ends_with('\n') {
                true => {
                    line.truncate(line.trim_end().len());
                    Ok(())
                }
                false if head.limit() == 0 => Err(NoRequest::Bad(431, "the head of the request is too long")),
                false => Err(NoRequest::Closed),
            }
        };
        next(&mut line)?;
        let mut words = line.split(' ');
        let (Some(method), Some(target), Some("HTTP/1.1"), None) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            return Err(NoRequest::Bad(400, "the request is not one of HTTP/1.1"));
        };
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let mut request = Self { method: method.into(), path: path.into(), query: query.into(), headers: Vec::new() };
        loop {
            next(&mut line)?;
            if line.is_empty() {
                break;
            }
            let Some((name, value)) = line.split_once(':') else {
                return Err(NoRequest::Bad(400, "a header has no colon"));
            };
            request.headers.push((name.to_ascii_lowercase(), value.trim().to_owned()));
        }
        let has_body = request.header("content-length").is_some_and(|length| length != "0");
        match has_body || request.header("transfer-encoding").is_some() {
            true => Err(NoRequest::Bad(413, "a request must not have a body")),
            false => Ok(request),
        }
    }

    /// Returns the value of a header, by its name in lower case.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Returns whether a header occurs once at most.
    pub fn is_single(&self, name: &str) -> bool {
        self.headers.iter().filter(|(known, _)| known == name).count() <= 1
    }

    /// Returns a value of the query.
    pub fn value(&self, name: &str) -> Option<&str> {
        self.query.split('&').filter_map(|pair| pair.split_once('=')).find(|(key, _)| *key == name).map(|(_, v)| v)
    }

    /// Returns a number of the query; 0 if there is none.
    pub fn number(&self, name: &str) -> u64 {
        self.value(name).and_then(|value| value.parse().ok()).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_has_a_path_a_query_and_headers() {
        let mut bytes = &b"GET /next?run=1&frame=x HTTP/1.1\r\nHost: a:1\r\nX-Y:  z \r\n\r\nrest"[..];
        let request = Request::read(&mut bytes).unwrap();
        assert_eq!((request.method.as_str(), request.path.as_str()), ("GET", "/next"));
        assert_eq!((request.value("run"), request.number("frame"), request.value("map")), (Some("1"), 0, None));
        assert_eq!((request.header("host"), request.header("x-y")), (Some("a:1"), Some("z")));
        assert_eq!(bytes, b"rest");
    }

    #[test]
    fn what_is_no_request_is_refused_and_never_read_without_end() {
        let status = |bytes: &[u8]| match Request::read(&mut &*bytes) {
            Err(NoRequest::Bad(status, _)) => status,
            Err(NoRequest::Closed) => 0,
            Ok(request) => panic!("{request:?}"),
        };
        assert_eq!(status(b""), 0);
        assert_eq!(status(b"GET / HTTP/1.1\r\nHost: a"), 0);
        assert_eq!(status(b"GET /\r\n\r\n"), 400);
        assert_eq!(status(b"GET / HTTP/1.1\r\nnothing\r\n\r\n"), 400);
        assert_eq!(status(b"\xff\xfe\n"), 400);
        assert_eq!(status(b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello"), 413);
        assert_eq!(status(b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"), 413);
        assert_eq!(status(&b"a".repeat(1 << 20)), 431);
        assert_eq!(status(&[&b"GET / HTTP/1.1\r\n"[..], &b"a: b\r\n".repeat(1 << 16)].concat()), 431);
    }
}
