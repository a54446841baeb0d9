//! Found modes against the truth.

use std::time::Instant;

use stillbeam_identify::{ForcedOptions, IdentifiedMode, identify_forced};

use crate::machine::{Case, TrueMode};

/// A mode whose part of the output has this many times the noise's standard error is one that must be found:
/// its damping is then known to about a twentieth.
const CLEAR: f64 = 60.0;
/// How far a found mode may be from a true one: in half-power bands, and as a share of the frequency.
const BANDS: f64 = 0.5;
const SHARE: f64 = 2e-3;

/// What came of the records of one kind.
#[derive(Default)]
pub struct Tally {
    records: usize,
    right: usize,
    clear: usize,
    found: usize,
    missed: usize,
    ghosts: usize,
    refused: usize,
    close_damping: usize,
    matched: usize,
    seconds: Vec<f64>,
}

impl Tally {
    pub fn take(&mut self, case: &Case) {
        let begin = Instant::now();
        let options = ForcedOptions { max_delay_s: 0.05, ..ForcedOptions::new("force_N", "tip_m_s2") };
        let found = identify_forced(&case.recording, &options);
        self.seconds.push(begin.elapsed().as_secs_f64());
        self.records += 1;
        let modes = match &found {
            Ok(found) => found.modes.as_slice(),
            Err(_) => {
                self.refused += 1;
                &[]
            }
        };
        let partner = |truth: &TrueMode| modes.iter().find(|mode| is_near(mode, truth, case.drive.softens()));
        let must = case.modes.iter().filter(|truth| truth.clear > CLEAR);
        let (seen, missed): (Vec<&TrueMode>, Vec<&TrueMode>) =
            must.partition(|truth| partner(truth).is_some());
        // Two modes at one place are one and a ghost.
        let claimed = case.modes.iter().filter(|truth| partner(truth).is_some()).count();
        let ghosts = modes.len().saturating_sub(claimed);
        self.clear += seen.len() + missed.len();
        self.found += seen.len();
        self.missed += missed.len();
        self.ghosts += ghosts;
        self.right += usize::from(missed.is_empty() && ghosts == 0);
        for truth in seen {
            let damping = partner(truth).map_or(0.0, |mode| mode.damping_ratio.value);
            self.matched += 1;
            self.close_damping += usize::from((damping / truth.damping_ratio - 1.0).abs() < 0.1);
        }
        if std::env::var_os("STILLBEAM_EACH").is_some() {
            let told = |missed: &[&TrueMode]| {
                let of =
                    |m: &&TrueMode| format!("{:.3}/{:.4} ({:.0})", m.frequency_hz, m.damping_ratio, m.clear);
                missed.iter().map(of).collect::<Vec<_>>().join(" ")
            };
            let far = |mode: &&IdentifiedMode| {
                !case.modes.iter().any(|truth| is_near(mode, truth, case.drive.softens()))
            };
            let strange: Vec<String> = modes
                .iter()
                .filter(far)
                .map(|m| format!("{:.3}/{:.4}", m.frequency_hz.value, m.damping_ratio.value))
                .collect();
            let (warned, delay) = found.as_ref().map_or((0, None), |f| (f.warnings.len(), f.delay_s));
            eprintln!(
                "{:?} {} modes, noise {:.1} %: found {}, missed [{}], strange [{}], ghosts {ghosts}, {warned} warnings, {:.2} s{}{}",
                case.drive,
                case.modes.len(),
                case.noise_pct,
                modes.len(),
                told(&missed),
                strange.join(" "),
                self.seconds.last().copied().unwrap_or(0.0),
                delay.map_or(String::new(), |d| format!(", delay {:.2e}", d.value)),
                found.as_ref().err().map_or(String::new(), |error| format!(", {error}")),
            );
        }
    }

    pub fn cells(mut self) -> String {
        self.seconds.sort_by(f64::total_cmp);
        let median = self.seconds.get(self.seconds.len() / 2).copied().unwrap_or(0.0);
        format!(
            "{} | {} | {} of {} | {} | {} | {} | {} of {} | {median:.2} s",
            self.records,
            self.right,
            self.found,
            self.clear,
            self.missed,
            self.ghosts,
            self.refused,
            self.close_damping,
            self.matched
        )
    }
}

/// One mode that is not linear goes by any frequency that it has at some amplitude.
fn is_near(mode: &IdentifiedMode, truth: &TrueMode, softens: bool) -> bool {
    let share = if softens { 0.02 } else { SHARE };
    let away = (mode.frequency_hz.value / truth.frequency_hz).ln().abs();
    away < (BANDS * 2.0 * truth.damping_ratio).max(share)
}
