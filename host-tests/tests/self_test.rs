//! The table of `selftest`, and when there is one.

use stillbeam_firmware::self_test::SelfTest;
use stillbeam_host_tests::bench::Bench;

#[test]
fn what_was_found_is_told_beside_what_is_right() {
    let mut found = SelfTest::default();
    found.note("crystal", (1, 1), Some(1));
    found.note("train_down_counts", (-400, -400), Some(-399));
    found.note("analog_low_codes", (209, 289), None);
    let mut bench = Bench::new();
    bench.tick();
    bench.set_found(found);
    let reply = bench.send("selftest");
    // A tick at 4 kHz has 42 000 cycles; nobody counts them here, which is not right either.
    let expected = [
        "test name                       least    most   found verdict",
        "test crystal                        1       1       1 ok",
        "test train_down_counts           -400    -400    -399 FAILED",
        "test analog_low_codes             209     289    none FAILED",
        "test tick_cycles                    1   42000       0 FAILED",
        "ok selftest passed=1 failed=3",
    ];
    assert_eq!(reply, expected);
}

#[test]
fn the_bounds_are_right_themselves() {
    for (found, well) in [(None, false), (Some(1), false), (Some(2), true), (Some(4), true), (Some(5), false)]
    {
        let mut test = SelfTest::default();
        test.note("it", (2, 4), found);
        assert_eq!(test.checks()[0].is_well(), well, "{found:?}");
        assert_eq!(test.failed(), usize::from(!well));
    }
}

#[test]
fn a_drive_that_is_on_is_not_tested() {
    let mut bench = Bench::enabled();
    assert!(bench.refuse("selftest").starts_with("err fault selftest: "));
    assert!(bench.refuse("selftest now").starts_with("err syntax selftest: usage: selftest"));
}
