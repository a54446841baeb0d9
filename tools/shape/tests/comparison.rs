//! What shapers are compared by: cost on the board, accidents, and the least residual against duration.

use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::{Mode, ShaperTable, ShaperType, Tap};
use stillbeam_firmware::units::TickRate;
use stillbeam_shape::{ModeBox, OptimalRequest, TableCost, harmonic_accidents};

fn paper_modes(fraction: f64) -> Vec<ModeBox> {
    [(1.1, 0.0074), (6.9, 0.0033)]
        .map(|(hz, zeta)| ModeBox::around(hz, zeta, fraction, fraction).unwrap())
        .to_vec()
}

/// The rows of "The cascade alone" of the page that is measured on the image: table, taps, instructions.
fn measured() -> Vec<(String, usize, usize)> {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/results/firmware.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, section) = page.split_once("## The cascade alone").unwrap();
    let section = section.split("\n## ").next().unwrap();
    let cells =
        section.lines().map(|line| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>());
    cells
        .filter_map(|cells| {
            let [name, taps, instructions, _] = cells[..] else { return None };
            Some((name.to_owned(), taps.parse().ok()?, instructions.parse().ok()?))
        })
        .collect()
}

fn measured_table(name: &str) -> ShaperTable {
    let rate = TickRate::from_hz(1000.0).unwrap();
    let flat = |count: u32, run: u32| {
        let delays: Vec<u32> = (0..count).map(|tap| tap / run * 100 + tap % run).collect();
        equally_weighted(&[&delays], rate)
    };
    match name.split(' ').collect::<Vec<_>>()[..] {
        ["flat,", "in", "pairs"] => flat(16, 2),
        ["flat,", "one", "by", "one"] => flat(16, 1),
        ["flat,", "64", "one", "by", "one"] => flat(64, 1),
        ["two", "stages,", "runs", "and", "lone", "taps"] => {
            equally_weighted(&[&[0, 100, 101, 200, 300, 400, 401], &[0, 100, 200, 300, 301]], rate)
        }
        [count, _, kind] => {
            let kind: ShaperType = kind.parse().unwrap();
            let modes = [(1.1, 0.0074), (6.9, 0.0033), (19.0, 0.003), (37.0, 0.003)]
                .map(|(hz, zeta)| Mode::new(hz, zeta, kind).unwrap());
            ShaperTable::design(&modes[..count.parse().unwrap()], rate).unwrap()
        }
        _ => panic!("no such table: {name}"),
    }
}

/// Stages with taps at these delays; what does not divide evenly falls to the first tap.
fn equally_weighted(delays_ticks: &[&[u32]], rate: TickRate) -> ShaperTable {
    let stages: Vec<Vec<Tap>> = delays_ticks
        .iter()
        .map(|delays| {
            let weight = WEIGHT_ONE / delays.len() as i32;
            let first = WEIGHT_ONE - weight * (delays.len() as i32 - 1);
            let weights = std::iter::once(first).chain(std::iter::repeat(weight));
            delays.iter().zip(weights).map(|(&delay_ticks, weight)| Tap { delay_ticks, weight }).collect()
        })
        .collect();
    ShaperTable::from_stages(rate, stages.iter().map(Vec::as_slice)).unwrap()
}

#[test]
fn instructions_are_those_that_were_measured() {
    let rows = measured();
    assert_eq!(rows.len(), 11, "{rows:?}");
    for (name, taps, instructions) in rows {
        let cost = TableCost::of(&measured_table(&name));
        assert_eq!((cost.taps, cost.instructions), (taps, instructions), "{name}");
    }
}

/// 6.9 Hz is close to the seventh of 1 Hz and to multiples that MZV stills.
#[test]
fn accidents_of_the_two_modes_are_named_and_others_are_not() {
    let accidents = harmonic_accidents(&paper_modes(0.05), 0.02);
    let zvdd = accidents.iter().find(|accident| accident.kind == ShaperType::Zvdd).expect("ZVDD at 1 Hz");
    assert!((zvdd.designed_hz - 1.0).abs() < 0.01 && zvdd.nominal < 0.01, "{zvdd:?}");
    assert!(zvdd.worst > 0.15 && zvdd.mode_hz == 6.9, "{zvdd:?}");
    assert!(accidents.iter().any(|accident| accident.kind == ShaperType::Mzv));
    // Half-way between two odd multiples nothing helps.
    let apart = [(1.0, 0.005), (6.0, 0.005)].map(|(hz, zeta)| ModeBox::around(hz, zeta, 0.05, 0.0).unwrap());
    assert!(harmonic_accidents(&apart, 0.02).iter().all(|accident| accident.kind != ShaperType::Zv));
    assert!(harmonic_accidents(&paper_modes(0.05)[..1], 0.02).is_empty());
    // A box of no width is never missed.
    assert!(harmonic_accidents(&paper_modes(0.0), 0.02).is_empty());
}

#[test]
fn longer_shapers_leave_less_and_the_shortest_is_on_the_curve() {
    let modes = paper_modes(0.05);
    let request =
        OptimalRequest { modes, rate_hz: 4000.0, tolerance: 0.02, negative_limit: 0.0, longest_s: None };
    let shortest_s = request.solve().unwrap().table.duration_s();
    let curve = request.least_residuals(&[0.3, 0.6, shortest_s, 1.2]).unwrap();
    assert!(curve.windows(2).all(|pair| pair[1].1 < pair[0].1), "{curve:?}");
    // Near the shortest duration the curve falls by a tenth of itself within its coarse tick.
    assert!((0.015..0.027).contains(&curve[2].1), "{curve:?}");
}
