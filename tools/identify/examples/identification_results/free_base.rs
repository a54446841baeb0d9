//! A base that a force pushes against viscous friction: errors beside the least that any estimator can have.

use std::fmt::Write;

use stillbeam_identify::{Estimate, ForcedOptions, IdentifyError, identify_forced};

use crate::simulated::name;
use crate::synthetic::free_base::{ForceSweep, FreeBase};
use crate::synthetic::{Sweep, bound};

const NOISE_DB: f64 = 45.0;

/// Root mean squares over the seeds, the Cramér-Rao bound, and how often the intervals hold the truth.
pub fn against_the_bound(seeds: u64) -> Result<String, IdentifyError> {
    let base = FreeBase::paper(4.0);
    let truth = base.truth();
    let mut text = format!(
        "## A base with friction, pushed by a force

The paper's beam on a base of 2.5 kg that slides against 4 N s/m: sweeps of 0.1 to 8 Hz in 80 s and 1 N, the deflection at 100 Hz, {NOISE_DB} dB; modes out of phase and beside them a real pole,
whose number and presence were not given. Root mean square of the errors of {seeds} noise seeds as shares of the true values. The bound is Cramér's and Rao's, from slopes of the
simulated record by all that is not known: no unbiased estimator can be sharper on it. The exponential sweep passes the second mode at 0.38 Hz/s, the linear one at 0.10 Hz/s, and
a force moves the second mode less than a base that is moved (table above): its damping cannot be had to one per cent from this one record.

| sweep | quantity | true | error | bound | interval holds the truth |
|---|---|---|---|---|---|
"
    );
    for sweep in [Sweep::Linear, Sweep::Exponential] {
        let record = ForceSweep::new(&base, sweep);
        let bounds = bound::force_sweep(&base, &record, NOISE_DB);
        let true_values = [
            truth.modes[0][0],
            truth.modes[0][1],
            truth.modes[1][0],
            truth.modes[1][1],
            1.0 / truth.rate_per_s,
        ];
        let (mut squares, mut hits, mut whole) = ([0.0_f64; 5], [0_u32; 5], 0_u32);
        for seed in 0..seeds {
            let options =
                ForcedOptions { cross_checks: false, ..ForcedOptions::new("force_N", "tip_deflection_m") };
            let found = identify_forced(&record.recording(NOISE_DB, 100 + seed), &options)?;
            let mut estimates: Vec<Estimate> =
                found.modes.iter().flat_map(|mode| [mode.frequency_hz, mode.damping_ratio]).collect();
            estimates.extend(found.real_pole.map(|pole| pole.time_constant_s));
            whole += u32::from(estimates.len() == true_values.len());
            for (index, (estimate, truth)) in estimates.iter().zip(true_values).enumerate() {
                squares[index] += (estimate.value / truth - 1.0).powi(2);
                hits[index] += u32::from((estimate.value - truth).abs() < 1.96 * estimate.stderr);
            }
        }
        let names = ["frequency 1 (Hz)", "damping 1", "frequency 2 (Hz)", "damping 2", "time constant (s)"];
        for (index, quantity) in names.into_iter().enumerate() {
            let _written = writeln!(
                text,
                "| {} | {quantity} | {:.5} | {:.4} % | {:.4} % | {:.1} % |",
                name(sweep),
                true_values[index],
                100.0 * (squares[index] / seeds as f64).sqrt(),
                100.0 * bounds[index],
                100.0 * f64::from(hits[index]) / seeds as f64
            );
        }
        let _written = writeln!(
            text,
            "| {} | two modes and a real pole found | | in {whole} of {seeds} | | |",
            name(sweep)
        );
    }
    Ok(text)
}
