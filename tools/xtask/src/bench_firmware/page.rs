//! docs/results/firmware.md.

use super::numbers::{CASCADE_GOAL, CYCLE_GOAL, FASTEST_TICK_CYCLES, INTERRUPT_GOAL, Numbers, TickNumbers};

/// Taps of one stage where none of them fall on the same tick.
const TAPS: [(&str, u32); 9] = [
    ("zv", 3),
    ("zvd", 6),
    ("zvdd", 10),
    ("zvddd", 15),
    ("flat, in pairs", 16),
    ("flat, one by one", 16),
    ("two stages, runs and lone taps", 12),
    ("flat, 64 one by one", 64),
    ("four stages, 64 one by one", 64),
];

/// What was tried to make the tick and the image smaller, written by hand.
const TRIED: &str = include_str!("tried.md");

/// The page, in Markdown.
pub fn page(numbers: &Numbers) -> String {
    let mut text = String::from(
        "# What the firmware costs\n\nMade by `cargo xtask bench-firmware` on the release image in the emulator, \
         where every instruction of the\ntick interrupt is stepped and counted: from the handler's first to its \
         return, in 12 ticks of each case.\nTicks that take a new table or motion from the queue are not among them.\n\n\
         Cycles are those of the processor at 168 MHz by a model over the same instructions, the most of the 12 ticks: the pipeline, the flash with \
         its caches,\nempty when the tick begins, and its prefetch, the buses to the peripherals. `host-tests/src/emulator/cycles.rs` states all of it in a \
         table.\nNothing was measured on a board; there `status` says what the tick takes (`tick_cycles`).\n\n\
         ## Instructions and cycles per tick\n\nLeast / median / most instructions, and cycles.\n\n\
         | table | taps | RAM of the table | state | no telemetry | a sample every tick |\n\
         |---|---|---|---|---|---|\n",
    );
    for tick in numbers.tick.iter().filter(|tick| !tick.streams) {
        let streaming = numbers.find(tick.modes, &tick.shaper, &tick.motion, true);
        text += &format!(
            "| {} | {} | {} bytes | {} | {} | {} |\n",
            table(tick),
            taps(tick),
            tick.history_samples * 4,
            tick.motion,
            counts(tick),
            streaming.map_or_else(|| "-".to_owned(), counts)
        );
    }
    text += &cascade(numbers);
    if let Some(size) = numbers.size {
        text += &format!(
            "\n## Memory\n\n| | bytes |\n|---|---|\n| text and constants (goal: 65536) | {} |\n| data | {} |\n\
             | bss | {} |\n",
            size.text, size.data, size.bss
        );
        if let Some(stack) = numbers.stack {
            text += &format!(
                "| deepest stack in all of the above, start-up, `save` and the other commands included | {} |\n\
                 | kept for the stack | {} |\n",
                stack.bytes, stack.room
            );
        }
    }
    if let Some(masked) = numbers.masked {
        text += &format!(
            "\n## Interrupts masked\n\nThe tick has the highest priority; only a section with all interrupts masked delays it. The image has {} \
             places that begin one.\nThe longest of {} sections that ran while the console answered and samples were streamed: **{} instructions**. \
             That is what ran, not a bound\nfor every path. Writing and erasing flash stops the tick too (docs/protocol.md).\n",
            masked.places, masked.sections, masked.longest
        );
    }
    text + TRIED
}

/// What shaping adds.
fn cascade(numbers: &Numbers) -> String {
    let mut text = String::from(
        "\n## The cascade alone\n\nA tick with the table, less one without, by the medians: the middle one of rest, moving and sweeping. Which block of the table is the one\n\
         whose samples wrap around the memory's end makes three instructions more or fewer.\n\n\
         | table | taps | instructions | per tap |\n|---|---|---|---|\n",
    );
    for tick in numbers.tick.iter().filter(|tick| tick.motion == "moving" && !tick.streams && tick.modes > 0)
    {
        let Some(added) = numbers.added_by(tick) else { continue };
        let per_tap = f64::from(added) / f64::from(taps(tick).max(1));
        text += &format!("| {} | {} | {added} | {per_tap:.1} |\n", table(tick), taps(tick));
    }
    if let Some(goals) = numbers.goals() {
        text += &format!(
            "\nGoals: at most {CASCADE_GOAL} instructions for the cascade of 2 modes zvdd: {}. At most {INTERRUPT_GOAL} for its whole interrupt: {}, \
             in a move and nothing else;\na sweep, a sample, steps, an encoder or a change of tables on top take more, see above.\n",
            reached(goals.cascade, CASCADE_GOAL),
            reached(goals.interrupt, INTERRUPT_GOAL),
        );
    }
    if let Some(most) = numbers.tick.iter().max_by_key(|tick| tick.most) {
        text += &format!(
            "The most of all cases: {}, {} ({}{}). A tick lasts {FASTEST_TICK_CYCLES} cycles at 20 kHz, 42 000 at 4 kHz, so that\n\
             an instruction may take {} cycles on average where everything comes together at 20 kHz.\n",
            most.most,
            table(most),
            most.motion,
            if most.streams { ", a sample every tick" } else { "" },
            FASTEST_TICK_CYCLES / most.most.max(1)
        );
    }
    text += &cycles(numbers);
    text + "\nA flat table has all taps in one stage: in pairs of neighbouring ticks, or no two next to each other. Two modes of ZVDD \
            need 20 taps as a cascade\nand up to 100 when multiplied out.\n"
}

/// The tick that takes the most cycles, of all and of those with a table of modes.
fn cycles(numbers: &Numbers) -> String {
    let share = |tick: &TickNumbers| {
        let percent = f64::from(tick.cycles) * 100.0 / f64::from(FASTEST_TICK_CYCLES);
        format!("{percent:.1} % of a tick at 20 kHz ({}, {})", table(tick), tick.motion)
    };
    let most = |of_modes: bool| {
        let ticks = numbers.tick.iter().filter(|tick| !of_modes || !is_uploaded(tick));
        ticks.max_by_key(|tick| tick.cycles)
    };
    let (Some(all), Some(modes)) = (most(false), most(true)) else { return String::new() };
    format!(
        "\nGoal: at most {CYCLE_GOAL} cycles by the model, 60 %, for the tick that takes most: {}; it is {}.\n\
         Of tables of modes the most are {} cycles, {}.\n",
        reached(all.cycles, CYCLE_GOAL),
        share(all),
        modes.cycles,
        share(modes)
    )
}

fn reached(value: u32, goal: u32) -> String {
    format!("{value}, {}", if value <= goal { "reached" } else { "missed" })
}

/// Whether the table was made of taps, not of modes.
fn is_uploaded(tick: &TickNumbers) -> bool {
    tick.shaper.contains(',')
}

fn table(tick: &TickNumbers) -> String {
    match tick.modes {
        0 => "none".to_owned(),
        1 if is_uploaded(tick) => tick.shaper.clone(),
        1 => format!("1 mode {}", tick.shaper),
        modes => format!("{modes} modes {}", tick.shaper),
    }
}

fn taps(tick: &TickNumbers) -> u32 {
    TAPS.iter().find(|(name, _)| *name == tick.shaper).map_or(0, |(_, taps)| taps * tick.modes)
}

fn counts(tick: &TickNumbers) -> String {
    format!("{} / {} / {}, {}", tick.least, tick.median, tick.most, tick.cycles)
}
