//! A real steel cantilever, knocked once (not part of this repository).
use stillbeam_identify::{FreeDecayOptions, identify_free_decay};

#[test]
fn show() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let record =
        stillbeam_recording::read_csv(&root.join("cantilever_downey/beam_impulse_ringdown.csv")).unwrap();
    for modes in [None, Some(3), Some(5)] {
        let start = std::time::Instant::now();
        let mut o = FreeDecayOptions::new("acceleration_g");
        o.modes = modes;
        let found = identify_free_decay(&record, &o).unwrap();
        println!(
            "{:.2} s rms {:.3e} {:?} {:?}",
            start.elapsed().as_secs_f64(),
            found.residual_rms,
            found.stop_reason,
            found.window_s
        );
        for m in &found.modes {
            println!("  {:?} {:?} {:?}", m.frequency_hz, m.damping_ratio, m.amplitude);
            for c in &m.cross_checks {
                println!("      {c:?}");
            }
        }
        for w in &found.warnings {
            println!("   {}", w.message);
        }
    }
}
