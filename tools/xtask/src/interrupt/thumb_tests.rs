//! Opcodes as an assembler makes them.

use super::*;

const AT: u32 = 0x0800_1000;

fn flow(first: u16, second: u16) -> Flow {
    decode(AT, first, second).flow
}

#[test]
fn branches_and_calls_go_where_an_assembler_sends_them() {
    let table = [
        ("b .", 0xe7fe, 0, Flow::Jump(AT)),
        ("b .+6", 0xe001, 0, Flow::Jump(AT + 6)),
        ("beq .-4", 0xd0fc, 0, Flow::Branch(AT - 4)),
        ("bge .+10", 0xda03, 0, Flow::Branch(AT + 10)),
        ("cbz r1, .+4", 0xb101, 0, Flow::Branch(AT + 4)),
        ("cbnz r7, .+130", 0xbbff, 0, Flow::Branch(AT + 130)),
        ("b.w .+4096", 0xf000, 0xbffe, Flow::Jump(AT + 4096)),
        ("b.w .-8", 0xf7ff, 0xbffa, Flow::Jump(AT - 8)),
        ("bl .+0x700e", 0xf007, 0xf805, Flow::Call(AT + 0x700e)),
        ("bl .+2", 0xf7ff, 0xffff, Flow::Call(AT + 2)),
        ("beq.w .+0x7b6", 0xf000, 0x83d9, Flow::Branch(AT + 0x7b6)),
        ("bne.w .", 0xf47f, 0xaffe, Flow::Branch(AT)),
        ("tbb [pc, r8]", 0xe8df, 0xf008, Flow::Table { entry_bytes: 1 }),
        ("tbh [pc, r0, lsl #1]", 0xe8df, 0xf010, Flow::Table { entry_bytes: 2 }),
        ("it eq", 0xbf08, 0, Flow::IfThen(1)),
        ("ite eq", 0xbf0c, 0, Flow::IfThen(2)),
        ("itttt ne", 0xbf1f, 0, Flow::IfThen(4)),
    ];
    for (text, first, second, expected) in table {
        assert_eq!(flow(first, second), expected, "{text}");
    }
}

#[test]
fn returns_are_told_from_jumps_to_unknown_places() {
    let returns = [("bx lr", 0x4770, 0), ("pop {r4, pc}", 0xbd10, 0), ("mov pc, lr", 0x46f7, 0)];
    let wide_returns = [("pop.w {r4-r11, pc}", 0xe8bd, 0x8ff0), ("ldr pc, [sp], #4", 0xf85d, 0xfb04)];
    for (text, first, second) in returns.into_iter().chain(wide_returns) {
        assert_eq!(flow(first, second), Flow::Return, "{text}");
    }
    let unknown = [
        ("blx r3", 0x4798, 0),
        ("bx r3", 0x4718, 0),
        ("mov pc, r3", 0x469f, 0),
        ("add pc, r3", 0x449f, 0),
        ("ldr.w pc, [r0]", 0xf8d0, 0xf000),
        ("ldr.w pc, [r0, r1, lsl #2]", 0xf850, 0xf021),
        ("ldm.w r0, {r1, pc}", 0xe890, 0x8002),
        ("tbb [r1, r0]", 0xe8d1, 0xf000),
        ("blx .+8 (to ARM state)", 0xf000, 0xe802),
    ];
    for (text, first, second) in unknown {
        assert_eq!(flow(first, second), Flow::Unresolved, "{text}");
    }
}

#[test]
fn hazards_are_seen_in_all_their_encodings() {
    let table = [
        ("udiv r0, r1, r2", 0xfbb1, 0xf0f2, Some(Hazard::IntegerDivision)),
        ("sdiv r8, r9, r10", 0xfb99, 0xf8fa, Some(Hazard::IntegerDivision)),
        ("vdiv.f32 s0, s1, s2", 0xee80, 0x0a81, Some(Hazard::FloatDivision)),
        ("vdiv.f32 s1, s30, s31", 0xeecf, 0x0a2f, Some(Hazard::FloatDivision)),
        ("vsqrt.f32 s0, s1", 0xeeb1, 0x0ae0, Some(Hazard::FloatDivision)),
        ("cpsid i", 0xb672, 0, Some(Hazard::InterruptMask)),
        ("cpsie i", 0xb662, 0, Some(Hazard::InterruptMask)),
        ("msr primask, r0", 0xf380, 0x8810, Some(Hazard::InterruptMask)),
        ("msr basepri, r1", 0xf381, 0x8811, Some(Hazard::InterruptMask)),
        ("udf #254", 0xdefe, 0, Some(Hazard::Trap)),
        ("udf.w #0", 0xf7f0, 0xa000, Some(Hazard::Trap)),
        ("bkpt #0", 0xbe00, 0, Some(Hazard::Trap)),
        ("svc #0", 0xdf00, 0, Some(Hazard::Trap)),
        ("mrs r0, primask", 0xf3ef, 0x8010, None),
        ("dmb sy", 0xf3bf, 0x8f5f, None),
        ("smlal r0, r1, r2, r3", 0xfbc2, 0x0103, None),
        ("umull r0, r1, r2, r3", 0xfba2, 0x0103, None),
        ("smull r0, r1, r2, r3", 0xfb82, 0x0103, None),
        ("vmul.f32 s0, s1, s2", 0xee20, 0x0a81, None),
        ("vcvt.s32.f32 s0, s0", 0xeebd, 0x0ac0, None),
    ];
    for (text, first, second, expected) in table {
        assert_eq!(decode(AT, first, second).hazard, expected, "{text}");
        if !matches!(expected, Some(Hazard::Trap)) {
            assert_eq!(flow(first, second), Flow::Next, "{text}");
        }
    }
}

#[test]
fn what_only_computes_goes_on_with_its_own_length() {
    let table = [
        ("push {r4-r7, lr}", 0xb5f0, 0, 2),
        ("pop {r4}", 0xbc10, 0, 2),
        ("mov r8, r0", 0x4680, 0, 2),
        ("nop", 0xbf00, 0, 2),
        ("sub sp, #4", 0xb081, 0, 2),
        ("push.w {r8-r11}", 0xe92d, 0x0f00, 4),
        ("pop.w {r8-r11}", 0xe8bd, 0x0f00, 4),
        ("movw r2, #56", 0xf240, 0x0238, 4),
        ("mov.w r0, #408", 0xf44f, 0x70cc, 4),
        ("ldrd r0, r1, [r2]", 0xe9d2, 0x0100, 4),
        ("vpush {d8}", 0xed2d, 0x8b02, 4),
        ("pld [r0]", 0xf890, 0xf000, 4),
    ];
    for (text, first, second, length) in table {
        let expected = Instruction { length, flow: Flow::Next, hazard: None };
        assert_eq!(decode(AT, first, second), expected, "{text}");
    }
}
