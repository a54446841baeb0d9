//! The shortest shaper for all modes at once.

mod boundary;
mod fixed_duration;
mod pole;
mod programme;
mod uncertainty;

pub use uncertainty::ModeBox;

#[cfg(test)]
mod probe {
    use super::fixed_duration::*;
    use super::*;
    use std::time::Instant;

    #[test]
    fn probe() {
        for (tolerance, fraction, zeta) in [
            (1e-7, 0.0, 0.0),
            (0.05, 0.05, 0.0),
            (0.02, 0.05, 0.0),
            (0.0057, 0.05, 0.0),
            (0.05, 0.1, 0.0),
            (0.0035, 0.1, 0.0),
            (0.0004, 0.05, 0.0),
            (0.02, 0.05, 0.05),
            (0.02, 0.05, 0.5),
        ] {
            let modes = vec![
                ModeBox::around(1.1, 0.0074, fraction, zeta).unwrap(),
                ModeBox::around(6.9, 0.0033, fraction, zeta).unwrap(),
            ];
            let problem = Problem { modes, tick_s: 1.0 / 4000.0, negative_limit: 0.0 };
            let start = Instant::now();
            let mut memory = Memory::default();
            let (mut low, mut high) = (0u32, 1800u32);
            let mut solves = 0;
            loop {
                solves += 1;
                let verdict = problem.least_residual(high, Some(tolerance), &mut memory).unwrap();
                if verdict.worst <= tolerance {
                    break;
                }
                low = high;
                high *= 2;
            }
            while high - low > 1 {
                let middle = (low + high) / 2;
                solves += 1;
                let verdict = problem.least_residual(middle, Some(tolerance), &mut memory).unwrap();
                if verdict.worst <= tolerance {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let verdict = problem.least_residual(high, None, &mut memory).unwrap();
            println!(
                "{tolerance} {fraction} {zeta}: {high} ticks {:.4} s, {solves} durations, {:.2?}, worst {} bound {}, taps {}",
                f64::from(high) / 4000.0,
                start.elapsed(),
                verdict.worst,
                verdict.bound,
                verdict.taps.iter().filter(|tap| tap.1 > 1e-7).count()
            );
        }
    }
}
