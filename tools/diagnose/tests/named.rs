//! Physics that was left out is named, at its place, with its size; what is not in the catalogue is not.

use crate::truth;

use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::{BASE_POSITION, Input, Model, Physics, SETPOINT, simulate};
use stillbeam_recording::Recording;
use truth::{Bench, SHORT_RUNS};

fn run(bench: Bench, laws: &[Physics], options: &Options, seed: u64) -> Diagnosis {
    let all: Vec<Recording> = bench.short_recordings(laws, 0.0, seed);
    let found = diagnose(&bench.wrong_model(), &all[..2], &all[2..], options, &mut |_| {}).unwrap();
    says_one_thing(&found);
    found
}

/// A verdict that names nothing comes with no effect, no tie of what it names, no named candidate and no
/// extended model; any other with all.
fn says_one_thing(found: &Diagnosis) {
    let names = !matches!(found.verdict, Verdict::Adequate | Verdict::Unexplained);
    assert_eq!(!found.effects.is_empty(), names, "{}", found.sentence);
    assert_eq!(found.extended_model.is_some(), names, "{}", found.sentence);
    // An adequate model may owe that to a parameter that stands for a law: the tie says so, its first set is
    // empty.
    assert!(names || found.ties.iter().all(|tie| tie.candidates[0].is_empty()), "{:?}", found.ties);
    assert_eq!(found.candidates.iter().filter(|row| row.named).count(), found.effects.len());
}

fn limited(set: impl Fn(&mut Options)) -> Options {
    let mut options = Options::default();
    set(&mut options);
    options
}

fn named(found: &Diagnosis) -> Vec<String> {
    let mut names: Vec<String> =
        found.effects.iter().map(|effect| format!("{} at {}", effect.id, effect.location)).collect();
    names.sort();
    names
}

#[test]
fn single_laws_are_named_with_their_size() {
    for (bench, law, parameter) in [
        (Bench::MovedBase, Physics::new("cubic_stiffness", "beam").with("stiffness", 40.0), "stiffness"),
        (Bench::MovedBase, Physics::new("quadratic_drag", "beam").with("drag", 0.02), "drag"),
        (Bench::ForcedBase, Physics::new("coulomb_friction", "base").with("force", 0.6), "force"),
        // A steady tone that shakes the beam of a base that is moved: no force acts on such a base.
        (
            Bench::MovedBase,
            Physics::new("periodic_disturbance", "environment")
                .with("force", 0.01)
                .with("frequency", 3.1)
                .with("phase", 0.7),
            "force",
        ),
    ] {
        let found = run(bench, std::slice::from_ref(&law), &Options::default(), 1);
        let truth = format!("{} at {}", law.id, law.location);
        assert_eq!(named(&found), vec![truth], "{:?}: {}", found.verdict, found.sentence);
        assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
        let estimate = &found.effects[0].parameters[parameter];
        let error = (estimate.value - law.parameters[parameter]).abs();
        assert!(error < 4.0 * estimate.stderr, "{parameter}: {estimate:?} for {}", law.parameters[parameter]);
        let held_out = found.fit.pooled.iter().find(|p| p.role == stillbeam_diagnose::RecordRole::HeldOut);
        let fits = held_out.map(|pooled| pooled.fits.clone()).unwrap();
        assert!(fits.extended.unwrap().rms < 0.5 * fits.refitted_linear.rms, "{fits:?}");
    }
}

#[test]
fn a_search_without_time_says_so_and_is_certain_of_nothing() {
    let law = Physics::new("cubic_stiffness", "beam").with("stiffness", 40.0);
    for options in [
        limited(|options| options.time_limit_s = Some(0.0)),
        limited(|options| options.processor_limit_s = Some(0.0)),
    ] {
        let found = run(Bench::MovedBase, std::slice::from_ref(&law), &options, 1);
        assert!(!matches!(found.verdict, Verdict::Explained | Verdict::Adequate), "{}", found.sentence);
        assert!(
            found.caps.iter().any(|cap| cap.contains("the search was ended after 0 s")),
            "{:?}",
            found.caps
        );
    }
}

