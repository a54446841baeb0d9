//! Small programs with and without what the check is for: it must be able to fail.

use super::super::verdict::Verdict;
use super::*;

const BASE: u32 = 0x0800_0000;
const BX_LR: u16 = 0x4770;
const NOP: u16 = 0xbf00;

/// Functions one behind the other, each with its name and halfwords.
fn link(functions: &[(&str, &[u16])]) -> Code {
    let mut code = Code::default();
    let mut content = Vec::new();
    let mut listed = Vec::new();
    for (name, halfwords) in functions {
        let start = BASE + content.len() as u32;
        content.extend(halfwords.iter().flat_map(|halfword| halfword.to_le_bytes()));
        listed.push((start, halfwords.len() as u32 * 2, (*name).to_owned()));
    }
    code.sections.push((BASE, content));
    code.set_functions(listed);
    code
}

fn judge(code: &Code) -> Verdict {
    let entry = code.named("TIM2").expect("the handler");
    Verdict::of(code, entry, &follow(code, entry))
}

fn violations(functions: &[(&str, &[u16])]) -> String {
    judge(&link(functions)).violations.join("; ")
}

/// `bl` over `halfwords` from behind the instruction.
fn call_over(halfwords: u16) -> [u16; 2] {
    [0xf000, 0xf800 + halfwords]
}

#[test]
fn a_handler_that_only_computes_and_returns_is_well() {
    let verdict = judge(&link(&[("TIM2", &[NOP, 0xd001, NOP, BX_LR, 0xe7fc])]));
    assert_eq!(verdict.violations, Vec::<String>::new());
    assert_eq!(verdict.instructions(), 5);
    assert!(verdict.integer_divisions.is_empty());
}

#[test]
fn a_panic_behind_two_calls_is_found_with_the_way_there() {
    let [high, low] = call_over(1);
    let found = violations(&[
        ("TIM2", &[high, low, BX_LR]),
        ("middle", &[high, low, BX_LR]),
        ("core::panicking::panic_fmt", &[0xe7fe]),
    ]);
    assert_eq!(found, "reaches a function that panics: TIM2 -> middle -> core::panicking::panic_fmt");
}

#[test]
fn a_panic_by_a_conditional_jump_into_the_other_function_is_found() {
    // bhs to the function behind: a tail call.
    let found = violations(&[("TIM2", &[0xd200, BX_LR]), ("core::option::unwrap_failed", &[NOP, 0xe7fe])]);
    assert!(found.contains("TIM2 -> core::option::unwrap_failed"), "{found}");
}

#[test]
fn what_no_path_reaches_does_no_harm() {
    let found = violations(&[("TIM2", &[BX_LR, 0xb672]), ("core::panicking::panic", &[0xdefe])]);
    assert_eq!(found, "");
}

#[test]
fn traps_locks_and_float_divisions_are_found_where_they_are() {
    let table: [(&[u16], &str); 5] = [
        (&[0xb672, BX_LR], "masks interrupts at 0x08000000"),
        (&[NOP, 0xf380, 0x8811, BX_LR], "masks interrupts at 0x08000002"),
        (&[0xdefe], "traps at 0x08000000"),
        (&[0xee80, 0x0a81, BX_LR], "divides floats at 0x08000000"),
        (&[0xdf00, BX_LR], "traps at 0x08000000"),
    ];
    for (halfwords, expected) in table {
        let found = violations(&[("TIM2", halfwords)]);
        assert!(found.starts_with(expected), "{found}");
    }
}

#[test]
fn integer_divisions_are_counted_and_no_violation() {
    let verdict = judge(&link(&[("TIM2", &[0xfbb1, 0xf0f2, 0xfb91, 0xf0f2, BX_LR])]));
    assert_eq!(verdict.integer_divisions, [BASE, BASE + 4]);
    assert!(verdict.violations.is_empty());
}

#[test]
fn what_cannot_be_followed_fails() {
    let table: [(&[u16], &str); 5] = [
        (&[0x4798, BX_LR], "only registers know"),
        (&[0x4718], "only registers know"),
        (&[NOP], "runs on behind"),
        // A call into nowhere, and a branch table that no mark delimits.
        (&[0xf7ff, 0xfbfe, BX_LR], "no code is known"),
        (&[0xe8df, 0xf000, 0x0101, BX_LR], "no code is known"),
    ];
    for (halfwords, expected) in table {
        let found = violations(&[("TIM2", halfwords)]);
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn a_conditional_return_goes_on_to_what_is_behind() {
    // it eq; bxeq lr; cpsid i; bx lr
    let found = violations(&[("TIM2", &[0xbf08, BX_LR, 0xb672, BX_LR])]);
    assert!(found.starts_with("masks interrupts at 0x08000004"), "{found}");
}

#[test]
fn every_entry_of_a_branch_table_is_followed() {
    // tbb [pc, r0]; entries 2, 3 and 0 to fill up; then a return and a lock.
    let mut code = link(&[("TIM2", &[0xe8df, 0xf000, 0x0302, 0x0004, BX_LR, NOP, 0xb672, BX_LR])]);
    code.set_marks(vec![(BASE, false), (BASE + 4, true), (BASE + 8, false)]);
    let verdict = judge(&code);
    assert_eq!(verdict.violations.len(), 1, "{verdict:?}");
    assert!(verdict.violations[0].starts_with("masks interrupts at 0x0800000c"), "{verdict:?}");
}

#[test]
fn constants_behind_a_branch_table_are_not_taken_for_entries() {
    // tbb [pc, r0]; entries 4 and 5; a filling nop and a constant; then two returns.
    let mut code = link(&[("TIM2", &[0xe8df, 0xf000, 0x0504, 0xbf00, 0x0605, 0x0807, BX_LR, BX_LR])]);
    code.set_marks(vec![(BASE, false), (BASE + 4, true), (BASE + 12, false)]);
    assert_eq!(judge(&code).violations, Vec::<String>::new());
}

#[test]
fn names_of_all_kinds_are_forbidden_and_the_allowed_ones_are_not() {
    use super::super::verdict::why_forbidden;
    for name in [
        "core::panicking::panic_bounds_check",
        "core::result::unwrap_failed",
        "core::slice::index::slice_end_index_len_fail",
        "rust_begin_unwind",
        "__aeabi_dadd",
        "__aeabi_fmul",
        "__aeabi_d2lz",
        "__muldf3",
        "__aeabi_uldivmod",
        "__udivdi3",
        "compiler_builtins::float::mul::__mulsf3",
    ] {
        assert!(why_forbidden(name).is_some(), "{name}");
    }
    for name in ["TIM2", "__aeabi_memcpy", "__aeabi_memcpy8", "memcpy", "compiler_builtins::mem::memcpy"] {
        assert_eq!(why_forbidden(name), None, "{name}");
    }
}
