//! Reading and printing numbers, against `core`'s.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_firmware::decimal::{Decimal, MAX_DIGITS, MAX_PRECISION, parse};

const NUMBERS: usize = 20_000;

/// Numbers of all magnitudes, those that people write, and those at which rounding is hard.
fn numbers(seed: u64) -> impl Iterator<Item = f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let special = [0.0, -0.0, f64::MIN_POSITIVE, f64::MAX, f64::EPSILON, 5e-324, 2.225_073_858_507_201e-308];
    let powers = (-1074..1024).map(|exponent| {
        if exponent < -1022 { f64::from_bits(1 << (exponent + 1074)) } else { 2f64.powi(exponent) }
    });
    let tens = (-300..300).map(|exponent| 10f64.powi(exponent));
    let halves = (0..2000).map(|place| f64::from(place) / 16.0);
    let drawn = (0..NUMBERS).flat_map(move |_| {
        let bits = random.next_u64();
        let thousandths = (bits >> 40) as f64 / 1000.0;
        let like_settings = (bits >> 12) as f64 * 1e-12;
        [f64::from_bits(bits), thousandths, like_settings]
    });
    special
        .into_iter()
        .chain(powers)
        .chain(tens)
        .chain(halves)
        .chain(drawn)
        .flat_map(|number| [number, -number])
}

#[test]
fn the_shortest_digits_are_those_of_core() {
    for number in numbers(1) {
        assert_eq!(Decimal(number).to_string(), number.to_string(), "{number:e}");
    }
    assert_eq!(Decimal(f64::INFINITY).to_string(), "inf");
    assert_eq!(Decimal(-f64::INFINITY).to_string(), "-inf");
}

#[test]
fn a_given_number_of_digits_is_rounded_as_core_rounds() {
    for (place, number) in numbers(2).enumerate() {
        let precision = [0, 1, 2, 3, 4, 17, MAX_PRECISION][place / 2 % 7];
        assert_eq!(format!("{:.precision$}", Decimal(number)), format!("{number:.precision$}"), "{number:e}");
    }
}

/// Bit for bit, the sign of zero included.
fn same(ours: Option<f64>, theirs: Option<f64>) -> bool {
    ours.map(f64::to_bits) == theirs.map(f64::to_bits)
}

#[test]
fn what_is_read_is_what_core_reads() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    for number in numbers(3).filter(|number| !number.is_nan()) {
        let above = f64::from_bits(number.to_bits().wrapping_add(1));
        let long = format!("{number:.40}");
        let texts = [
            number.to_string(),
            format!("{number:e}"),
            format!("{number:.2e}"),
            format!("{above:.20e}"),
            long,
        ];
        for text in texts.iter().filter(|text| text.len() < MAX_DIGITS as usize) {
            assert!(same(parse(text), text.parse().ok()), "{text}: {:?}", parse(text));
        }
    }
    // Half way between two numbers, and a last digit beside it.
    for _ in 0..NUMBERS {
        let bits = random.next_u64();
        let middle = u128::from(bits >> 11 | 1 << 52) * 2 + 1;
        let (up, down) = ((bits % 60) as u32, (bits >> 6) as u32 % 30);
        let (large, small) = (middle << up, middle * 5u128.pow(down));
        for (value, exponent) in [(large, 0), (small, down)] {
            for text in [value - 1, value, value + 1].map(|value| format!("{value}e-{exponent}")) {
                assert!(same(parse(&text), text.parse().ok()), "{text}: {:?}", parse(&text));
            }
        }
    }
    // Anything made of the characters that numbers are made of.
    for _ in 0..10 * NUMBERS {
        let bits = random.next_u64();
        let text: String = (0..bits % 9)
            .map(|place| char::from(b"0123459.eE+-infa"[(bits >> (8 + 4 * place)) as usize % 16]))
            .collect();
        assert!(same(parse(&text), text.parse().ok()), "{text}: {:?}", parse(&text));
    }
}

#[test]
fn more_digits_than_a_line_has_are_refused() {
    let digits = "7".repeat(MAX_DIGITS as usize);
    assert_eq!(parse(&format!("000{digits}e-199")), format!("{digits}e-199").parse().ok());
    assert_eq!(parse(&format!("{digits}7")), None);
}