/// What the base followed is known as a setpoint in place of the motion that came of it.
fn told_the_setpoint(found: &Model, recordings: &mut [Recording]) -> Model {
    let mut model = found.clone();
    if let Model::BeamOnBase(beam) = &mut model {
        beam.input = Some(Input::new(SETPOINT));
    }
    for column in recordings.iter_mut().flat_map(|recording| &mut recording.columns) {
        if column.name == BASE_POSITION {
            SETPOINT.clone_into(&mut column.name);
        }
    }
    model
}

/// Seen at the tip alone, a late sensor and a late drive are the same.
#[test]
fn what_cannot_be_told_apart_is_a_tie_with_a_run_that_would_help() {
    let law = Physics::new("delay", "sensor").with("delay", 0.002);
    let mut all = Bench::MovedBase.short_recordings(&[law], 0.0, 5);
    let model = told_the_setpoint(&Bench::MovedBase.wrong_model(), &mut all);
    let found = diagnose(&model, &all[..2], &all[2..], &Options::default(), &mut |_| {}).unwrap();
    says_one_thing(&found);
    assert_eq!(found.verdict, Verdict::Ambiguous, "{}", found.sentence);
    let tied: Vec<&String> = found.ties.iter().flat_map(|tie| &tie.candidates).flatten().collect();
    for name in ["delay at sensor", "dead_time at drive"] {
        assert!(tied.iter().any(|tied| *tied == name), "{name} is not among {tied:?}");
    }
    assert!(found.next_experiment.is_some_and(|next| next.starts_with("sweep ")));
}

/// The chain is cut at every recorded signal: a drive before the recorded motion of the base is late for
/// nobody behind it.
#[test]
fn behind_a_recorded_motion_no_law_of_the_drive_is_tried() {
    let law = Physics::new("delay", "sensor").with("delay", 0.02);
    let found = run(Bench::MovedBase, &[law], &Options::default(), 5);
    assert_eq!(named(&found), ["delay at sensor"], "{:?}: {}", found.verdict, found.sentence);
    assert!(found.candidates.iter().all(|row| row.location != "drive"));
    assert!(found.ties.iter().flat_map(|tie| &tie.candidates).flatten().all(|name| !name.contains("drive")));
}

#[test]
fn equal_amplitudes_and_a_hidden_base_are_said() {
    let bench = Bench::ForcedBase;
    let run = SHORT_RUNS[0];
    let all: Vec<Recording> = (0..3)
        .map(|seed| {
            let mut recording = bench.record(run, &[], 0.0, seed);
            recording.columns.retain(|column| column.name != "base_position_m");
            recording
        })
        .collect();
    let found =
        diagnose(&bench.wrong_model(), &all[..2], &all[2..], &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.caps.iter().any(|cap| cap.contains("equally hard")), "{:?}", found.caps);
    assert!(found.caps.iter().any(|cap| cap.contains("base was not recorded")), "{:?}", found.caps);
}

#[test]
fn what_the_catalogue_lacks_is_located_and_not_named_with_confidence() {
    let law = Physics::new("cubic_stiffness", "beam").with("stiffness", 40.0);
    let mut options = Options::default();
    options.without.push("cubic_stiffness".to_owned());
    let found = run(Bench::MovedBase, &[law], &options, 2);
    assert!(matches!(found.verdict, Verdict::Unexplained | Verdict::Improved), "{}", found.sentence);
    let mismatch = found.mismatch.unwrap();
    assert!(!mismatch.time_windows_s.is_empty() && !mismatch.frequency_bands_hz.is_empty());
    assert_eq!(mismatch.link.as_deref(), Some("beam"));
}

#[test]
fn the_extended_model_is_a_model_file_that_simulates() {
    let law = Physics::new("cubic_stiffness", "beam").with("stiffness", 40.0);
    let bench = Bench::MovedBase;
    let found = run(bench, &[law], &Options::default(), 3);
    let text = found.extended_model.unwrap().to_toml().unwrap();
    let again = Model::from_toml("extended.toml", &text).unwrap();
    assert_eq!(again.setup().physics.len(), 1);
    let recording = &bench.short_recordings(&[], 0.0, 4)[0];
    assert!(simulate(&again, recording).is_ok());
}
