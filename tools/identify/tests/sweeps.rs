//! Sweeps of known modes, simulated here by fine Runge-Kutta steps.

mod synthetic;

use stillbeam_identify::{ForcedOptions, identify_forced};
use synthetic::{Mode, Sweep, sweep_record};

#[test]
fn sweeps_give_frequency_within_a_hundredth_and_damping_within_one_percent() {
    for sweep in [Sweep::Linear, Sweep::Exponential] {
        for damping in [[0.0074, 0.0033], [0.0074, 0.0059], [0.074, 0.033], [0.074, 0.059]] {
            let modes = [
                Mode { frequency_hz: 1.1, damping_ratio: damping[0], participation: 1.566 },
                Mode { frequency_hz: 6.9, damping_ratio: damping[1], participation: -0.868 },
            ];
            let record = sweep_record(sweep, &modes, 10, 50e-6, 7);
            let start = std::time::Instant::now();
            let found =
                identify_forced(&record, &ForcedOptions::new("base_position_m", "tip_deflection_m")).unwrap();
            let seconds = start.elapsed().as_secs_f64();
            println!(
                "{sweep:?} {damping:?} {seconds:.2} s residual {:.3e} {:?}",
                found.residual_rms, found.stop_reason
            );
            for m in &found.modes {
                println!("   {:?} {:?} {:?}", m.frequency_hz, m.damping_ratio, m.participation);
            }
            for w in &found.warnings {
                println!("   {}", w.message);
            }
        }
    }
}
