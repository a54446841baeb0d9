//! `stillbeam live`: who is answered, who controls, and that a stop stops.

use crate::support;

use std::net::TcpStream;
use std::time::Duration;

use serde_json::json;
use stillbeam::board::ByteLink;
use stillbeam::board::in_process::InProcessBoard;
use stillbeam::board::paced::PacedBoard;
use stillbeam_firmware::control::{Inputs, TickOutput};
use support::live::{Page, Site};
use support::web::{Socket, request};
use support::{refused, stillbeam};

/// Ticks of the core in 100 ms.
const TICKS_OF_100_MS: u32 = 400;

#[test]
fn only_pages_of_the_server_that_know_the_token_are_answered() {
    let site = Site::start();
    let own = site.address.as_str();
    let origin = format!("http://{own}");
    let port = own.split(':').nth(1).unwrap();
    let (local, local_origin) = (format!("localhost:{port}"), format!("http://localhost:{port}"));
    let page = format!("GET {}", site.root);
    let stop = format!("POST {}stop", site.root);
    let stranger = format!("GET /{}/", "0".repeat(32));
    let shorter = format!("GET {}/", &site.root[..site.root.len() - 2]);
    type Headers<'h> = &'h [(&'h str, &'h str)];
    let cases: [(&str, u16, &str, Headers<'_>); 16] = [
        ("a person opens the address", 200, &page, &[("Host", own)]),
        ("by its other name", 200, &page, &[("Host", &local)]),
        ("without the token", 403, "GET /", &[("Host", own)]),
        ("with a token of zeros", 403, &stranger, &[("Host", own)]),
        ("with a part of the token", 403, &shorter, &[("Host", own)]),
        ("under a foreign name", 421, &page, &[("Host", "rebound.example")]),
        ("under a foreign name with the port", 421, &page, &[("Host", &format!("rebound.example:{port}"))]),
        ("at another port", 421, &page, &[("Host", "127.0.0.1:1")]),
        ("without a name", 400, &page, &[]),
        ("by a foreign page", 403, &page, &[("Host", own), ("Sec-Fetch-Site", "cross-site")]),
        ("a page stops", 200, &stop, &[("Host", own), ("Origin", &origin)]),
        ("by its other name", 200, &stop, &[("Host", &local), ("Origin", &local_origin)]),
        ("without an origin", 403, &stop, &[("Host", own)]),
        ("of a foreign page", 403, &stop, &[("Host", own), ("Origin", "http://evil.example")]),
        ("of no page", 403, &stop, &[("Host", own), ("Origin", "null")]),
        ("of another port", 403, &stop, &[("Host", own), ("Origin", "http://127.0.0.1:1")]),
    ];
    for (what, status, line, headers) in cases {
        let answer = request(own, line, headers, "");
        let found = answer.status;
        // HTTP itself refuses a request without a name, or this server does.
        assert!(found == status || (headers.is_empty() && found == 421), "{what}: {found} {}", answer.body);
        assert!(found == 200 || !answer.body.contains("<html"), "{what}");
        if found != 400 {
            assert!(answer.head.contains("default-src 'none'; script-src 'self'"), "{what}: {}", answer.head);
            assert!(
                answer.head.contains("frame-ancestors 'none'") && answer.head.contains("no-store"),
                "{what}"
            );
        }
    }
    let opened = |headers: Headers<'_>, path: &str| Socket::open(own, path, headers).err();
    let socket = format!("{}socket", site.root);
    assert_eq!(opened(&[("Host", own), ("Origin", &origin)], &socket), None);
    assert_eq!(opened(&[("Host", own)], &socket), Some(403));
    assert_eq!(opened(&[("Host", own), ("Origin", "http://evil.example")], &socket), Some(403));
    assert_eq!(opened(&[("Host", "evil.example"), ("Origin", "http://evil.example")], &socket), Some(421));
    assert_eq!(opened(&[("Host", own), ("Origin", &origin)], "/socket"), Some(403));
    let large = "9".repeat(5000);
    let headers = [("Host", own), ("Origin", origin.as_str()), ("Content-Type", "application/json")];
    assert_eq!(request(own, &format!("POST {}preview", site.root), &headers, &large).status, 413);
}

#[test]
fn nothing_but_the_loopback_address_is_listened_on() {
    let site = Site::start();
    let port: u16 = site.address.split(':').nth(1).unwrap().parse().unwrap();
    assert!(site.address.starts_with("127.0.0.1:"));
    // Another address of this computer is refused, and it has more of the loopback's than one.
    assert!(TcpStream::connect_timeout(&([127, 0, 0, 2], port).into(), Duration::from_secs(5)).is_err());
    let Ok(table) = std::fs::read_to_string("/proc/net/tcp") else { return };
    let table6 = std::fs::read_to_string("/proc/net/tcp6").unwrap_or_default();
    let listening: Vec<&str> = table
        .lines()
        .chain(table6.lines())
        .filter_map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let (address, hexadecimal) = words.get(1)?.rsplit_once(':')?;
            let is_here = u16::from_str_radix(hexadecimal, 16) == Ok(port) && words.get(3) == Some(&"0A");
            is_here.then_some(address)
        })
        .collect();
    assert_eq!(listening, ["0100007F"]);
}

