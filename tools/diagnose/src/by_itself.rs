//! A machine that was another one from recording to recording.
//!
//! A clamp that was opened, a room that warmed up, a load that was changed: every recording by itself is then
//! explained by the model within its own parameters, and no one set of them explains all. Laws are flexible
//! enough to take a part of such a difference away; that is no reason to name one.

use stillbeam_plant::Model;
use stillbeam_recording::Role;

use crate::adequacy::is_adequate;
use crate::comparison::{Compared, compare_from};
use crate::fit::Fitted;
use crate::intervals::precision;
use crate::linear_findings::as_linear;
use crate::options::Options;
use crate::record::Record;
use crate::simulation::{Hypothesis, resonances};
use crate::study::Study;
use crate::wording::with_error;

/// Standard errors by which a parameter differs between two recordings to be another one.
const DIFFERENT: f64 = 6.0;

/// The model refitted to one recording.
struct ByItself {
    recording: String,
    /// Path, value and standard error of every free parameter.
    parameters: Vec<(String, f64, f64)>,
    /// Of the refitted model's modes, hertz, the slowest first.
    frequencies_hz: Vec<f64>,
}

/// Lines that say how the model differs between recordings, and in which of its parameters, if every
/// recording by itself is explained down to the noise; none otherwise. `compared` is the refit to all.
pub(crate) fn differing_parameters(
    study: &Study,
    model: &Model,
    compared: &Compared,
    options: &Options,
) -> Vec<String> {
    if study.train.len() + study.held_out.len() < 2 {
        return Vec::new();
    }
    let records = study.train.iter().chain(&study.held_out);
    let each: Option<Vec<ByItself>> =
        records.map(|record| alone(study, record, model, compared, options)).collect();
    each.map(|each| lines(&each)).unwrap_or_default()
}

/// The refit to one recording, within the model or within what else a linear machine may do, if it leaves
/// nothing but noise.
fn alone(
    study: &Study,
    record: &Record,
    model: &Model,
    compared: &Compared,
    options: &Options,
) -> Option<ByItself> {
    if study.is_spent() {
        return None;
    }
    let train = vec![Record { role: Role::Train, ..record.clone() }];
    let mut study = Study { train, held_out: Vec::new(), input_errors: Vec::new(), ..study.clone() };
    let mut found = compare_from(&mut study, &Hypothesis::given(model), compared).ok()?;
    study.draw_input_errors(&found.refitted);
    if !is_adequate(&study.adequacies(&found.refitted_on_all, &found.floors), options) {
        (study, found) = as_linear(&study, model, &found, options).ok()??;
    }
    let modes = resonances(&found.refitted.hypothesis.model);
    let mut frequencies_hz: Vec<f64> = modes.iter().map(|mode| mode.frequency_hz).collect();
    frequencies_hz.sort_by(f64::total_cmp);
    let parameters = parameters(&study, &found.refitted);
    Some(ByItself { recording: record.name.clone(), parameters, frequencies_hz })
}

fn parameters(study: &Study, fitted: &Fitted) -> Vec<(String, f64, f64)> {
    let known = precision(&study.stack(Role::Train), fitted, study.slowest_hz, &|_| false);
    let rows = fitted.free.iter().zip(&fitted.values).zip(known.by_noise);
    rows.filter(|((parameter, _), _)| !parameter.is_added)
        .map(|((parameter, value), stderr)| (parameter.path.clone(), *value, stderr))
        .collect()
}

fn lines(each: &[ByItself]) -> Vec<String> {
    let Some(first) = each.first() else { return Vec::new() };
    let of = |path: &str| -> Vec<(&str, f64, f64)> {
        let values = each.iter().filter_map(|alone| {
            let (_, value, stderr) = alone.parameters.iter().find(|(its, ..)| its == path)?;
            Some((alone.recording.as_str(), *value, *stderr))
        });
        values.collect()
    };
    let differs = |path: &str| {
        let values = of(path);
        values
            .iter()
            .any(|(_, a, sa)| values.iter().any(|(_, b, sb)| (a - b).abs() > DIFFERENT * sa.hypot(*sb)))
    };
    let paths = first.parameters.iter().map(|(path, ..)| path.as_str());
    let parameters = paths.filter(|path| differs(path)).map(|path| {
        let said = |(name, value, stderr)| format!("{} in {name}", with_error(value, stderr, ""));
        let values: Vec<String> = of(path).into_iter().map(said).collect();
        format!("{path} differs between the recordings: {}", values.join(", "))
    });
    // Parameters that do alike are known badly one by one; what they make of the modes is not.
    let modes = each.iter().map(|alone| {
        let hertz: Vec<String> = alone.frequencies_hz.iter().map(|hz| format!("{hz:.4}")).collect();
        format!("{} Hz in {}", hertz.join(" and "), alone.recording)
    });
    let modes = format!(
        "the model refitted to each recording by itself has its modes at {}",
        modes.collect::<Vec<_>>().join(", ")
    );
    std::iter::once(modes).chain(parameters).collect()
}

#[cfg(test)]
mod tests {
    use stillbeam_recording::Recording;

    use crate::naming::on_a_spring::{hardening, machine, noisy_runs};
    use crate::{Diagnosis, Options, Verdict, diagnose};

    /// One run of a machine whose spring has this stiffness, N/m.
    fn run(stiffness: f64, amplitude_n: f64) -> Recording {
        let mut machine = machine();
        machine.set_parameter("spring.mass-ground.stiffness", stiffness).unwrap();
        let run = noisy_runs(&machine, &[amplitude_n], 1e-5).remove(0);
        Recording { name: format!("at {stiffness}"), ..run }
    }

    fn diagnosed(train: &[Recording], held_out: &[Recording]) -> Diagnosis {
        diagnose(&machine(), train, held_out, &Options::default(), &mut |_| {}).unwrap()
    }

    #[test]
    fn a_spring_that_differs_between_recordings_is_that_and_no_law() {
        for stiffnesses in [[300.0, 303.0, 297.0], [310.0, 300.0, 304.0]] {
            let [first, second, third] = stiffnesses;
            let found = diagnosed(&[run(first, 3.0), run(second, 9.0)], &[run(third, 5.0)]);
            assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
            assert!(found.effects.is_empty() && found.unconfirmed.is_empty(), "{}", found.sentence);
            assert!(found.sentence.contains("from recording to recording"), "{}", found.sentence);
            let is_said = |cap: &String| {
                stiffnesses.iter().all(|stiffness| cap.contains(&format!("in at {stiffness}")))
                    && cap.starts_with("spring.mass-ground.stiffness differs")
            };
            assert!(found.caps.iter().any(is_said), "{:?}", found.caps);
        }
    }

    #[test]
    fn a_law_that_is_there_is_named_though_it_looks_otherwise_at_every_amplitude() {
        let truth = hardening(machine(), 2e4);
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        let found = diagnosed(&noisy(&[3.0, 9.0]), &noisy(&[5.0]));
        assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
        assert_eq!(found.effects[0].id, "cubic_stiffness");
    }
}
