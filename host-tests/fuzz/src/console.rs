//! Any bytes into the console, with ticks in between.

use std::cell::RefCell;

use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_host_tests::bench::Bench;

/// Bytes from here on let time pass instead of being sent; they are neither text nor editing keys: one tick
/// after a missed one, one with the emergency input active, and for 0xff many.
const MISSED: u8 = 0xfd;
const EMERGENCY: u8 = 0xfe;
const TICKS_AT_ONCE: usize = 40;
/// A bench cannot be freed, so it is kept for many inputs and brought back to its beginning in between.
const INPUTS_PER_BENCH: u32 = 2000;

thread_local! {
    static BENCH: RefCell<(Bench, u32)> = RefCell::new((Bench::enabled(), 0));
}

pub(crate) fn run(input: &[u8]) {
    with_bench(|bench| {
        for part in input.split_inclusive(|byte| *byte >= MISSED) {
            let (text, happens) = match part {
                [text @ .., last] if *last >= MISSED => (text, Some(*last)),
                text => (text, None),
            };
            bench.send_bytes(text);
            let quiet = Inputs::default();
            let (ticks, inputs) = match happens {
                None => (0, quiet),
                Some(EMERGENCY) => (1, Inputs { emergency: true, ..quiet }),
                Some(MISSED) => (1, Inputs { missed_ticks: 1, ..quiet }),
                Some(_) => (TICKS_AT_ONCE, quiet),
            };
            for _ in 0..ticks {
                bench.tick_with(inputs);
            }
            let said = bench.announced();
            let asked = text.contains(&RealTimeByte::STATUS);
            let known = said.contains("! fault ") || asked && said.contains("! status ");
            assert!(said.is_empty() || known, "{said:?}");
            assert_eq!(bench.announced(), "", "once");
        }
    });
}

/// A machine near enough to one after reset: nothing staged, nothing moves.
pub(crate) fn with_bench(use_it: impl FnOnce(&mut Bench)) {
    BENCH.with_borrow_mut(|(bench, inputs)| {
        *inputs += 1;
        if *inputs > INPUTS_PER_BENCH {
            (*bench, *inputs) = (Bench::enabled(), 0);
        }
        // The first two end an escape sequence and a line.
        bench.send_bytes(
            b"~~\x15\rchecksum off\recho off\rstream off\rtable abort\rclear\rstop\rdefaults\renable\r",
        );
        use_it(bench);
        bench.clear_log();
        bench.samples();
    });
}
