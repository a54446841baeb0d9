//! Laws that hardly show, and laws that bend the motion so far that it is another one.

mod truth;

use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::Physics;
use stillbeam_recording::Recording;
use truth::{Bench, RESULT_RUNS, RESULT_TRAINED, noisy};

/// A machine pushed by a force, in noise of these sizes at tip and base.
fn pushed(law: Physics, noise_m: [f64; 2]) -> Diagnosis {
    let bench = Bench::ForcedBase;
    let recordings: Vec<Recording> = (200..)
        .zip(RESULT_RUNS)
        .map(|(seed, run)| noisy(&bench.clean(run, std::slice::from_ref(&law)), &noise_m, 0.0, seed))
        .collect();
    let (train, held_out) = recordings.split_at(RESULT_TRAINED);
    diagnose(&bench.wrong_model_of(2), train, held_out, &Options::default(), &mut |_| {}).unwrap()
}

fn named(found: &Diagnosis) -> Vec<&str> {
    found.effects.iter().map(|effect| effect.id.as_str()).collect()
}

/// At the motion that there is without it, a spring of the size that the residual asks for does nothing that looks like the residual.
#[test]
fn a_spring_that_holds_a_base_which_would_drift_is_seen() {
    let law = Physics::new("cubic_stiffness", "base").with("stiffness", 34.0);
    let found = pushed(law, [5.5e-3, 1.3e-3]);
    assert_eq!(named(&found), ["cubic_stiffness"], "{}", found.sentence);
}

/// Most of what a wave of force does to a free base is a constant push.
#[test]
fn a_wave_that_is_seen_but_not_told_from_a_constant_force_is_published_beside_it() {
    let law = Physics::new("cogging", "base").with("force", 1e-3).with("period", 0.03).with("phase", 0.4);
    let found = pushed(law, [5.5e-3, 1.3e-3]);
    if named(&found) != ["cogging"] {
        assert_eq!(found.verdict, Verdict::Ambiguous, "{}", found.sentence);
        let tied = found.ties.iter().flat_map(|tie| &tie.candidates).flatten();
        assert!(tied.into_iter().any(|name| name == "cogging at base"), "{:?}", found.ties);
    }
}

/// The recording of which most is left does not show which period it is.
#[test]
fn the_period_of_a_weak_ripple_is_looked_for_on_all_recordings() {
    let law = Physics::new("force_ripple", "drive");
    let found = pushed(law.with("ripple", 1.1e-4).with("period", 0.03).with("phase", 0.4), [5.5e-3, 1.3e-3]);
    assert_eq!(named(&found), ["force_ripple"], "{}", found.sentence);
    let period = &found.effects[0].parameters["period"];
    assert!((period.value - 0.03).abs() < 3.0 * period.stderr, "{period:?}");
}
