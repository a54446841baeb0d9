//! What the paper prints: its sweeps with Table 1, the decrement, the design of its shapers. Table 2 is in
//! [`crate::demo::cases`].

use stillbeam_firmware::motion::SweepKind;

/// A row of Table 1: a sweep and what the paper found with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepRow {
    /// How the frequency rises.
    pub kind: SweepKind,
    /// The printed rate: hertz per second (eq. 33) or octaves per minute (eq. 34), negative downwards.
    pub rate: f64,
    /// Printed natural frequencies of both modes, hertz.
    pub frequency_hz: [f64; 2],
    /// Printed damping ratios of both modes.
    pub damping_ratio: [f64; 2],
}

/// Lowest frequency of every sweep, hertz.
pub const LOW_HZ: f64 = 0.1;
/// Highest frequency of every sweep, hertz.
pub const HIGH_HZ: f64 = 8.0;

/// Table 1.
pub const TABLE_1: [SweepRow; 4] = [
    SweepRow {
        kind: SweepKind::Linear,
        rate: 1.0,
        frequency_hz: [1.0063, 7.0017],
        damping_ratio: [0.0011, 0.0089],
    },
    SweepRow {
        kind: SweepKind::Exponential,
        rate: 3.0,
        frequency_hz: [1.0951, 6.8917],
        damping_ratio: [0.0071, 0.0059],
    },
    SweepRow {
        kind: SweepKind::Exponential,
        rate: -5.0,
        frequency_hz: [1.0988, 6.9146],
        damping_ratio: [0.0059, 0.0033],
    },
    SweepRow {
        kind: SweepKind::Exponential,
        rate: 7.0,
        frequency_hz: [1.0976, 6.9196],
        damping_ratio: [0.0083, 0.0012],
    },
];

/// Damping ratio of both modes by the logarithmic decrement, eq. 35.
pub const DECREMENT_DAMPING: f64 = 0.0074;

/// Frequency (hertz) and damping ratio of both modes that the shapers are designed for, section 5.3. The
/// paper names 1.1 Hz and 0.0074 for the first; for the second we take its 6.9 Hz and the same damping, eq.
/// 35.
pub const DESIGN: [(f64, f64); 2] = [(1.1, DECREMENT_DAMPING), (6.9, DECREMENT_DAMPING)];

impl SweepRow {
    /// `linear, 1 Hz/s`, `exponential, -5 octaves/min`, ...
    pub fn name(&self) -> String {
        let rate = self.rate;
        match self.kind {
            SweepKind::Linear => format!("linear, {rate} Hz/s"),
            SweepKind::Exponential => format!("exponential, {rate} octaves/min"),
        }
    }

    /// First and last frequency, hertz: a negative rate starts at the top.
    pub fn from_to_hz(&self) -> (f64, f64) {
        if self.rate < 0.0 { (HIGH_HZ, LOW_HZ) } else { (LOW_HZ, HIGH_HZ) }
    }

    /// How long the sweep takes, seconds: eq. 33 or 34 solved for T.
    pub fn duration_s(&self) -> f64 {
        match self.kind {
            SweepKind::Linear => (HIGH_HZ - LOW_HZ) / self.rate.abs(),
            SweepKind::Exponential => (HIGH_HZ / LOW_HZ).log2() * 60.0 / self.rate.abs(),
        }
    }

    /// Rayleigh's `[alpha1 (1/s), alpha2 (s)]` from this row by eq. 22.
    pub fn rayleigh(&self) -> [f64; 2] {
        rayleigh(self.frequency_hz, self.damping_ratio)
    }
}

/// Eq. 22 for two modes (hertz, damping ratio) solved for `[alpha1 (1/s), alpha2 (s)]`. Either may come out
/// negative.
pub fn rayleigh(frequency_hz: [f64; 2], damping_ratio: [f64; 2]) -> [f64; 2] {
    let [w1, w2] = frequency_hz.map(|hz| std::f64::consts::TAU * hz);
    let [zeta1, zeta2] = damping_ratio;
    let difference = w2 * w2 - w1 * w1;
    [2.0 * w1 * w2 * (zeta1 * w2 - zeta2 * w1) / difference, 2.0 * (zeta2 * w2 - zeta1 * w1) / difference]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sweeps_last_as_long_as_their_rates_say() {
        let seconds: Vec<f64> = TABLE_1.iter().map(SweepRow::duration_s).collect();
        for (found, expected) in seconds.iter().zip([7.9, 126.439, 75.863, 54.188]) {
            assert!((found - expected).abs() < 1e-3, "{seconds:?}");
        }
        assert_eq!(TABLE_1[2].from_to_hz(), (8.0, 0.1));
    }

    #[test]
    fn rayleigh_coefficients_give_back_the_ratios() {
        for row in &TABLE_1 {
            let [alpha1, alpha2] = row.rayleigh();
            for (hz, zeta) in row.frequency_hz.iter().zip(row.damping_ratio) {
                let omega = std::f64::consts::TAU * hz;
                assert!((0.5 * (alpha1 / omega + alpha2 * omega) - zeta).abs() < 1e-12);
            }
        }
    }
}
