//! The server behind `mte-slam serve`: the page as static files, and one recording as a stream of
//! decoded frames. Nothing of the recording's folder is reachable by path.
mod frames;
mod page;

pub use page::Page;

use anyhow::{Context, Result, anyhow};
use frames::FrameReader;
use mte_slam_types::sequence::Sequence;
use std::{
    io::{self, Read},
    net::{IpAddr, SocketAddr},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};
use tiny_http::{HTTPVersion, Header, Method, Request, Response, Server, StatusCode};

/// Requests answered at a time; each may hold a frame.
const MAX_REQUESTS: usize = 32;
/// Longest address of a request \[bytes\].
const MAX_URL_BYTES: usize = 2048;

/// Opens the recording afresh: every stream reads on its own.
pub type Opener = Box<dyn Fn() -> Result<Box<dyn Sequence>> + Send + Sync>;

/// What is served.
pub struct Service {
    /// The page.
    pub page: Page,
    /// The answer to `api/info`.
    pub info: Vec<u8>,
    /// Number of frames.
    pub frames: usize,
    /// The recording.
    pub open: Opener,
}

/// A server that listens.
pub struct Listening {
    server: Server,
    /// Where.
    pub address: SocketAddr,
}

type Body = Box<dyn Read>;

impl Listening {
    /// Takes the address.
    pub fn bind(ip: IpAddr, port: u16) -> Result<Listening> {
        let wanted = SocketAddr::new(ip, port);
        let server = Server::http(wanted)
            .map_err(|e| anyhow!("{e}"))
            .with_context(|| format!("--port {port}: {wanted} cannot be listened at"))?;
        let address = server.server_addr().to_ip().context("the server has no address")?;
        Ok(Listening { server, address })
    }

    /// Answers until the process ends.
    pub fn run(self, service: Service) -> Result<()> {
        let service = Arc::new(service);
        let busy = Arc::new(AtomicUsize::new(0));
        let loopback = self.address.ip().is_loopback();
        loop {
            let request = self.server.recv().context("the server stopped")?;
            let (service, busy) = (service.clone(), busy.clone());
            if busy.fetch_add(1, Ordering::SeqCst) >= MAX_REQUESTS {
                busy.fetch_sub(1, Ordering::SeqCst);
                let _ = request.respond(refusal(503, "too many requests at a time"));
                continue;
            }
            thread::spawn(move || {
                let response = service.answer(&request, loopback);
                // A browser that has gone away is no failure of the server.
                let _ = request.respond(response);
                busy.fetch_sub(1, Ordering::SeqCst);
            });
        }
    }
}

impl Service {
    fn answer(&self, request: &Request, loopback: bool) -> Response<Body> {
        if *request.method() != Method::Get && *request.method() != Method::Head {
            return refusal(405, "only GET and HEAD are understood");
        }
        // Without chunks the whole stream would have to be in memory first.
        if *request.http_version() < HTTPVersion(1, 1) {
            return refusal(505, "HTTP/1.1 or newer is expected");
        }
        if request.body_length().unwrap_or(0) > 0 {
            return refusal(413, "a body is not expected");
        }
        if request.url().len() > MAX_URL_BYTES {
            return refusal(414, "the address is too long");
        }
        let host = header(request, "Host").unwrap_or_default();
        if loopback && !names_this_machine(&host) {
            // Another site's name that points here (DNS rebinding) must not read the recording.
            return refusal(403, "this server answers to localhost only");
        }
        let (path, query) = request.url().split_once('?').unwrap_or((request.url(), ""));
        match path {
            "/api/info" => ok(&self.info, "application/json"),
            "/api/stream" => self.stream(query),
            _ => match self.page.file(path) {
                Some((bytes, kind)) => ok(&bytes, kind),
                None => refusal(404, "not found"),
            },
        }
    }

    /// `api/stream?from=N`: frames N and on, until the end or the reader leaves.
    fn stream(&self, query: &str) -> Response<Body> {
        let from = query.split('&').find_map(|part| part.strip_prefix("from="));
        let Ok(from) = from.unwrap_or("0").parse::<usize>() else {
            return refusal(400, "from: expected a whole number");
        };
        if from >= self.frames {
            return refusal(
                416,
                &format!("from: found {from}, expected less than {}", self.frames),
            );
        }
        match (self.open)() {
            Ok(sequence) => {
                let body: Body = Box::new(FrameReader::new(sequence, from));
                let kind = headers("application/octet-stream");
                // Unknown length: chunks, sent as fast as the reader takes them.
                Response::new(StatusCode(200), kind, body, None, None)
            }
            Err(e) => refusal(500, &format!("{e:#}")),
        }
    }
}

fn header(request: &Request, name: &'static str) -> Option<String> {
    request.headers().iter().find(|h| h.field.equiv(name)).map(|h| h.value.to_string())
}

/// Whether a `Host` header means this machine itself.
fn names_this_machine(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    };
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

fn headers(kind: &str) -> Vec<Header> {
    let fields = [
        ("Content-Type", kind),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Referrer-Policy", "no-referrer"),
    ];
    fields
        .iter()
        .filter_map(|(name, value)| Header::from_bytes(name.as_bytes(), value.as_bytes()).ok())
        .collect()
}

fn ok(bytes: &[u8], kind: &str) -> Response<Body> {
    let body: Body = Box::new(io::Cursor::new(bytes.to_vec()));
    Response::new(StatusCode(200), headers(kind), body, Some(bytes.len()), None)
}

fn refusal(status: u16, why: &str) -> Response<Body> {
    let text = format!("{why}\n").into_bytes();
    let length = text.len();
    let body: Body = Box::new(io::Cursor::new(text));
    let kind = headers("text/plain; charset=utf-8");
    Response::new(StatusCode(status), kind, body, Some(length), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_machines_names_are_answered() {
        for host in
            ["localhost", "LOCALHOST:8080", "127.0.0.1:1", "127.9.9.9", "[::1]:8080", "[::1]"]
        {
            assert!(names_this_machine(host), "{host}");
        }
        for host in [
            "",
            "example.org",
            "localhost.example.org:80",
            "10.0.0.1",
            "[::2]:80",
            "127.0.0.1.nip.io",
        ] {
            assert!(!names_this_machine(host), "{host}");
        }
    }
}
