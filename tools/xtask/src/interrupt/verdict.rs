//! Judging what the tick can reach.

use super::code::{Code, Function};
use super::reach::{Finding, Reach};
use super::thumb::Hazard;

/// A function that the tick must not reach: a part of its name, and why not.
///
/// The lists follow the library's names; what they miss still has to end in one of them, in a trap or in an
/// unresolved call, for that is how a panic ends.
const FORBIDDEN_PARTS: [(&str, &str); 9] = [
    ("core::panicking::", "panics"),
    ("core::option::unwrap_failed", "panics"),
    ("core::option::expect_failed", "panics"),
    ("core::result::unwrap_failed", "panics"),
    ("core::slice::index::", "panics"),
    ("core::cell::panic", "panics"),
    ("compiler_builtins::float", "emulates floating point"),
    ("compiler_builtins::int::", "divides or multiplies wide integers by calls"),
    ("critical_section", "locks"),
];

const FORBIDDEN_NAMES: [(&str, &str); 22] = [
    ("rust_begin_unwind", "panics"),
    ("_defmt_panic", "panics"),
    ("__aeabi_idiv", "divides by calls"),
    ("__aeabi_idivmod", "divides by calls"),
    ("__aeabi_uidiv", "divides by calls"),
    ("__aeabi_uidivmod", "divides by calls"),
    ("__aeabi_ldivmod", "divides by calls"),
    ("__aeabi_uldivmod", "divides by calls"),
    ("__divsi3", "divides by calls"),
    ("__udivsi3", "divides by calls"),
    ("__modsi3", "divides by calls"),
    ("__umodsi3", "divides by calls"),
    ("__divdi3", "divides by calls"),
    ("__udivdi3", "divides by calls"),
    ("__moddi3", "divides by calls"),
    ("__umoddi3", "divides by calls"),
    ("__udivmoddi4", "divides by calls"),
    ("__divti3", "divides by calls"),
    ("__udivti3", "divides by calls"),
    ("__aeabi_l2f", "emulates floating point"),
    ("__aeabi_ul2f", "emulates floating point"),
    ("fmodf", "divides"),
];

/// Run-time functions of the ARM ABI for doubles and floats, and their names in other libraries.
const FLOAT_PREFIXES: [&str; 8] = [
    "__aeabi_d",
    "__aeabi_f",
    "__aeabi_cd",
    "__aeabi_cf",
    "__aeabi_i2",
    "__aeabi_ui2",
    "__aeabi_l2d",
    "__aeabi_ul2d",
];
const FLOAT_SUFFIXES: [&str; 8] = ["df2", "df3", "sf2", "sf3", "dfsi", "dfdi", "sfdi", "sidf"];

/// Why the tick must not reach a function of this name.
pub fn why_forbidden(name: &str) -> Option<&'static str> {
    let float = || {
        let ours = FLOAT_PREFIXES.iter().any(|prefix| name.starts_with(prefix));
        let theirs = name.starts_with("__") && FLOAT_SUFFIXES.iter().any(|suffix| name.ends_with(suffix));
        (ours || theirs).then_some("emulates floating point")
    };
    let exact = || FORBIDDEN_NAMES.iter().find(|(whole, _)| *whole == name).map(|(_, why)| *why);
    let part = || FORBIDDEN_PARTS.iter().find(|(part, _)| name.contains(part)).map(|(_, why)| *why);
    exact().or_else(part).or_else(float)
}

/// The judgement.
#[derive(Debug, Default)]
pub struct Verdict {
    /// What must not be, each with where and the way there.
    pub violations: Vec<String>,
    /// Addresses of hardware divisions of integers: allowed, and counted.
    pub integer_divisions: Vec<u32>,
    /// Readable names of all functions reached, the handler first.
    pub functions: Vec<String>,
    instructions: usize,
    /// The most bytes of stack, with what the processor stores on entry; `None` without a bound.
    pub stack_bytes: Option<u32>,
}

impl Verdict {
    /// Judges what `entry` reaches.
    pub fn of(code: &Code, entry: &Function, reach: &Reach) -> Self {
        let stack_bytes = reach.frames.deepest(entry.start);
        let mut verdict = Self { instructions: reach.instructions, stack_bytes, ..Self::default() };
        if stack_bytes.is_none() {
            verdict.violations.push(
                "takes stack without a bound: a recursion, or a stack pointer from a register".to_owned(),
            );
        }
        let name = |start: u32| match code.around(start) {
            Some(function) => function.names.join(" = "),
            None => format!("{start:#010x}"),
        };
        let way = |start: u32| {
            let mut names = vec![name(start)];
            let mut at = start;
            while let Some(&caller) = reach.functions.get(&at).filter(|caller| **caller != at) {
                names.push(name(caller));
                at = caller;
            }
            names.reverse();
            names.join(" -> ")
        };
        verdict.functions.push(name(entry.start));
        for &start in reach.functions.keys() {
            if start != entry.start {
                verdict.functions.push(name(start));
            }
            let reasons = code.around(start).map(|function| function.names.iter()).into_iter().flatten();
            if let Some(why) = reasons.filter_map(|own| why_forbidden(own)).next() {
                verdict.violations.push(format!("reaches a function that {why}: {}", way(start)));
            }
        }
        for &(address, finding) in &reach.findings {
            let what = match finding {
                Finding::Hazard(Hazard::IntegerDivision) => {
                    verdict.integer_divisions.push(address);
                    continue;
                }
                Finding::Hazard(Hazard::FloatDivision) => "divides floats",
                Finding::Hazard(Hazard::InterruptMask) => "masks interrupts",
                Finding::Hazard(Hazard::Trap) => "traps",
                Finding::Unresolved => "goes to an address that only registers know",
                Finding::Lost => "goes where no code is known",
                Finding::RunsOut => "runs on behind its last instruction",
            };
            let around = code.around(address).map_or(address, |function| function.start);
            verdict.violations.push(format!("{what} at {address:#010x}: {}", way(around)));
        }
        verdict
    }

    /// How many instructions can run.
    pub fn instructions(&self) -> usize {
        self.instructions
    }

    /// For people, with what the interrupt is as title; `divisions` says where the integer divisions are.
    pub fn describe(&self, title: &str, divisions: &[String]) -> String {
        let mut text = format!(
            "{title}: {} instructions in {} functions can run, {} hardware divisions of integers\n",
            self.instructions(),
            self.functions.len(),
            self.integer_divisions.len()
        );
        let listed = |title: &str, lines: &[String]| -> String {
            lines.iter().map(|line| format!("  {title} {line}\n")).collect()
        };
        if let Some(bytes) = self.stack_bytes {
            text += &format!("  at most {bytes} bytes of stack, with what the processor stores on entry\n");
        }
        text += &listed("function", &self.functions);
        text += &listed("division", divisions);
        if self.violations.is_empty() {
            text +=
                "  no panic, trap, lock, float emulation, float division, library division or unknown jump\n";
        }
        text + &listed("VIOLATION", &self.violations)
    }
}
