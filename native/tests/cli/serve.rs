//! `mte-slam serve` as a browser meets it: what is answered, and what is refused.
use crate::program::*;
use mte_slam_dataset::stream::{FrameDecoder, StreamInfo};
use serde_json::Value;
use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Child, Stdio},
    time::Duration,
};

const FRAMES: u64 = 5;
const PIXELS: usize = 32 * 24;

/// A server on a free port, ended with the value.
struct Serving {
    child: Child,
    address: String,
    _folder: tempfile::TempDir,
}

impl Serving {
    fn start() -> Serving {
        let folder = tempfile::tempdir().unwrap();
        succeed(folder.path(), &["-q", "synth", "room", "--frames", "5", "--width", "32"]);
        let page = folder.path().join("page");
        std::fs::create_dir(&page).unwrap();
        std::fs::write(page.join("index.html"), "<html><head></head><body>page</body></html>")
            .unwrap();
        let serve = ["--json", "serve", "--port", "0", "--page", "page", "room"];
        let mut child = command(folder.path(), &serve)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let said: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(said["frames"], FRAMES);
        let url = said["url"].as_str().unwrap();
        let address = url.trim_start_matches("http://").trim_end_matches('/').to_owned();
        assert!(address.starts_with("127.0.0.1:"), "{address} is not loopback");
        Serving { child, address, _folder: folder }
    }

    /// Status, headers and body; chunks are put together.
    fn ask(&self, request: &str) -> (u16, String, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream.write_all(request.replace("HOST", &self.address).as_bytes()).unwrap();
        let mut all = Vec::new();
        stream.read_to_end(&mut all).unwrap();
        let split = all.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        let head = String::from_utf8(all[..split].to_vec()).unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        let body = &all[split + 4..];
        let chunked = head.to_lowercase().contains("transfer-encoding: chunked");
        (status, head, if chunked { dechunked(body) } else { body.to_vec() })
    }

    fn get(&self, path: &str) -> (u16, String, Vec<u8>) {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: HOST\r\nConnection: close\r\n\r\n"))
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn dechunked(mut rest: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    loop {
        let end = rest.windows(2).position(|w| w == b"\r\n").unwrap();
        let size = usize::from_str_radix(std::str::from_utf8(&rest[..end]).unwrap(), 16).unwrap();
        if size == 0 {
            return body;
        }
        body.extend_from_slice(&rest[end + 2..end + 2 + size]);
        rest = &rest[end + 4 + size..];
    }
}

#[test]
fn a_recording_is_described_and_streamed_from_any_frame() {
    let serving = Serving::start();
    let (status, _, page) = serving.get("/");
    assert_eq!(status, 200);
    assert!(String::from_utf8(page).unwrap().contains("mte-slam-serve"));

    let (status, head, info) = serving.get("/api/info");
    assert_eq!(status, 200);
    assert!(head.contains("application/json") && head.contains("nosniff"), "{head}");
    let info = StreamInfo::from_json(&info).unwrap();
    assert_eq!((info.frames as u64, info.camera.width), (FRAMES, 32));
    assert_eq!(info.truth.len(), FRAMES as usize);

    let (status, _, stream) = serving.get("/api/stream?from=3");
    assert_eq!(status, 200);
    let mut decoder = FrameDecoder::new(PIXELS);
    decoder.push(&stream);
    for index in 3..FRAMES {
        let frame = decoder.next_frame().unwrap().unwrap();
        assert_eq!((frame.index as u64, frame.labels.is_some()), (index, true));
        assert!(frame.color.as_flattened().iter().any(|c| *c > 0));
    }
    decoder.finish().unwrap();
}

#[test]
fn nothing_else_is_answered() {
    let serving = Serving::start();
    for (path, expected) in [
        ("/api/stream?from=5", 416),
        ("/api/stream?from=-1", 400),
        ("/api/stream?from=99999999999999999999", 400),
        ("/../room/traj.txt", 404),
        ("/%2e%2e/room/traj.txt", 404),
        ("/room/traj.txt", 404),
        ("//etc/passwd", 404),
        ("/api/", 404),
    ] {
        assert_eq!(serving.get(path).0, expected, "{path}");
    }
    let long = format!("/{}", "a".repeat(3000));
    assert_eq!(serving.get(&long).0, 414);
    let refused = [
        ("GET / HTTP/1.1\r\nHost: evil.example.org\r\nConnection: close\r\n\r\n", 403),
        ("GET /api/info HTTP/1.1\r\nConnection: close\r\n\r\n", 403),
        (
            "POST /api/info HTTP/1.1\r\nHost: HOST\r\nConnection: close\r\nContent-Length: 0\r\n\r\n",
            405,
        ),
        ("GET /api/stream HTTP/1.0\r\nHost: HOST\r\n\r\n", 505),
    ];
    for (request, expected) in refused {
        assert_eq!(serving.ask(request).0, expected, "{request}");
    }
}

/// Several readers at once, one of which stops reading and one of which leaves.
#[test]
fn slow_and_vanished_readers_do_not_stop_others() {
    let serving = Serving::start();
    let slow = TcpStream::connect(&serving.address).unwrap();
    let request = format!("GET /api/stream HTTP/1.1\r\nHost: {}\r\n\r\n", serving.address);
    (&slow).write_all(request.as_bytes()).unwrap();
    {
        let mut gone = TcpStream::connect(&serving.address).unwrap();
        gone.write_all(request.as_bytes()).unwrap();
        let mut some = [0; 100];
        gone.read_exact(&mut some).unwrap();
    }
    for _ in 0..3 {
        assert_eq!(serving.get("/api/stream?from=4").0, 200);
    }
}

#[test]
fn a_port_in_use_is_said() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["-q", "synth", "room", "--frames", "1", "--width", "32"]);
    refused(folder.path(), &["serve", "--port", &port, "room"], 1, &[&format!("--port {port}")]);
}
