//! Opcodes assembled by hand from the encoding diagrams, cross-read with a disassembler.

use super::*;

fn word(
    direction: Direction,
    transfer: u8,
    base: u8,
    offset: Offset,
    indexing: Indexing,
    length: u32,
) -> WordAccess {
    WordAccess { direction, transfer, base, offset, indexing, length }
}

#[test]
fn word_accesses_decode_to_their_operands() {
    use Direction::{Load, Store};
    use Indexing::{Offset as Plain, PostIndexed, PreIndexed};
    use Offset::{Immediate, Register};
    let index = |index, shift| Register { index, shift };
    let table = [
        ("ldr r0, [r0]", [0x6800, 0], word(Load, 0, 0, Immediate(0), Plain, 2)),
        ("ldr r3, [r1, #8]", [0x688b, 0], word(Load, 3, 1, Immediate(8), Plain, 2)),
        ("str r7, [r2, #124]", [0x67d7, 0], word(Store, 7, 2, Immediate(124), Plain, 2)),
        ("ldr r2, [sp, #4]", [0x9a01, 0], word(Load, 2, 13, Immediate(4), Plain, 2)),
        ("str r1, [sp, #1020]", [0x91ff, 0], word(Store, 1, 13, Immediate(1020), Plain, 2)),
        ("ldr r4, [r5, r6]", [0x59ac, 0], word(Load, 4, 5, index(6, 0), Plain, 2)),
        ("str r0, [r1, r2]", [0x5088, 0], word(Store, 0, 1, index(2, 0), Plain, 2)),
        ("ldr.w r8, [r9, #2048]", [0xf8d9, 0x8800], word(Load, 8, 9, Immediate(2048), Plain, 4)),
        ("str.w r12, [r0, #4095]", [0xf8c0, 0xcfff], word(Store, 12, 0, Immediate(4095), Plain, 4)),
        ("ldr.w r1, [r2, r3, lsl #2]", [0xf852, 0x1023], word(Load, 1, 2, index(3, 2), Plain, 4)),
        ("str.w r10, [r11, r12, lsl #3]", [0xf84b, 0xa03c], word(Store, 10, 11, index(12, 3), Plain, 4)),
        ("ldr r1, [r0, #-4]", [0xf850, 0x1c04], word(Load, 1, 0, Immediate(-4), Plain, 4)),
        ("ldr r1, [r0, #4]!", [0xf850, 0x1f04], word(Load, 1, 0, Immediate(4), PreIndexed, 4)),
        ("ldr r1, [r0, #-255]!", [0xf850, 0x1dff], word(Load, 1, 0, Immediate(-255), PreIndexed, 4)),
        ("ldr r1, [r0], #4", [0xf850, 0x1b04], word(Load, 1, 0, Immediate(4), PostIndexed, 4)),
        ("str r2, [r3], #-8", [0xf843, 0x2908], word(Store, 2, 3, Immediate(-8), PostIndexed, 4)),
    ];
    for (text, [first, second], expected) in table {
        assert_eq!(decode(first, second), Ok(expected), "{text}");
    }
}

#[test]
fn a_narrow_instruction_does_not_depend_on_what_follows_it() {
    for second in [0x0000, 0xbf00, 0xffff, 0xf8d9] {
        assert_eq!(decode(0x688b, second), decode(0x688b, 0));
    }
}

#[test]
fn accesses_that_are_not_plain_words_are_refused_by_name() {
    let table = [
        ("ldrd r2, r3, [r0]", [0xe9d0, 0x2300], "LDRD or STRD"),
        ("strd r2, r3, [r0], #8", [0xe8e0, 0x2302], "LDRD or STRD"),
        ("ldrex r1, [r0]", [0xe850, 0x1f00], "an exclusive access or table branch"),
        ("ldm r0, {r1, r2}", [0xc806, 0], "LDM or STM"),
        ("stmia.w r0!, {r1, r8}", [0xe8a0, 0x0102], "LDM or STM"),
        ("push {r4, lr}", [0xb510, 0], "PUSH or POP"),
        ("ldrb r0, [r1]", [0x7808, 0], "LDRB or STRB"),
        ("strh r0, [r1]", [0x8008, 0], "LDRH or STRH"),
        ("ldrsh r0, [r1, r2]", [0x5e88, 0], "LDRSH"),
        ("ldrb.w r0, [r1, #1]", [0xf891, 0x0001], "a byte or halfword access"),
        ("ldrsh.w r0, [r1, #2]", [0xf9b1, 0x0002], "a byte or halfword access"),
        ("ldr r0, [pc, #4]", [0x4801, 0], "LDR (literal)"),
        ("ldr.w r0, [pc, #4]", [0xf8df, 0x0004], "LDR (literal)"),
        ("ldr.w pc, [r0]", [0xf8d0, 0xf000], "LDR to the pc"),
        ("ldrt r1, [r0, #4]", [0xf850, 0x1e04], "LDRT or STRT"),
        ("ldr r0, [r0], #4", [0xf850, 0x0b04], "a write-back into the transferred register"),
        ("adds r0, r1, r2", [0x1888, 0], "this narrow instruction"),
        ("vldr s0, [r0]", [0xed90, 0x0a00], "this wide instruction"),
    ];
    for (text, [first, second], what) in table {
        let error = decode(first, second).expect_err(text);
        assert_eq!(error.what, what, "{text}");
        assert!(error.to_string().contains(&format!("{first:04x} {second:04x}")), "{text}: {error}");
    }
}

#[test]
fn addresses_follow_from_the_registers() {
    let address =
        |first, second, base, index| decode(first, second).expect("a word access").resolve(base, index);
    let rcc = 0x4002_3800;
    assert_eq!(address(0x688b, 0, rcc, 0), (rcc + 8, None), "ldr r3, [r1, #8]");
    assert_eq!(address(0x59ac, 0, rcc, 0x74), (rcc + 0x74, None), "ldr r4, [r5, r6]");
    assert_eq!(address(0xf852, 0x1023, rcc, 5), (rcc + 20, None), "lsl #2");
    assert_eq!(address(0xf850, 0x1c04, rcc, 0), (rcc - 4, None), "[r0, #-4]");
    assert_eq!(address(0xf850, 0x1f04, rcc, 0), (rcc + 4, Some(rcc + 4)), "[r0, #4]!");
    assert_eq!(address(0xf850, 0x1b04, rcc, 0), (rcc, Some(rcc + 4)), "[r0], #4");
    assert_eq!(address(0xf843, 0x2908, 4, 0), (4, Some(0xffff_fffc)), "wraps round");
    assert_eq!(address(0x59ac, 0, 0xffff_fff0, 0x20), (0x10, None), "wraps round");
}

/// Program status with ITSTATE `state` and every other bit set or clear.
fn status(state: u32, rest: u32) -> u32 {
    (rest & !0x0600_fc00) | ((state & 0b11) << 25) | ((state & 0xfc) << 8)
}

#[test]
fn stepping_over_an_access_moves_the_it_block_on() {
    for rest in [0, u32::MAX] {
        // ITTE EQ: condition 0000, mask 0110; then EQ 1100, then NE 1000, then out of the block.
        assert_eq!(advance_it_block(status(0b0000_0110, rest)), status(0b0000_1100, rest));
        assert_eq!(advance_it_block(status(0b0000_1100, rest)), status(0b0001_1000, rest));
        assert_eq!(advance_it_block(status(0b0001_1000, rest)), status(0, rest));
        assert_eq!(advance_it_block(status(0, rest)), status(0, rest), "outside a block");
    }
}