#[test]
fn one_page_controls_and_the_others_watch_until_it_has_gone() {
    let site = Site::start();
    let (first, second) = (Page::open(&site), Page::open(&site));
    let order = |page: &Page| site.post("order", &page.name, &json!({ "order": "enable" }));
    let watching = order(&first);
    assert!(watching.status == 409 && watching.body.contains("take control"), "{}", watching.body);
    assert_eq!(site.post("control", &first.name, &json!({})).status, 200);
    let taken = site.post("control", &second.name, &json!({}));
    assert!(taken.status == 409 && taken.body.contains("another page controls"), "{}", taken.body);
    for path in ["order", "recording/anew", "recording/save"] {
        assert_eq!(site.post(path, &second.name, &json!({ "order": "enable" })).status, 409, "{path}");
    }
    assert_eq!(site.post("control", "", &json!({})).status, 409, "a page without a name");
    assert_ne!(second.now()["drive"]["state"], "enabled", "nobody has pressed enable with control");
    first.close();
    second.wait("that nobody controls", |frame| frame["is_controlled"] == false && frame["pages"] == 1);
    second.take_over(&site);
    assert_eq!(site.post("control/release", &second.name, &json!({})).status, 200);
    assert_eq!(order(&second).status, 409);
}

#[test]
fn nothing_moves_before_enable_and_only_from_where_the_page_showed_it() {
    let site = Site::start();
    let page = Page::open(&site);
    assert_eq!(site.post("control", &page.name, &json!({})).status, 200);
    let go = |from_mm: f64, to_mm: f64| {
        let order = json!({
            "order": "move", "from_mm": from_mm, "to_mm": to_mm, "velocity_mm_s": 100.0,
            "acceleration_mm_s2": 5000.0
        });
        site.post("order", &page.name, &order)
    };
    let off = go(0.0, 1.0);
    assert!(off.status == 409 && off.body.contains("the board refuses"), "{}", off.body);
    page.enable(&site);
    let elsewhere = go(3.0, 1.0);
    assert!(elsewhere.status == 409 && elsewhere.body.contains("look again"), "{}", elsewhere.body);
    let outside = go(0.0, 999.0);
    assert!(outside.status == 409 && outside.body.contains("travel"), "{}", outside.body);
    assert_eq!(page.now()["command_nm"], 0);
    assert_eq!(go(0.0, 1.0).status, 200);
    page.wait("the target", |frame| frame["command_nm"] == 1_000_000 && frame["state"] == "rest");
    for wrong in [json!({ "order": "fly" }), json!({ "order": "move" }), json!({})] {
        assert_eq!(site.post("order", &page.name, &wrong).status, 422, "{wrong}");
    }
}

/// Any page may stop, by request or over its stream. Counted in the board's own ticks, from the newest that
/// the server knew when it was asked to the standstill of the setpoint: 20 ms of them are braking.
#[test]
fn a_stop_of_any_page_reaches_the_drive_within_a_tenth_of_a_second() {
    let site = Site::start();
    let (controller, viewer) = (Page::open(&site), Page::open(&site));
    controller.take_over(&site);
    let mut from_the_press = Vec::new();
    for (attempt, to_mm) in [200.0, -200.0, 200.0, -200.0, 200.0].into_iter().enumerate() {
        if attempt > 0 {
            controller.enable(&site);
        }
        let moving = controller.begin_move(&site, to_mm, 100.0);
        viewer.wait("the move", |frame| frame["number"].as_u64().unwrap() >= moving);
        let shown = u32::try_from(viewer.now()["tick"].as_u64().unwrap()).unwrap();
        let asked = if attempt % 2 == 0 {
            let stopped = site.post("stop", "", &json!({}));
            assert_eq!(stopped.status, 200, "{}", stopped.body);
            let told: serde_json::Value = serde_json::from_str(&stopped.body).unwrap();
            Some(u32::try_from(told["tick"].as_u64().unwrap()).unwrap())
        } else {
            viewer.say("stop");
            None
        };
        let still = viewer.standstill(moving);
        if let Some(asked) = asked {
            let ticks = still.wrapping_sub(asked);
            assert!(ticks <= TICKS_OF_100_MS, "{ticks} ticks after the request");
        }
        from_the_press.push(still.wrapping_sub(shown));
        assert_ne!(viewer.now()["command_nm"].as_f64(), Some(1e6 * to_mm), "it did not arrive");
    }
    // What a page has shown is older than the board, and computers are busy at times.
    let best = from_the_press.iter().min().unwrap();
    assert!(*best <= TICKS_OF_100_MS, "{from_the_press:?} ticks after the press");
    println!("ticks from what the page showed when stop was pressed to standstill: {from_the_press:?}");
}

