//! A browser without a window, driven by its remote debugging protocol.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::web::{Socket, request};

/// What it may be called.
const PROGRAMS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// How long anything may take on a computer that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one page. It ends with this value.
pub struct Browser {
    child: Child,
    socket: Socket,
    calls: u64,
    /// What the page has complained of: exceptions, and whatever its policy has refused.
    pub complaints: Vec<String>,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Starts one; `None`, with a word about it, where none is installed.
    pub fn start() -> Option<Self> {
        let path = std::env::var_os("PATH")?;
        let mut folders = std::env::split_paths(&path);
        let found =
            folders.find_map(|folder| PROGRAMS.iter().map(|name| folder.join(name)).find(|it| it.is_file()));
        let Some(program) = found else {
            println!("not run: there is no browser; install chromium to test the page in one");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (send, receive) = mpsc::channel();
        let messages = BufReader::new(child.stderr.take().unwrap());
        // Reads on to the end, so that the browser never waits to be read.
        std::thread::spawn(move || {
            for line in messages.lines().map_while(Result::ok) {
                if let Some((_, rest)) = line.split_once("listening on ws://") {
                    send.send(rest.split('/').next().unwrap_or_default().to_owned()).unwrap();
                }
            }
        });
        let address = receive.recv_timeout(PATIENCE).expect("the browser's address");
        let (socket, calls) = (page_of(&address), 0);
        let mut browser = Self { child, socket, calls, complaints: Vec::new(), _profile: profile };
        for domain in ["Runtime", "Log", "Page"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// The value of an expression on the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let asked = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        self.call("Runtime.evaluate", asked)["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn wait(&mut self, expression: &str) {
        let ends = Instant::now() + PATIENCE;
        while self.value(expression) != true {
            assert!(Instant::now() < ends, "{expression}: {:?}", self.complaints);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Presses a button of the page as soon as it may be pressed.
    pub fn click(&mut self, id: &str) {
        self.wait(&format!("!by('{id}').disabled"));
        self.value(&format!("by('{id}').click()"));
    }

    /// Fills a field of the page as typing does.
    pub fn fill(&mut self, field: &str, value: &str) {
        let typed = "new Event('input', { bubbles: true })";
        self.value(&format!("{{ const it = {field}; it.value = '{value}'; it.dispatchEvent({typed}); }}"));
    }

    /// Opens the live page and waits until it shows the board.
    pub fn open_live(&mut self, url: &str) {
        self.call("Page.navigate", json!({ "url": url }));
        self.wait("typeof by === 'function' && page !== '' && frame !== null && facts !== null");
    }

    /// On a live page that controls: enables the drive and begins a move at 100 mm/s.
    pub fn begin_move(&mut self, to_mm: f64) {
        self.click("enable");
        self.wait("frame.drive.state === 'enabled' && frame.state === 'rest'");
        self.fill("by('velocity')", "100");
        self.fill("by('target')", &to_mm.to_string());
        self.wait(&format!("by('way').textContent.includes('to {to_mm:.3} mm')"));
        self.value("by('move').requestSubmit()");
    }

    /// Presses a key.
    pub fn press(&mut self, key: &str, code: u32) {
        let pressed = json!({ "type": "keyDown", "key": key, "code": key, "windowsVirtualKeyCode": code });
        self.call("Input.dispatchKeyEvent", pressed);
    }

    /// Makes the page as wide as this many pixels, dark or light.
    pub fn show_as(&mut self, width: u32, is_dark: bool) {
        let size = json!({ "width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 500 });
        self.call("Emulation.setDeviceMetricsOverride", size);
        let scheme = if is_dark { "dark" } else { "light" };
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", features);
    }

    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.calls += 1;
        let call = json!({ "id": self.calls, "method": method, "params": parameters });
        assert!(self.socket.say(&call.to_string()), "{method}");
        loop {
            let text = self.socket.next().expect("the browser's answer");
            let answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == self.calls {
                return answer["result"].clone();
            }
            if answer["method"] == "Log.entryAdded" || answer["method"] == "Runtime.exceptionThrown" {
                self.complaints.push(answer["params"].to_string());
            }
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _gone = self.child.kill();
        let _reaped = self.child.wait();
    }
}

/// The stream of the browser's only page.
fn page_of(address: &str) -> Socket {
    let listed = request(address, "GET /json", &[("Host", address)], "");
    let targets: Value = serde_json::from_str(&listed.body).unwrap();
    let page = targets.as_array().unwrap().iter().find(|target| target["type"] == "page").unwrap();
    let url = page["webSocketDebuggerUrl"].as_str().unwrap();
    let path = url.split_once(address).unwrap().1;
    Socket::open(address, path, &[("Host", address)]).unwrap_or_else(|status| panic!("{status}"))
}
