//! `stillbeam data` against a server of the test's own.

use crate::support;

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;

use sha2::{Digest, Sha256};
use stillbeam::data::DataError;
use stillbeam::data::catalogue::Original;
use stillbeam::data::download::{Arrival, client, fetch};
use support::{accepted, refused, stillbeam};

/// How the server treats requests.
#[derive(Clone, Copy, PartialEq)]
enum Manner {
    /// As a server should, parts of files too.
    Good,
    /// Parts are not known: always the whole file.
    WholeOnly,
    /// Hangs up in the middle.
    HangsUp,
    /// This status and no file.
    Status(u16),
}

/// A server of one file, on a port of its own; what was asked for is written down.
struct Server {
    base: String,
    ranges: Arc<Mutex<Vec<Option<u64>>>>,
}

impl Server {
    fn start(content: Vec<u8>, manner: Manner) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let base = format!("http://{}", listener.local_addr().unwrap());
        let ranges = Arc::new(Mutex::new(Vec::new()));
        let noted = Arc::clone(&ranges);
        // Ends with the test's process.
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let _client_may_be_gone = answer(stream, &content, manner, &noted);
            }
        });
        Self { base, ranges }
    }

    fn original(&self, sha256: Option<String>) -> Original {
        Original { url: format!("{}/run.csv", self.base), file: "run.csv".to_owned(), sha256 }
    }
}

fn answer(
    mut stream: TcpStream,
    content: &[u8],
    manner: Manner,
    noted: &Mutex<Vec<Option<u64>>>,
) -> std::io::Result<()> {
    let mut range = None;
    for line in BufReader::new(stream.try_clone()?).lines() {
        let line = line?.to_ascii_lowercase();
        if line.is_empty() {
            break;
        }
        if let Some(from) = line.strip_prefix("range: bytes=") {
            range = from.trim_end_matches('-').parse::<u64>().ok();
        }
    }
    noted.lock().unwrap().push(range);
    let length = content.len();
    let head = |status: &str, length: usize| {
        format!("HTTP/1.1 {status}\r\ncontent-length: {length}\r\nconnection: close\r\n\r\n")
    };
    match (manner, range) {
        (Manner::Status(status), _) => stream.write_all(head(&format!("{status} No"), 0).as_bytes()),
        (Manner::HangsUp, None) => {
            stream.write_all(head("200 OK", length).as_bytes())?;
            stream.write_all(&content[..length / 2])
        }
        (Manner::Good | Manner::HangsUp, Some(from)) if from < length as u64 => {
            let rest = &content[usize::try_from(from).unwrap()..];
            stream.write_all(head("206 Partial Content", rest.len()).as_bytes())?;
            stream.write_all(rest)
        }
        (Manner::Good, Some(_)) => stream.write_all(head("416 Range Not Satisfiable", 0).as_bytes()),
        _ => {
            stream.write_all(head("200 OK", length).as_bytes())?;
            stream.write_all(content)
        }
    }
}

fn sum(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// More than what fits into the buffers of a socket.
fn content() -> Vec<u8> {
    (0..1_000_000_u32).map(|k| (k % 251) as u8).collect()
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_right_file_gets_its_name_and_is_not_fetched_twice() {
    let (folder, content) = (tempfile::tempdir().unwrap(), content());
    let server = Server::start(content.clone(), Manner::Good);
    let original = server.original(Some(sum(&content)));
    let arrived = fetch(&client(), &original, original.sha256.as_deref(), folder.path()).unwrap();
    assert_eq!((arrived.arrival, arrived.sha256), (Arrival::Fetched(1_000_000), sum(&content)));
    assert_eq!(fs::read(folder.path().join("run.csv")).unwrap(), content);
    let again = fetch(&client(), &original, original.sha256.as_deref(), folder.path()).unwrap();
    assert_eq!(again.arrival, Arrival::WasThere);
    assert_eq!(server.ranges.lock().unwrap().len(), 1);
    assert_eq!(files(folder.path()), ["run.csv"]);
}

#[test]
fn a_wrong_file_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(content(), Manner::Good);
    let expected = sum(b"another file");
    let error =
        fetch(&client(), &server.original(None), Some(&expected), folder.path()).unwrap_err().to_string();
    assert!(error.contains(&sum(&content())) && error.contains(&expected), "{error}");
    assert!(files(folder.path()).is_empty());
}

#[test]
fn a_broken_transfer_is_taken_up_where_it_ended() {
    let (folder, content) = (tempfile::tempdir().unwrap(), content());
    let server = Server::start(content.clone(), Manner::HangsUp);
    let original = server.original(Some(sum(&content)));
    let get = || fetch(&client(), &original, original.sha256.as_deref(), folder.path());
    let error = get().unwrap_err();
    assert!(matches!(error, DataError::Broken { got: 500_000, .. }), "{error}");
    assert_eq!(files(folder.path()), ["run.csv.part"]);
    let arrived = get().unwrap();
    assert_eq!((arrived.arrival, arrived.sha256), (Arrival::Fetched(500_000), sum(&content)));
    assert_eq!(*server.ranges.lock().unwrap(), [None, Some(500_000)]);
    assert_eq!(files(folder.path()), ["run.csv"]);
}

#[test]
fn what_is_kept_helps_only_where_the_server_and_the_hash_agree() {
    let content = content();
    let kept = |bytes: &[u8], manner| {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("run.csv.part"), bytes).unwrap();
        let server = Server::start(content.clone(), manner);
        let fetched = fetch(&client(), &server.original(None), Some(&sum(&content)), folder.path());
        (fetched, files(folder.path()))
    };
    // A server that sends everything again.
    let (fetched, _) = kept(&content[..10], Manner::WholeOnly);
    assert_eq!(fetched.unwrap().arrival, Arrival::Fetched(1_000_000));
    // What is kept was all of it.
    let (fetched, there) = kept(&content, Manner::Good);
    assert_eq!((fetched.unwrap().sha256, there), (sum(&content), vec!["run.csv".to_owned()]));
    // What is kept was the beginning of something else.
    let (fetched, there) = kept(b"something else", Manner::Good);
    assert!(matches!(fetched, Err(DataError::WrongHash { .. })) && there.is_empty());
}

