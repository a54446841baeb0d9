//! Where the mismatch is, how large the force that would explain it, and which parameters were wrong, once
//! the law is known.

use crate::truth;

use std::sync::OnceLock;

use stillbeam_diagnose::{Diagnosis, Options, diagnose};
use stillbeam_plant::Physics;
use stillbeam_recording::Recording;
use truth::Bench;

const BENCH: Bench = Bench::ForcedBase;
const FRICTION_N: f64 = 0.6;

/// A pushed base with dry friction, diagnosed once for all tests.
fn friction_of_the_base() -> &'static Diagnosis {
    static FOUND: OnceLock<Diagnosis> = OnceLock::new();
    FOUND.get_or_init(|| {
        let law = Physics::new("coulomb_friction", "base").with("force", FRICTION_N);
        let all: Vec<Recording> = BENCH.short_recordings(&[law], 0.0, 1);
        diagnose(&BENCH.wrong_model(), &all[..2], &all[2..], &Options::default(), &mut |_| {}).unwrap()
    })
}

/// A refit of the whole chain without the friction bends the beam's parameters; that must not be held against
/// the beam.
#[test]
fn friction_of_the_base_is_located_there() {
    let mismatch = friction_of_the_base().mismatch.as_ref().unwrap();
    assert_eq!(mismatch.link.as_deref(), Some("base"), "{:?}", mismatch.sentences);
}

#[test]
fn the_force_at_the_place_of_a_law_has_the_laws_size() {
    let surfaces = &friction_of_the_base().surfaces;
    assert_eq!(surfaces[0].location, "base");
    let share = surfaces[0].rms / FRICTION_N;
    assert!((0.75..1.05).contains(&share), "{} N rms for {FRICTION_N} N of friction", surfaces[0].rms);
    assert!(surfaces[0].static_share > 0.5, "{}", surfaces[0].static_share);
    // The law, drawn over the same cells, is that force.
    let law = surfaces[0].law.as_ref().unwrap();
    let cells = || law.iter().zip(&surfaces[0].mean).filter_map(|(law, mean)| Some(((*law)?, (*mean)?)));
    let apart: f64 = cells().map(|(law, mean)| (law - mean).powi(2)).sum();
    let power: f64 = cells().map(|(law, _)| law * law).sum();
    assert!(apart < 0.2 * power, "{}", apart / power);
    // Every other place sees forces of the size of those of this machine, not what a filter without a hold
    // makes of them.
    for surface in surfaces {
        assert!(surface.rms.is_finite() && surface.rms < 50.0, "{} {}", surface.location, surface.rms);
    }
}

/// The parameters that are said to be wrong are those beside the law, not those of a refit that had to do
/// without it.
#[test]
fn parameters_are_corrected_beside_the_law_and_not_instead_of_it() {
    let (found, truth) = (friction_of_the_base(), BENCH.model());
    assert!(!found.parameter_changes.is_empty());
    for change in &found.parameter_changes {
        let right = truth.parameter(&change.path).unwrap();
        let off = (change.to - right).abs() / change.stderr;
        assert!(off < 5.0, "{}: {} for {right}, {off:.1} standard errors", change.path, change.to);
    }
}
