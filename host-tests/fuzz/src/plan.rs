//! Any bytes as a plan: what is accepted ends at rest where it says, within what it says, also after its way
//! through the console.

use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::motion::{PlanOutline, PlayedPlan};
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::units::{Nanometres, TickRate};

use crate::console::with_bench;

pub(crate) fn run(input: &[u8]) {
    let outline = PlanOutline::of(TickRate::DEFAULT, input);
    if let Ok(outline) = &outline
        && let Ok(mut memory) = heapless::Vec::from_slice(input)
    {
        let mut plan = PlayedPlan::new(outline, false, Nanometres(0), &mut memory);
        let mut positions = Vec::new();
        positions.extend(std::iter::from_fn(|| plan.step()).map(|position| position.rounded()));
        assert_eq!(positions.len(), outline.ticks as usize);
        assert_eq!(positions.last(), Some(&outline.distance));
        let (low, high) = outline.span;
        assert!(positions.iter().all(|position| (low..=high).contains(position)));
    }
    with_bench(|bench| {
        bench.send(&format!("plan begin {} {:08x} 4000", input.len(), crc32(input)));
        for (number, frame) in input.chunks(MAX_FRAME_BYTES).enumerate() {
            let hex: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
            bench.send(&format!("plan frame {number} {} {hex} {:08x}", frame.len(), crc32(frame)));
        }
        let reply = bench.send("plan commit");
        let refused = reply.last().is_some_and(|line| line.starts_with("err range"));
        assert!(!(outline.is_ok() && refused), "{reply:?}");
        bench.send("plan show");
        for play in ["play", "play back"] {
            bench.send(play);
            for _ in 0..60 {
                bench.tick();
            }
            bench.send("stop");
        }
    });
}
