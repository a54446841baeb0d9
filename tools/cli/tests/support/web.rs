//! A client of HTTP and of sockets that sends exactly what a test says, foreign names included.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// An answer.
pub struct Answer {
    /// Its status.
    pub status: u16,
    /// Its head, in lower case.
    pub head: String,
    /// Its body.
    pub body: String,
}

/// Sends a request with these headers and no others but its length, and reads the answer to its end.
pub fn request(address: &str, line: &str, headers: &[(&str, &str)], body: &str) -> Answer {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    write_head(
        &mut stream,
        line,
        headers,
        &format!("Connection: close\r\nContent-Length: {}\r\n", body.len()),
    );
    stream.write_all(body.as_bytes()).unwrap();
    let mut bytes = Vec::new();
    let mut part = [0; 4096];
    // Not every server closes when it is asked to.
    while !is_whole(&bytes) {
        match stream.read(&mut part) {
            Ok(0) => break,
            Ok(count) => bytes.extend(&part[..count]),
            // Who refuses a request before its end may close on the rest.
            Err(error) if error.kind() == ErrorKind::ConnectionReset => break,
            Err(error) => panic!("{line}: {error}"),
        }
    }
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
    Answer { status: status(head), head: head.to_lowercase(), body: body.to_owned() }
}

/// Whether these are all bytes of an answer that says how long it is.
fn is_whole(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes).to_lowercase();
    let Some((head, _)) = text.split_once("\r\n\r\n") else { return false };
    let length = head.lines().find_map(|line| line.strip_prefix("content-length:")?.trim().parse().ok());
    let begins = bytes.windows(4).position(|four| four == b"\r\n\r\n").unwrap() + 4;
    length.is_some_and(|length: usize| bytes.len() >= begins + length)
}

fn write_head(stream: &mut TcpStream, line: &str, headers: &[(&str, &str)], more: &str) {
    let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    stream.write_all(format!("{line} HTTP/1.1\r\n{headers}{more}\r\n").as_bytes()).unwrap();
}

fn status(head: &str) -> u16 {
    head.split(' ').nth(1).and_then(|word| word.parse().ok()).unwrap_or(0)
}

/// An open socket.
pub struct Socket {
    stream: TcpStream,
}

impl Socket {
    /// Opens one, or tells the status of the refusal.
    pub fn open(address: &str, path: &str, headers: &[(&str, &str)]) -> Result<Self, u16> {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        // As browsers do: a small message does not wait until the one before was acknowledged.
        stream.set_nodelay(true).unwrap();
        let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                       Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
        write_head(&mut stream, &format!("GET {path}"), headers, upgrade);
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            match stream.read(&mut byte) {
                Ok(1) => head.push(byte[0]),
                _ => break,
            }
        }
        match status(&String::from_utf8_lossy(&head)) {
            101 => Ok(Self { stream }),
            status => Err(status),
        }
    }

    /// Another handle to the same socket.
    pub fn twin(&self) -> Self {
        Self { stream: self.stream.try_clone().unwrap() }
    }

    /// The next text; `None` at the end.
    pub fn next(&mut self) -> Option<String> {
        loop {
            let mut start = [0; 2];
            self.stream.read_exact(&mut start).ok()?;
            let length = match start[1] & 0x7f {
                126 => u64::from(u16::from_be_bytes(self.bytes()?)),
                127 => u64::from_be_bytes(self.bytes()?),
                short => u64::from(short),
            };
            let mut payload = vec![0; usize::try_from(length).ok()?];
            self.stream.read_exact(&mut payload).ok()?;
            match start[0] & 0x0f {
                1 => return String::from_utf8(payload).ok(),
                8 => return None,
                _ => {}
            }
        }
    }

    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        self.stream.read_exact(&mut bytes).ok().map(|()| bytes)
    }

    /// Sends a text, under a mask of zeros. Whether the other side still listens.
    pub fn say(&mut self, text: &str) -> bool {
        let mut frame = vec![0x81];
        match u16::try_from(text.len()).unwrap() {
            short @ 0..126 => frame.push(0x80 | short as u8),
            long => {
                frame.push(0x80 | 126);
                frame.extend(long.to_be_bytes());
            }
        }
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        self.stream.write_all(&frame).is_ok()
    }

    /// Hangs up, as a page does that is closed.
    pub fn hang_up(&self) {
        // It may have gone before.
        let _gone = self.stream.shutdown(std::net::Shutdown::Both);
    }
}
