//! The core's setpoints leave the modes they were shaped for still.

use std::path::Path;

use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::still_beam::{
    DESIGN, amplitude_nm, percentage_vibration, results_page, worst_five_per_cent_off,
};

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

/// What the beam's modes are left with, in nanometres, after a motion with this profile and shaper, stopped
/// after so many ticks if at all.
fn left_nm(profile: &str, shaper: &str, motion: &str, stop_after: Option<usize>) -> [f64; 2] {
    let mut bench = Bench::enabled();
    bench.accept(&format!("set move.profile {profile}"));
    for ((frequency_hz, damping_ratio), number) in DESIGN.into_iter().zip(1..) {
        bench.accept(&format!("set mode{number}.frequency_hz {frequency_hz}"));
        bench.accept(&format!("set mode{number}.damping_ratio {damping_ratio}"));
        bench.accept(&format!("set mode{number}.type {shaper}"));
    }
    bench.accept("apply");
    bench.run_to_rest();
    bench.accept(motion);
    if let Some(ticks) = stop_after {
        for _ in 0..ticks {
            bench.tick();
        }
        bench.accept("stop");
    }
    let setpoints_nm = bench.run_to_rest();
    DESIGN.map(|mode| amplitude_nm(&setpoints_nm, mode))
}

/// Shaping is linear: whatever the command does, ended or stopped, no mode rings on.
#[test]
fn every_motion_of_every_profile_leaves_the_beam_still_and_so_does_its_stop() {
    for profile in ["trapezoid", "s_curve", "minimum_jerk"] {
        for motion in ["move 50", "sweep linear 1 3 4 2", "multisine 1 8 2 1 0.5", "pulse 10"] {
            for stop_after in [None, Some(150), Some(700)] {
                let shaped_nm = left_nm(profile, "zvd", motion, stop_after);
                // Rounding to nanometres is all that is left to excite.
                assert!(
                    shaped_nm.iter().all(|left| *left < 300.0),
                    "{profile}, {motion}, {stop_after:?}: {shaped_nm:?}"
                );
            }
        }
    }
}

#[test]
fn a_decay_without_a_shaper_rings_both_modes() {
    for profile in ["trapezoid", "s_curve"] {
        let left_nm = left_nm(profile, "off", "decay 2 1", None);
        assert!(left_nm[0] > 1e5 && left_nm[1] > 1e5, "{profile}: {left_nm:?}");
    }
}
