//! The unmodified image on its emulated board, moved and stopped on the live page in a browser.

use std::path::PathBuf;

use serde_json::json;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};

#[path = "../../tools/cli/tests/support/browser.rs"]
#[allow(dead_code, reason = "the tests of the command use more of it")]
mod browser;
#[path = "../../tools/cli/tests/support/live.rs"]
#[allow(dead_code, reason = "the tests of the command use more of it")]
mod live;
#[path = "../../tools/cli/tests/support/web.rs"]
#[allow(dead_code, reason = "the tests of the command use more of it")]
mod web;

use browser::Browser;
use live::{Page, Site};

/// Ticks of the image.
const TICKS_PER_MS: f64 = 4.0;

/// The page presses its button and looks until it sees the axis at rest: the tick that it showed when it was
/// pressed, and the milliseconds until then. Frames come every 33 ms.
const PRESS: &str = "new Promise((done) => {
    const shown = frame.tick, pressed = performance.now();
    const told = () => done([shown, performance.now() - pressed]);
    const look = () => frame.state === 'rest' ? told() : setTimeout(look, 1);
    by('stop').click();
    look();
})";

/// From the press to the standstill that the page sees, 20 ms of braking included. The emulator's time is not
/// the wall's: where it is faster, more ticks pass on the way to it; where slower, braking takes longer. So
/// the better of both clocks counts, in the best of four presses, for computers are busy at times.
#[test]
fn the_page_stops_the_image_within_a_tenth_of_a_second_among_fifty_viewers() {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return;
    };
    let Some(mut browser) = Browser::start() else { return };
    let emulator = Emulator::boot(&image, &EmulatorOptions::default()).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let site = Site::of(move || Box::new(SerialBoard::open(&path).expect("the port opens")));
    let viewer = Page::open(&site);
    browser.open_live(&site.url());
    browser.click("control");
    let mut presses = Vec::new();
    let mut others = Vec::new();
    for to_mm in [200.0, -200.0, 200.0, -200.0] {
        browser.begin_move(to_mm);
        let moving = viewer.wait("the move", |frame| frame["state"] == "moving");
        // The page has to have seen the move, or it would see the rest before it.
        browser.wait("frame.state === 'moving'");
        let pressed = browser.value(PRESS);
        let shown = u32::try_from(pressed[0].as_u64().expect("a tick")).expect("32 bits");
        let still = viewer.standstill(moving["number"].as_u64().expect("a number"));
        let in_ticks_ms = f64::from(still.wrapping_sub(shown)) / TICKS_PER_MS;
        presses.push([in_ticks_ms, pressed[1].as_f64().expect("milliseconds")]);
        assert_ne!(viewer.now()["command_nm"].as_f64(), Some(1e6 * to_mm), "it did not arrive");
        // The press is told by both of its ways, and the second would cancel the next enable.
        browser.wait("by('told').textContent.startsWith('Stop: ') && by('drive').textContent === 'disabled'");
        // From the second press on they look on, a tenth of them without an answer.
        if others.is_empty() {
            others.extend((0..50).map(|_| Page::open(&site)));
            others.iter().step_by(10).for_each(Page::hang);
        }
    }
    let frame = viewer.now();
    println!("ms from the press to standstill, by the board's ticks and by the page's clock: {presses:?}");
    let best = presses.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    assert!(best <= 100.0, "{presses:?} ms after the press");
    assert_eq!(frame["lost_samples"], 0, "every tick has come, with fifty viewers");
    assert_eq!(site.post("recording/save", "", &json!({})).status, 409, "viewers save nothing");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}
