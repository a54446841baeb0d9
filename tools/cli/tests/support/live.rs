//! A live page with the core behind it, and pages that watch it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use stillbeam::board::ByteLink;
use stillbeam::board::in_process::InProcessBoard;
use stillbeam::board::paced::PacedBoard;
use stillbeam::live::{LiveOptions, serve};

use super::web::{Answer, Socket, request};

/// How long anything may take on a computer that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(60);

/// A page that is served, until it is dropped.
pub struct Site {
    /// Host and port.
    pub address: String,
    /// The path with the token, ending in a slash.
    pub root: String,
    /// Where recordings are saved.
    pub folder: PathBuf,
    _folder: tempfile::TempDir,
    closing: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Site {
    /// Serves the core.
    pub fn start() -> Self {
        Self::of(|| Box::new(PacedBoard::new(InProcessBoard::new())))
    }

    /// Serves a board without hardware.
    pub fn of(open: impl FnOnce() -> Box<dyn ByteLink> + Send + 'static) -> Self {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path().to_owned();
        let options = LiveOptions { port: 0, folder: folder.clone(), is_virtual: true };
        let closing = Arc::new(AtomicBool::new(false));
        let (opened, address) = mpsc::channel();
        let ending = Arc::clone(&closing);
        let thread = std::thread::spawn(move || {
            serve(open(), &options, &ending, &mut |url| opened.send(url.to_owned()).unwrap()).unwrap();
        });
        let url = address.recv_timeout(PATIENCE).unwrap();
        let (address, token) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
        let (address, root) = (address.to_owned(), format!("/{token}"));
        Self { address, root, folder, _folder: temporary, closing, thread: Some(thread) }
    }

    /// The address as a person opens it.
    pub fn url(&self) -> String {
        format!("http://{}{}", self.address, self.root)
    }

    /// What a page of this server would send, as the page of this name.
    pub fn post(&self, path: &str, page: &str, body: &Value) -> Answer {
        let origin = format!("http://{}", self.address);
        let headers = [
            ("Host", self.address.as_str()),
            ("Origin", &origin),
            ("Content-Type", "application/json"),
            ("X-Stillbeam-Page", page),
        ];
        request(&self.address, &format!("POST {}{path}", self.root), &headers, &body.to_string())
    }

    /// Opens the stream as a page does.
    pub fn socket(&self) -> Socket {
        let origin = format!("http://{}", self.address);
        let headers = [("Host", self.address.as_str()), ("Origin", origin.as_str())];
        Socket::open(&self.address, &format!("{}socket", self.root), &headers).unwrap()
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            // A test that fails already says why.
            assert!(ended.is_ok() || std::thread::panicking());
        }
    }
}

/// What a page has seen.
#[derive(Default)]
struct Seen {
    frame: Value,
    /// Least and largest setpoint of every span, with its tick.
    setpoints: Vec<(u32, [i64; 2])>,
    has_ended: bool,
}

/// A page that reads what comes and says that it is there.
pub struct Page {
    /// What only this page knows.
    pub name: String,
    socket: Socket,
    seen: Arc<Mutex<Seen>>,
    hangs: Arc<AtomicBool>,
}

impl Page {
    /// Opens one.
    pub fn open(site: &Site) -> Self {
        let mut socket = site.socket();
        let hello: Value = serde_json::from_str(&socket.next().unwrap()).unwrap();
        let name = hello["page"].as_str().unwrap().to_owned();
        let (seen, hangs) = (Arc::new(Mutex::new(Seen::default())), Arc::new(AtomicBool::new(false)));
        let page = Self { name, socket: socket.twin(), seen: Arc::clone(&seen), hangs: Arc::clone(&hangs) };
        std::thread::spawn(move || {
            while let Some(text) = socket.next() {
                see(&mut seen.lock().unwrap(), serde_json::from_str(&text).unwrap());
                if !hangs.load(Ordering::SeqCst) && !socket.say("here") {
                    break;
                }
            }
            seen.lock().unwrap().has_ended = true;
        });
        page
    }

    /// From now on it reads and says nothing, as a page whose script does not end.
    pub fn hang(&self) {
        self.hangs.store(true, Ordering::SeqCst);
    }

    /// Closes it.
    pub fn close(&self) {
        self.socket.hang_up();
    }

    /// Says a word over its stream.
    pub fn say(&self, word: &str) {
        assert!(self.socket.twin().say(word));
    }

    /// Waits for a frame of which this is true.
    pub fn wait(&self, what: &str, mut is_so: impl FnMut(&Value) -> bool) -> Value {
        let ends = Instant::now() + PATIENCE;
        loop {
            let (frame, has_ended) = {
                let seen = self.seen.lock().unwrap();
                (seen.frame.clone(), seen.has_ended)
            };
            if !frame.is_null() && is_so(&frame) {
                return frame;
            }
            assert!(Instant::now() < ends && !has_ended, "{what} has not come: {frame}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The newest frame.
    pub fn now(&self) -> Value {
        self.wait("a frame", |_| true)
    }

    /// The tick after the last span in which the setpoint changed, once the drive is off, which it was not in
    /// the frame of this number.
    pub fn standstill(&self, moving: u64) -> u32 {
        self.wait("the drive's end", |frame| {
            let is_off = frame["drive"]["state"] == "disabled" && frame["state"] == "rest";
            is_off && frame["number"].as_u64().unwrap() > moving
        });
        // Spans of 33 ticks: the newest frame may have been written before the last of them was whole.
        let settled = self.now()["number"].as_u64().unwrap() + 3;
        self.wait("three more frames", |frame| frame["number"].as_u64().unwrap() >= settled);
        let seen = self.seen.lock().unwrap();
        let moving = seen.setpoints.iter().rposition(|(_, [least, largest])| least != largest);
        seen.setpoints[moving.unwrap() + 1].0
    }

    /// Takes control and enables the drive.
    pub fn take_over(&self, site: &Site) {
        assert_eq!(site.post("control", &self.name, &json!({})).status, 200);
        self.enable(site);
    }

    /// Enables the drive.
    pub fn enable(&self, site: &Site) {
        let enabled = site.post("order", &self.name, &json!({ "order": "enable" }));
        assert_eq!(enabled.status, 200, "{}", enabled.body);
        self.wait("an enabled drive", |frame| {
            frame["drive"]["state"] == "enabled" && frame["state"] == "rest"
        });
    }

    /// Begins a move from wherever the axis is, waits until it moves, and returns the number of that frame.
    pub fn begin_move(&self, site: &Site, to_mm: f64, velocity_mm_s: f64) -> u64 {
        let from_mm = self.now()["command_nm"].as_f64().unwrap() / 1e6;
        let order = json!({
            "order": "move", "from_mm": from_mm, "to_mm": to_mm, "velocity_mm_s": velocity_mm_s,
            "acceleration_mm_s2": 5000.0
        });
        let begun = site.post("order", &self.name, &order);
        assert_eq!(begun.status, 200, "{}", begun.body);
        self.wait("a move", |frame| frame["state"] == "moving")["number"].as_u64().unwrap()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.close();
    }
}

fn see(seen: &mut Seen, frame: Value) {
    for span in frame["spans"].as_array().into_iter().flatten() {
        let tick = u32::try_from(span["tick"].as_u64().unwrap()).unwrap();
        let setpoint = [0, 1].map(|place| span["setpoint"][place].as_i64().unwrap());
        seen.setpoints.push((tick, setpoint));
    }
    seen.frame = frame;
}
