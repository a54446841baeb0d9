//! Every type of shaper over the console: the table that runs is the one that `stillbeam shape` computes.

use stillbeam_host_tests::bench::Bench;
use stillbeam_shape::{DesignOptions, ShaperDesign, parse_mode};

const TYPES: [&str; 8] = ["zv", "zvd", "zvdd", "zvddd", "ei", "ei2", "ei3", "mzv"];

fn field<'r>(reply: &'r str, key: &str) -> &'r str {
    let found = reply.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
    found.unwrap_or_else(|| panic!("no {key} in {reply}"))
}

fn set(bench: &mut Bench, number: usize, (frequency_hz, damping_ratio, kind): (f64, f64, &str)) {
    bench.accept(&format!("set mode{number}.frequency_hz {frequency_hz}"));
    bench.accept(&format!("set mode{number}.damping_ratio {damping_ratio}"));
    bench.accept(&format!("set mode{number}.type {kind}"));
}

/// As `stillbeam shape --mode ... --rate ...` does it.
fn on_the_host(modes: &[(f64, f64, &str)], rate_hz: f64) -> ShaperDesign {
    let modes: Vec<_> = modes
        .iter()
        .map(|(hz, ratio, kind)| parse_mode(&format!("{hz},{ratio},{kind}")).expect("a mode"))
        .collect();
    ShaperDesign::new(&modes, rate_hz, &DesignOptions::default()).expect("a design")
}

#[test]
fn all_types_alone_and_four_together_run_with_the_table_of_the_host() {
    for rate_hz in [500.0, 4000.0, 10_000.0] {
        let mut bench = Bench::enabled();
        bench.accept(&format!("set tick.rate_hz {rate_hz}"));
        bench.apply_while_off();
        let mut crcs = std::collections::BTreeSet::new();
        let mut check = |bench: &mut Bench, modes: &[(f64, f64, &str)]| {
            for number in 1..=4 {
                bench.accept(&format!("set mode{number}.type off"));
            }
            for (index, mode) in modes.iter().enumerate() {
                set(bench, index + 1, *mode);
            }
            let reply = bench.accept("apply");
            bench.run_to_rest();
            let design = on_the_host(modes, rate_hz);
            assert_eq!(field(&reply, "crc32"), design.crc32.to_string(), "{modes:?} at {rate_hz} Hz");
            assert_eq!(field(&reply, "modes"), modes.len().to_string());
            let close = |key: &str, seconds: f64| {
                let printed_ms: f64 = field(&reply, key).parse().expect("a number");
                assert!(
                    (printed_ms - 1e3 * seconds).abs() < 2e3 / rate_hz,
                    "{modes:?}: {reply}, {seconds} s"
                );
            };
            close("duration_ms", design.duration_s);
            close("delay_ms", design.delay_s);
            assert!(
                crcs.insert(field(&reply, "crc32").to_owned()),
                "{modes:?}: a table that was there before"
            );
        };
        for kind in TYPES {
            for (frequency_hz, damping_ratio) in [(5.3, 0.0), (6.9196, 0.0033), (21.7, 0.17)] {
                check(&mut bench, &[(frequency_hz, damping_ratio, kind)]);
            }
        }
        check(
            &mut bench,
            &[(9.0, 0.01, "zv"), (13.0, 0.02, "ei3"), (21.0, 0.03, "mzv"), (34.0, 0.0, "zvddd")],
        );
        check(
            &mut bench,
            &[(9.0, 0.01, "ei"), (13.0, 0.02, "zvd"), (21.0, 0.03, "ei2"), (34.0, 0.0, "zvdd")],
        );

        // Off, the ninth: nothing is shaped.
        for number in 1..=4 {
            bench.accept(&format!("set mode{number}.type off"));
        }
        let reply = bench.accept("apply");
        assert_eq!(
            ["modes", "duration_ms", "delay_ms"].map(|key| field(&reply, key)),
            ["0", "0.000", "0.000"]
        );
        assert_eq!(field(&reply, "crc32"), field(&bench.accept("shaper off"), "crc32"));
    }
}