#[test]
fn without_a_hash_halves_are_not_put_together() {
    let (folder, content) = (tempfile::tempdir().unwrap(), content());
    let server = Server::start(content.clone(), Manner::Good);
    fs::write(folder.path().join("run.csv.part"), &content[..10]).unwrap();
    let arrived = fetch(&client(), &server.original(None), None, folder.path()).unwrap();
    assert_eq!((arrived.arrival, arrived.sha256), (Arrival::Fetched(1_000_000), sum(&content)));
    assert_eq!(*server.ranges.lock().unwrap(), [None]);
}

#[test]
fn a_file_that_is_there_and_wrong_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(content(), Manner::Good);
    fs::write(folder.path().join("run.csv"), "mine").unwrap();
    let error = fetch(&client(), &server.original(None), Some(&sum(&content())), folder.path()).unwrap_err();
    assert!(matches!(error, DataError::Occupied { .. }), "{error}");
    assert_eq!(fs::read_to_string(folder.path().join("run.csv")).unwrap(), "mine");
}

#[test]
fn refusals_of_the_server_are_told_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    for (status, remedy) in [(404, "--from"), (429, "later"), (503, "later")] {
        let server = Server::start(content(), Manner::Status(status));
        let error = fetch(&client(), &server.original(None), None, folder.path()).unwrap_err();
        assert!(matches!(error, DataError::Status { status: told, .. } if told == status), "{error}");
        assert!(error.to_string().contains(remedy), "{error}");
    }
    assert!(files(folder.path()).is_empty());
}

#[test]
fn without_a_network_nothing_is_left_and_the_message_says_so() {
    let folder = tempfile::tempdir().unwrap();
    // A port on which nobody listens any more.
    let gone = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let original =
        Original { url: format!("http://{gone}/run.csv"), file: "run.csv".to_owned(), sha256: None };
    let error = fetch(&client(), &original, None, folder.path()).unwrap_err();
    assert!(matches!(error, DataError::Unreachable { .. }), "{error}");
    assert!(error.to_string().contains("network"), "{error}");
    assert!(files(folder.path()).is_empty());
}

/// A limit on the size of files stands for a full disk: the write fails in the middle of the transfer.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_as_one_and_leaves_no_file_under_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(content(), Manner::Good);
    let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" \"$@\"";
    let run = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_stillbeam"), "data", "fetch", "silverbox", "--trust-first"])
        .args(["--from", &server.base, "--out"])
        .arg(folder.path())
        .output()
        .unwrap();
    let messages = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.code() == Some(1) && messages.contains("make room"), "{messages}");
    assert_eq!(files(&folder.path().join("silverbox")), ["SNLS80mV.csv.part"]);
}

#[test]
fn the_command_lists_fetches_and_remembers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let list = accepted(&["data", "list"]);
    for word in ["emps", "silverbox", "CC BY-SA 4.0", "SHA-256 of every original known", "--trust-first"] {
        assert!(list.contains(word), "{word}: {list}");
    }
    let json: serde_json::Value = serde_json::from_str(&accepted(&["data", "list", "--json", "-"])).unwrap();
    assert_eq!(json["sets"][0]["files"][0]["sha256"], serde_json::Value::Null);
    refused(&["data", "fetch", "emsp"], &["emsp", "emps, silverbox"]);

    let server = Server::start(b"u,y\n1,2\n".to_vec(), Manner::Good);
    let arguments = ["data", "fetch", "silverbox", "--out", out, "--from", server.base.as_str()];
    refused(&arguments, &["SNLS80mV.csv", "not known", "--trust-first"]);
    accepted(&[&arguments[..], &["--trust-first"]].concat());
    let sums = fs::read_to_string(folder.path().join("silverbox/SHA256SUMS")).unwrap();
    assert_eq!(sums, format!("{}  SNLS80mV.csv\n", sum(b"u,y\n1,2\n")));
    // The second time nothing is taken on trust.
    fs::remove_file(folder.path().join("silverbox/SNLS80mV.csv")).unwrap();
    accepted(&arguments);
    fs::remove_file(folder.path().join("silverbox/SNLS80mV.csv")).unwrap();
    let changed = Server::start(b"u,y\n1,3\n".to_vec(), Manner::Good);
    let run = stillbeam(&["data", "fetch", "silverbox", "--out", out, "--from", &changed.base]);
    assert!(run.code == 1 && run.messages.contains("damaged on the way or changed"), "{}", run.messages);
    assert!(!folder.path().join("silverbox/SNLS80mV.csv").exists());

    // What the list knows is not taken on trust either.
    let arguments = ["data", "fetch", "klipper_raw_belt_printer", "--trust-first", "--out", out];
    let run = stillbeam(&[&arguments[..], &["--from", &changed.base]].concat());
    assert!(run.code == 1 && run.messages.contains("adxl345-belt_A_1.csv"), "{}", run.messages);
}
