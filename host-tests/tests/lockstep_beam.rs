//! The core's setpoints leave the modes they were shaped for still.

use std::path::Path;

use stillbeam_host_tests::still_beam::{DESIGN, percentage_vibration, results_page, worst_five_per_cent_off};

#[test]
fn at_the_design_point_two_mode_shapers_leave_nothing() {
    for shaper in ["zv", "zvd", "zvdd"] {
        let left = percentage_vibration(&DESIGN.map(|mode| (mode, shaper)), DESIGN);
        // The goal is 0.05 %; what is left is the rounding of setpoints to nanometres.
        assert!(left.iter().all(|percent| *percent < 0.001), "{shaper}: {left:?} %");
    }
}

#[test]
fn five_per_cent_off_two_mode_shapers_keep_their_robustness() {
    for (shaper, bound) in [("zv", 7.6), ("zvd", 0.57), ("zvdd", 0.04)] {
        let left = worst_five_per_cent_off(&DESIGN.map(|mode| (mode, shaper)));
        assert!(left.iter().all(|percent| *percent <= bound + 0.05), "{shaper}: {left:?} %");
    }
}

/// Whatever the other mode does: each is kept still by its own stage.
#[test]
fn modes_may_be_off_independently() {
    for (first, second) in [(0.95, 1.05), (1.05, 0.95), (1.0, 0.95), (1.05, 1.0)] {
        let plant = [(DESIGN[0].0 * first, DESIGN[0].1), (DESIGN[1].0 * second, DESIGN[1].1)];
        let left = percentage_vibration(&DESIGN.map(|mode| (mode, "zvd")), plant);
        assert!(left.iter().all(|percent| *percent <= 0.57 + 0.05), "{plant:?}: {left:?} %");
    }
}

#[test]
fn single_mode_shapers_leave_the_second_mode_ringing() {
    for shaper in ["zv", "zvd", "zvdd"] {
        let left = percentage_vibration(&[(DESIGN[0], shaper)], DESIGN);
        assert!(left[0] < 0.001 && left[1] > 30.0, "{shaper}: {left:?} %");
    }
}

#[test]
fn the_published_results_are_those_of_this_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/results/still_beam.md");
    let published = std::fs::read_to_string(path).expect("docs/results/still_beam.md");
    assert_eq!(published, results_page(), "make it anew with the command in its second line");
}
