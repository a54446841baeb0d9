//! Any bytes as a table: what is accepted keeps every promise, also after its way through the console.

use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::machine::HISTORY_SAMPLES;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::shaper::{Cascade, ShaperTable};
use stillbeam_firmware::units::TickRate;

use crate::console::with_bench;

/// Positions as far apart as they may be.
const POSITIONS_NM: [i32; 3] = [1_000_000_000, -1_000_000_000, 123_456_789];

pub(crate) fn run(input: &[u8]) {
    let parsed = ShaperTable::from_bytes(TickRate::DEFAULT, input);
    if let Ok(table) = &parsed {
        assert_eq!(table.words().flatten().collect::<Vec<u8>>(), input);
        assert_eq!(table.crc32(), crc32(input));
        if table.history_samples() <= HISTORY_SAMPLES {
            runs_and_holds(table);
        }
    }
    let accepted = parsed.is_ok_and(|table| table.history_samples() <= HISTORY_SAMPLES);
    with_bench(|bench| {
        bench.send(&format!("table begin {} {:08x} 4000", input.len(), crc32(input)));
        for (number, frame) in input.chunks(MAX_FRAME_BYTES).enumerate() {
            let hex: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
            bench.send(&format!("table frame {number} {} {hex} {:08x}", frame.len(), crc32(frame)));
        }
        let reply = bench.send("table commit");
        // What ran before may still settle; then the table can need a lag, for which there may be no room.
        let refused = reply.last().is_some_and(|line| {
            line.starts_with("err range")
                || line.starts_with("err memory") && !line.ends_with("wait for rest")
        });
        assert!(!(accepted && refused), "{reply:?}");
        bench.send("table show");
        bench.send("move 1");
        for _ in 0..50 {
            bench.tick();
        }
    });
}

fn runs_and_holds(table: &ShaperTable) {
    let mut history = vec![0; table.history_samples()];
    let mut cascade = Cascade::new(table, &mut history).expect("as long as it said");
    for position_nm in POSITIONS_NM {
        // Long enough for most, short enough to be quick.
        for _ in 0..300 {
            cascade.step(position_nm);
        }
    }
    if table.duration_ticks() < 300 {
        assert_eq!(cascade.step(POSITIONS_NM[2]), POSITIONS_NM[2], "a held command is held");
    }
}