/// A sample that is lost would leave an empty row and be counted in the side file.
#[test]
fn fifty_pages_and_one_that_never_reads_cost_no_sample_of_the_recording() {
    let site = Site::start();
    let controller = Page::open(&site);
    controller.take_over(&site);
    let _never_reads = site.socket();
    let viewers: Vec<Page> = (0..50).map(|_| Page::open(&site)).collect();
    viewers.iter().step_by(5).for_each(Page::hang);
    controller.wait("all pages", |frame| frame["pages"] == 52);
    assert_eq!(site.post("recording/anew", &controller.name, &json!({})).status, 200);
    let begun = controller.now();
    for to_mm in [100.0, 0.0] {
        controller.begin_move(&site, to_mm, 100.0);
        controller.wait("the target", |frame| frame["state"] == "rest");
    }
    let ended = controller.wait("8000 samples", |frame| frame["kept_samples"].as_u64().unwrap() >= 8000);
    assert_eq!(ended["lost_samples"], 0);
    let frames = ended["number"].as_u64().unwrap() - begun["number"].as_u64().unwrap();
    assert!(frames >= 30, "{frames} frames");
    let saved = site.post("recording/save", &controller.name, &json!({}));
    assert_eq!(saved.status, 200, "{}", saved.body);
    let files: Vec<_> = std::fs::read_dir(&site.folder).unwrap().map(|file| file.unwrap().path()).collect();
    let of = |kind: &str| files.iter().find(|file| file.extension().unwrap() == kind).unwrap();
    let recording = std::fs::read_to_string(of("csv")).unwrap();
    let mut rows = recording.lines();
    assert!(rows.next().unwrap().starts_with("time_s,command_m,setpoint_m,"));
    for (number, row) in rows.enumerate() {
        let cells: Vec<&str> = row.split(',').collect();
        assert!(cells.iter().all(|cell| !cell.is_empty()), "row {number}: {row}");
        assert!(
            (cells[0].parse::<f64>().unwrap() - number as f64 / 4000.0).abs() < 1e-9,
            "row {number}: {row}"
        );
    }
    assert!(recording.lines().count() > 8000);
    assert!(std::fs::read_to_string(of("toml")).unwrap().contains("lost_samples = 0"));
    assert_eq!(viewers[1].now()["lost_samples"], 0);
}

#[test]
fn a_move_stops_when_the_page_that_controls_goes_away_or_hangs() {
    let site = Site::start();
    let viewer = Page::open(&site);
    let close: (&str, fn(&Page)) = ("closed", Page::close);
    for ((how, go_away), to_mm) in [close, ("hung", Page::hang)].into_iter().zip([200.0, -200.0]) {
        let controller = Page::open(&site);
        controller.take_over(&site);
        let moving = controller.begin_move(&site, to_mm, 10.0);
        go_away(&controller);
        viewer.standstill(moving);
        let now = viewer.now();
        assert_eq!(now["is_controlled"], false, "{how}");
        assert!((now["command_nm"].as_f64().unwrap() / 1e6 - to_mm).abs() > 50.0, "{how}: {now}");
    }
    // While nothing moves, nobody has to control: the drive stays as it is, and anybody may stop.
    let controller = Page::open(&site);
    controller.take_over(&site);
    controller.close();
    let frames = viewer.wait("that", |frame| frame["is_controlled"] == false)["number"].as_u64().unwrap();
    let later = viewer.wait("ten frames", |frame| frame["number"].as_u64().unwrap() > frames + 10);
    assert_eq!(later["drive"]["state"], "enabled");
    viewer.say("stop");
    viewer.wait("the drive's end", |frame| frame["drive"]["state"] == "disabled");
}

