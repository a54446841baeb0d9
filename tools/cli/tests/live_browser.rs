//! The page of `stillbeam live` in a browser, with the core as the board.

use crate::support;

use support::browser::Browser;
use support::live::{Page, Site};

/// Ticks of the core in 100 ms.
const TICKS_OF_100_MS: u32 = 400;

#[test]
fn the_page_enables_moves_and_stops_by_its_button_and_by_a_key() {
    let Some(mut browser) = Browser::start() else { return };
    let site = Site::start();
    let viewer = Page::open(&site);
    browser.open_live(&site.url());
    browser.wait("by('enable').disabled && !by('control').disabled");
    assert_ne!(viewer.now()["drive"]["state"], "enabled", "a page that is opened enables nothing");
    browser.click("control");
    let button = "{ const shown = frame.tick; by('stop').click(); shown }";
    let mut presses = Vec::new();
    for (attempt, to_mm) in [200.0, -200.0, 200.0, -200.0].into_iter().enumerate() {
        browser.begin_move(to_mm);
        let moving = viewer.wait("the move", |frame| frame["state"] == "moving")["number"].as_u64().unwrap();
        let shown = if attempt % 2 == 0 {
            browser.value(button)
        } else {
            // Also while a field is being typed in.
            browser.value("by('target').focus()");
            let shown = browser.value("frame.tick");
            browser.press("Escape", 27);
            shown
        };
        let shown = u32::try_from(shown.as_u64().unwrap()).unwrap();
        presses.push(viewer.standstill(moving).wrapping_sub(shown));
        browser.wait("by('told').textContent.startsWith('Stop: ')");
        browser.wait("by('drive').textContent === 'disabled'");
    }
    // What a page has shown is older than the board, and computers are busy at times.
    let best = presses.iter().min().unwrap();
    assert!(*best <= TICKS_OF_100_MS, "{presses:?} ticks after the press");
    println!("ticks from what the page showed when stop was pressed to standstill: {presses:?}");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn the_page_previews_a_shaper_while_it_is_changed_and_fits_a_phone_in_light_and_dark() {
    let Some(mut browser) = Browser::start() else { return };
    let site = Site::start();
    browser.open_live(&site.url());
    browser.click("control");
    browser.wait("controls");
    let field = |name: &str| format!("document.querySelector('[data-mode=\"1\"] [name={name}]')");
    for (name, value) in [("kind", "zvd"), ("frequency_hz", "6.9"), ("damping_ratio", "0.0059")] {
        browser.fill(&field(name), value);
    }
    browser.wait("by('expected').textContent.includes('Still 0.145 s after the command ends')");
    browser.value("by('shaper').requestSubmit()");
    browser.wait("by('applied').textContent.includes('a shaper of 145.')");
    browser.fill(&field("frequency_hz"), "13.8");
    browser.wait("by('expected').textContent.includes('Still 0.072')");
    let mut grounds = Vec::new();
    for is_dark in [false, true] {
        browser.show_as(390, is_dark);
        browser.wait("document.documentElement.scrollWidth <= 390");
        grounds.push(browser.value("getComputedStyle(document.body).backgroundColor"));
        let stop = browser.value("JSON.stringify(by('stop').getBoundingClientRect())");
        let stop: serde_json::Value = serde_json::from_str(stop.as_str().unwrap()).unwrap();
        assert!(
            stop["bottom"].as_f64().unwrap() < 200.0 && stop["height"].as_f64().unwrap() >= 44.0,
            "{stop}"
        );
    }
    assert_ne!(grounds[0], grounds[1]);
    browser.value("window.scrollTo(0, 1000)");
    browser
        .wait("by('stop').getBoundingClientRect().top >= 0 && by('stop').getBoundingClientRect().top < 100");
    let unnamed = "[...document.querySelectorAll('input, select, button, canvas')].filter((it) => \
                   !(it.ariaLabel || it.textContent.trim() || it.closest('label'))).length";
    assert_eq!(browser.value(unnamed), 0, "everything has a name");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}
