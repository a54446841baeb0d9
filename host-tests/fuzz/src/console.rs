//! Any bytes into the console, with ticks in between.

use std::cell::RefCell;

use stillbeam_host_tests::bench::Bench;

/// A byte that lets time pass instead of being sent; neither text nor an editing key.
const TICKS: u8 = 0xff;
const TICKS_AT_ONCE: usize = 40;
/// A bench cannot be freed, so it is kept for many inputs and brought back to its beginning in between.
const INPUTS_PER_BENCH: u32 = 2000;

thread_local! {
    static BENCH: RefCell<(Bench, u32)> = RefCell::new((Bench::new(), 0));
}

pub(crate) fn run(input: &[u8]) {
    with_bench(|bench| {
        for part in input.split_inclusive(|byte| *byte == TICKS) {
            let text = part.strip_suffix(&[TICKS]).unwrap_or(part);
            bench.send_bytes(text);
            if text.len() < part.len() {
                for _ in 0..TICKS_AT_ONCE {
                    bench.tick();
                }
            }
        }
    });
}

/// A machine near enough to one after reset: nothing staged, nothing moves.
pub(crate) fn with_bench(use_it: impl FnOnce(&mut Bench)) {
    BENCH.with_borrow_mut(|(bench, inputs)| {
        *inputs += 1;
        if *inputs > INPUTS_PER_BENCH {
            (*bench, *inputs) = (Bench::new(), 0);
        }
        // The first two end an escape sequence and a line.
        bench.send_bytes(b"~~\x15\rchecksum off\recho off\rstream off\rtable abort\rclear\rstop\rdefaults\r");
        use_it(bench);
        bench.clear_log();
        bench.samples();
    });
}