#[test]
fn a_shaper_is_previewed_by_anybody_and_applied_as_it_was_previewed() {
    let site = Site::start();
    let page = Page::open(&site);
    let modes = json!([
        { "kind": "zvd", "frequency_hz": 6.9, "damping_ratio": 0.0059 },
        { "kind": "zv", "frequency_hz": 20.0, "damping_ratio": 0.01 }
    ]);
    let previewed = site.post("preview", "", &json!({ "modes": modes }));
    let told: serde_json::Value = serde_json::from_str(&previewed.body).unwrap();
    let crc = told["crc32"].as_str().unwrap();
    assert!(told["settling_s"].as_f64().unwrap() < told["settling_unshaped_s"].as_f64().unwrap());
    assert_eq!(told["curve"].as_array().unwrap().len(), 241);
    assert_eq!(site.post("control", &page.name, &json!({})).status, 200);
    let before = page.now()["settings"].as_u64().unwrap();
    let applied = site.post("order", &page.name, &json!({ "order": "apply", "modes": modes }));
    assert!(applied.status == 200 && applied.body.contains(crc), "{crc}: {}", applied.body);
    page.wait("new settings", |frame| frame["settings"].as_u64().unwrap() > before);
    let settings = request(&site.address, &format!("GET {}board", site.root), &[("Host", &site.address)], "");
    let settings: serde_json::Value = serde_json::from_str(&settings.body).unwrap();
    assert_eq!(settings["settings"]["modes"], modes);
    let wrong =
        json!({ "order": "apply", "modes": [{ "kind": "zvd", "frequency_hz": -1, "damping_ratio": 0 }] });
    let refused = site.post("order", &page.name, &wrong);
    assert!(refused.status == 409 && refused.body.contains("mode 1"), "{}", refused.body);
}

/// A machine with a mode at 8 Hz behind the board's encoder.
fn ringing_core() -> Box<dyn ByteLink> {
    let (omega, damping, tick_s) = (std::f64::consts::TAU * 8.0, 0.05, 1.0 / 4000.0);
    let (mut position_mm, mut velocity) = (0.0, 0.0);
    let mut core = InProcessBoard::wired(Box::new(move |last: Option<&TickOutput>| {
        let setpoint_mm = last.map_or(0.0, |output| f64::from(output.setpoint.0) * 1e-6);
        velocity += tick_s * (omega * omega * (setpoint_mm - position_mm) - 2.0 * damping * omega * velocity);
        position_mm += tick_s * velocity;
        // The counter has 16 bits.
        let counter = (1000.0 * position_mm).round() as i32 as u16;
        Inputs { encoder_counter: counter, ..Inputs::default() }
    }));
    for line in ["set encoder.counts_per_mm 1000\r", "apply\r"] {
        core.write_all(line.as_bytes()).unwrap();
        core.pause(Duration::from_millis(100));
    }
    Box::new(PacedBoard::new(core))
}

#[test]
fn a_sweep_shows_the_mode_of_the_machine_as_it_comes_to_it() {
    let site = Site::of(ringing_core);
    let page = Page::open(&site);
    page.take_over(&site);
    let shown = || {
        let shown = site.post("response", "", &json!({}));
        assert_eq!(shown.status, 200, "{}", shown.body);
        serde_json::from_str::<serde_json::Value>(&shown.body).unwrap()
    };
    assert!(site.post("response", "", &json!({})).body.contains("no sweep yet"));
    let sweep = json!({
        "order": "sweep", "from_mm": 0.0, "from_hz": 2.0, "to_hz": 20.0, "seconds": 8.0, "amplitude_mm": 0.2
    });
    let begun = site.post("order", &page.name, &sweep);
    assert_eq!(begun.status, 200, "{}", begun.body);
    let sweeping = page.wait("a sweep", |frame| frame["state"] == "sweeping");
    let later = sweeping["tick"].as_u64().unwrap() + 12_000;
    page.wait("a part of it", |frame| frame["tick"].as_u64().unwrap() > later);
    let part = shown();
    page.wait("its end", |frame| frame["state"] == "rest");
    let whole = shown();
    let reached = |shown: &serde_json::Value| shown["reached_hz"].as_f64().unwrap();
    assert!(reached(&part) < 12.0 && (reached(&whole) - 20.0).abs() < 1e-6, "{part}");
    let points = |shown: &serde_json::Value| shown["curve"].as_array().unwrap().len();
    assert!(points(&part) > 3 && points(&part) < points(&whole));
    let curve = whole["curve"].as_array().unwrap().iter();
    let gains: Vec<[f64; 2]> =
        curve.map(|point| [0, 1].map(|place| point[place].as_f64().unwrap())).collect();
    let top = gains.iter().max_by(|one, other| one[1].total_cmp(&other[1])).unwrap();
    assert!((top[0] - 8.0).abs() < 0.4 && top[1] > 5.0, "{top:?}");
    let low = gains.iter().find(|point| point[0] > 3.0).unwrap();
    // 1 / (1 − (3/8)²), far below the mode.
    assert!((low[1] - 1.16).abs() < 0.1, "{low:?}");
}

#[test]
fn the_command_refuses_a_folder_that_is_not_there_and_a_port_that_is_taken() {
    refused(&["live", "--out", "/nowhere/at/all"], &["/nowhere/at/all", "create it first"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    refused(&["live", "--listen", &port], &["127.0.0.1", &port, "--listen"]);
    let help = stillbeam(&["live", "--help"]).out;
    assert!(help.contains("Example:") && help.contains("stillbeam live --port /dev/ttyACM0"), "{help}");
}
