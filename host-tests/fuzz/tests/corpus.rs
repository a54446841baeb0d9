//! The kept inputs, and seeded changes of them, on every target.

use std::path::Path;
use std::time::{Duration, Instant};

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stillbeam_fuzz::Target;

/// Changed inputs per target, and the time that they may take.
const CHANGED: usize = 1500;
const PATIENCE: Duration = Duration::from_secs(3);

fn corpus(target: Target) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name());
    let mut files: Vec<_> =
        std::fs::read_dir(&folder).expect("a folder").map(|file| file.expect("a file").path()).collect();
    // Seeded changes need the same order everywhere.
    files.sort();
    files.iter().map(|file| std::fs::read(file).expect("readable")).collect()
}

/// An input with some bytes changed, cut, repeated, or taken from another input.
fn changed(inputs: &[Vec<u8>], random: &mut Xoshiro256PlusPlus) -> Vec<u8> {
    let mut below = |limit: usize| (random.next_u64() % limit.max(1) as u64) as usize;
    let mut input = inputs[below(inputs.len())].clone();
    for _ in 0..=below(6) {
        let (place, length) = (below(input.len()), 1 + below(16));
        let end = (place + length).min(input.len());
        match below(5) {
            0 => input[place..end].iter_mut().for_each(|byte| *byte = below(256) as u8),
            1 => drop(input.drain(place..end)),
            2 => drop(input.splice(place..place, input[place..end].to_vec())),
            3 => input.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= 1 << below(8)),
            _ => {
                let other = &inputs[below(inputs.len())];
                let from = below(other.len());
                let part = &other[from..(from + length).min(other.len())];
                drop(input.splice(place..end, part.iter().copied()));
            }
        }
    }
    input
}

#[test]
fn kept_inputs_and_their_neighbours_break_no_promise() {
    for target in Target::ALL {
        let inputs = corpus(target);
        assert!(!inputs.is_empty(), "{target:?} has no corpus");
        inputs.iter().for_each(|input| target.run(input));
        target.run(&[]);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let begun = Instant::now();
        let tried = (0..CHANGED)
            .take_while(|_| begun.elapsed() < PATIENCE)
            .map(|_| target.run(&changed(&inputs, &mut random)))
            .count();
        println!("{}: {} kept, {tried} changed", target.name(), inputs.len());
    }
}
