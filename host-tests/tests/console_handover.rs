//! A table that is taken during a move: what the console says of its lag, and when the lag ends.

use stillbeam_host_tests::bench::Bench;

/// A slow machine with a long shaper, half-way through a move.
fn half_way() -> Bench {
    let mut bench = Bench::enabled();
    for line in ["set mode1.frequency_hz 1.1", "set mode1.damping_ratio 0.0074", "set mode1.type zvdd"] {
        bench.accept(line);
    }
    bench.accept("set move.velocity_mm_s 20");
    bench.accept("apply");
    bench.run_to_rest();
    bench.clear_log();
    bench.accept("move 50");
    for _ in 0..6000 {
        bench.tick();
    }
    bench
}

fn lag_ms(reply: &str) -> Option<f64> {
    reply.split_whitespace().find_map(|word| word.strip_prefix("lag_ms=")?.parse().ok())
}

fn largest_step(setpoints: &[i32]) -> Option<i32> {
    setpoints.windows(2).map(|pair| (pair[1] - pair[0]).abs()).max()
}

/// Without a shaper the setpoint could go on at once; to get to where it would be it would have to run at
/// more than the 20 mm/s of the move.
#[test]
fn switching_the_shaper_off_while_moving_keeps_its_lag_and_the_speed_until_the_next_motion() {
    let mut bench = half_way();
    let reply = bench.accept("shaper off");
    let lag = lag_ms(&reply).expect("said");
    println!("switched off: lag {lag} ms");
    assert!((680.0..1400.0).contains(&lag), "between the old table's delay and its length: {reply}");
    assert_eq!(lag_ms(&bench.accept("get")), Some(lag), "for as long as it lasts");
    let setpoints = bench.run_to_rest();
    assert_eq!(setpoints.last(), Some(&50_000_000));
    assert!(largest_step(&setpoints) <= Some(5000 + 8), "20 mm/s are 5 um a tick");

    bench.clear_log();
    bench.accept("move 10");
    let after = bench.run_to_rest();
    assert_eq!(lag_ms(&bench.accept("get")), None, "it has ended");
    let mut plain = Bench::enabled();
    for line in ["set move.velocity_mm_s 20", "apply", "shaper off"] {
        plain.accept(line);
    }
    plain.run_to_rest();
    plain.accept("move 50");
    plain.run_to_rest();
    plain.clear_log();
    plain.accept("move 10");
    let never_lagged = plain.run_to_rest();
    let moved = |setpoints: &[i32]| {
        let first = setpoints.iter().position(|setpoint| *setpoint != 50_000_000).expect("moves");
        setpoints[first..].iter().position(|setpoint| *setpoint == 10_000_000).expect("arrives")
    };
    assert_eq!(moved(&after), moved(&never_lagged), "as if there had never been a lag");
    assert_eq!(largest_step(&after), largest_step(&never_lagged));
}

/// The usual case: a frequency is corrected a little.
#[test]
fn a_small_correction_while_moving_costs_a_small_lag() {
    let mut bench = half_way();
    bench.accept("set mode1.frequency_hz 1.15");
    let reply = bench.accept("apply");
    println!("1.10 to 1.15 Hz: lag {} ms", lag_ms(&reply).expect("said"));
    // The longer table lasts 1364 ms, the shorter one 1304 ms.
    assert!((1.0..120.0).contains(&lag_ms(&reply).expect("said")), "{reply}");
    let setpoints = bench.run_to_rest();
    assert_eq!(setpoints.last(), Some(&50_000_000));
    assert!(largest_step(&setpoints) <= Some(5000 + 8));
}

#[test]
fn at_rest_there_is_no_lag() {
    let mut bench = half_way();
    bench.run_to_rest();
    assert_eq!(lag_ms(&bench.accept("shaper off")), None);
}

/// A table that fits at rest can be too much for the memory together with the lag that it would need during
/// the move.
#[test]
fn a_table_that_only_its_lag_makes_too_long_is_refused_until_rest() {
    let mut bench = Bench::enabled();
    for line in ["set mode1.frequency_hz 0.6", "set mode1.type zvdd", "set move.velocity_mm_s 20", "apply"] {
        bench.accept(line);
    }
    bench.run_to_rest();
    bench.accept("move 50");
    for _ in 0..6000 {
        bench.tick();
    }
    let running = bench.accept("get");
    // Two modes that together last as long as the one before: at rest they fit as well as that one.
    for line in ["set mode1.frequency_hz 1.2", "set mode2.frequency_hz 1.2", "set mode2.type zvdd"] {
        bench.accept(line);
    }
    let refused = bench.refuse("apply");
    println!("{refused}");
    assert!(refused.starts_with("err memory shaper: needs "), "{refused}");
    assert!(refused.contains(" samples of history at 4000 Hz while the machine moves, "), "{refused}");
    assert!(refused.ends_with(" at rest, there are 13824; wait for rest"), "{refused}");
    assert_eq!(bench.accept("get"), running, "nothing has changed");
    assert_eq!(bench.run_to_rest().last(), Some(&50_000_000));
    bench.accept("apply");
}
