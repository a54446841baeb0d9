//! The parts of the page: which cases there are, and running them.

use std::collections::BTreeMap;
use std::fs::{OpenOptions, read_to_string};
use std::io::Write;

use stillbeam_diagnose::{Diagnosis, Options, diagnose};
use stillbeam_plant::Physics;
use stillbeam_recording::Recording;

use crate::cases::{Case, cases, put_otherwise, richer_forms, twins};
use crate::score::{Outcome, errors, holds_only, outcome, outcome_without, said};
use crate::sizes::{LIMIT, Sensitivity};
use crate::truth::{Bench, RESULT_RUNS, RESULT_TRAINED, noisy};

/// What is to be run.
pub struct Plan {
    parts: Vec<String>,
    from: u64,
    seeds: u64,
    db: Vec<f64>,
    times: Vec<f64>,
    only: Option<String>,
    keep: Option<String>,
    pub arguments: String,
}

/// One finished case.
#[derive(Debug, Clone)]
pub struct Done {
    pub part: String,
    pub case: String,
    pub outcome: String,
    pub errors: Vec<f64>,
    pub seconds: f64,
    pub said: String,
}

impl Plan {
    pub fn from_arguments(arguments: impl Iterator<Item = String>) -> Self {
        let arguments: Vec<String> = arguments.collect();
        let value = |name: &str| {
            arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('=').map(str::to_owned))
        };
        let numbers = |name: &str, default: &str| -> Vec<f64> {
            let text = value(name).unwrap_or_else(|| default.to_owned());
            text.split(',').filter_map(|number| number.parse().ok()).collect()
        };
        let mut parts: Vec<String> = arguments.iter().filter(|a| !a.contains('=')).cloned().collect();
        if parts.is_empty() {
            parts = ["null", "laws", "composites", "left-out", "absorbed"].map(str::to_owned).to_vec();
        }
        Self {
            parts,
            from: numbers("from", "1")[0] as u64,
            seeds: numbers("seeds", "3")[0] as u64,
            db: numbers("db", "30,45"),
            times: numbers("times", "3,30"),
            only: value("only"),
            keep: value("keep"),
            arguments: arguments.join(" "),
        }
    }

    fn has(&self, part: &str) -> bool {
        self.parts.iter().any(|name| name == part)
    }

    fn seeds(&self) -> impl Iterator<Item = u64> + use<> {
        self.from..self.from + self.seeds
    }
}

/// A bench at a signal-to-noise ratio, made once.
#[derive(Default)]
struct Benches {
    known: BTreeMap<(String, i64), Sensitivity>,
}

impl Benches {
    fn of(&mut self, bench: Bench, db: f64) -> &Sensitivity {
        self.known.entry((format!("{bench:?}"), db as i64)).or_insert_with(|| {
            let (trained, held_out) = RESULT_RUNS.split_at(RESULT_TRAINED);
            Sensitivity::new(bench, trained, held_out, db)
        })
    }
}

/// The runs of a plan, those kept from before included.
pub struct Log {
    keep: Option<String>,
    detail: bool,
    pub done: Vec<Done>,
}

impl Log {
    fn open(keep: Option<String>, detail: bool) -> Self {
        let text = keep.as_ref().and_then(|path| read_to_string(path).ok()).unwrap_or_default();
        Self { keep, detail, done: text.lines().filter_map(read).collect() }
    }

    fn has(&self, part: &str, case: &str) -> bool {
        self.done.iter().any(|done| done.part == part && done.case == case)
    }

    fn push(&mut self, done: Done) {
        let line = write(&done);
        eprintln!("{line}");
        let file = self.keep.as_ref().map(|path| OpenOptions::new().create(true).append(true).open(path));
        if let Some(Ok(mut file)) = file
            && let Err(error) = writeln!(file, "{line}")
        {
            eprintln!("the case is not kept: {error}");
        }
        self.done.push(done);
    }

    /// Diagnoses one case unless that has been done.
    #[allow(clippy::too_many_arguments, reason = "the whole case")]
    fn case(
        &mut self,
        part: &str,
        case: &str,
        sensitivity: &Sensitivity,
        laws: &[Physics],
        rho: f64,
        outliers: usize,
        without: &[&str],
        seed: u64,
    ) {
        if self.has(part, case) {
            return;
        }
        let bench = sensitivity.bench;
        let recordings: Vec<Recording> = (0..)
            .zip(RESULT_RUNS)
            .map(|(number, run)| {
                let seed = 100 * seed + number;
                // A sensor rounds what it reads, noise and all.
                let (rounding, others): (Vec<Physics>, Vec<Physics>) =
                    laws.iter().cloned().partition(|law| law.id == "quantisation");
                let mut recording = noisy(&bench.clean(run, &others), &sensitivity.noise_rms, rho, seed);
                for law in rounding {
                    let step = law.parameters["step"];
                    let samples = &mut recording.columns[1].samples;
                    samples.iter_mut().for_each(|value| *value = (*value / step).round() * step);
                }
                spoiled(recording, outliers, seed)
            })
            .collect();
        let (train, held_out) = recordings.split_at(RESULT_TRAINED);
        let mut options = Options::default();
        options.without.extend(without.iter().map(|id| (*id).to_owned()));
        let model = bench.wrong_model_of(seed);
        let done = match diagnose(&model, train, held_out, &options, &mut |_| {}) {
            Ok(found) => {
                if self.detail {
                    detail(&found);
                }
                let outcome = if without.is_empty() {
                    judged(&found, laws, sensitivity)
                } else {
                    outcome_without(&found)
                };
                Done {
                    part: part.to_owned(),
                    case: case.to_owned(),
                    outcome: format!("{outcome:?}"),
                    errors: errors(&found, laws),
                    seconds: found.seconds,
                    said: said(&found),
                }
            }
            Err(error) => Done {
                part: part.to_owned(),
                case: case.to_owned(),
                outcome: "Failed".to_owned(),
                errors: Vec::new(),
                seconds: 0.0,
                said: error.to_string(),
            },
        };
        self.push(done);
    }
}

/// What became of a case with the whole catalogue. Laws that the recordings cannot tell apart are measured
/// only where that decides.
fn judged(found: &Diagnosis, laws: &[Physics], sensitivity: &Sensitivity) -> Outcome {
    let outcome = outcome(found, laws);
    let mut alike = put_otherwise(sensitivity.bench, laws);
    if outcome != Outcome::Tied || !holds_only(found, &alike) {
        return outcome;
    }
    alike.retain(|set| set == laws || sensitivity.are_twins(laws, set));
    if holds_only(found, &alike) { Outcome::Twin } else { outcome }
}

/// Why: every candidate that was looked at closer.
fn detail(found: &Diagnosis) {
    eprintln!(
        "{:?}\n  undetermined {:?}, set aside {:?}, caps {:?}",
        found.residual_tests, found.undetermined_parameters, found.set_aside, found.caps
    );
    for pooled in &found.fit.pooled {
        let fits = &pooled.fits;
        eprintln!(
            "  {:?} {}: {:.4e} {:.4e} {:.4e} noise {:.4e} {:?}",
            pooled.role,
            pooled.output,
            fits.given.rms,
            fits.refitted_linear.rms,
            fits.extended.map_or(f64::NAN, |fit| fit.rms),
            fits.given.noise_floor,
            pooled.noise_source
        );
    }
    for row in found.candidates.iter().take(16) {
        let gates: Vec<String> = row
            .gates
            .iter()
            .filter(|gate| !gate.passed)
            .map(|gate| format!("{}: {}", gate.name, gate.detail))
            .collect();
        eprintln!(
            "  {}{} at {}: screen {:.1}, hidden {:.3}, training {:.1?}, held out {:.1?} {:?} FAILS {gates:?}",
            if row.named { "* " } else { "" },
            row.id,
            row.location,
            row.screen_t,
            row.hidden_share,
            row.training_t,
            row.held_out_z,
            row.parameters
                .iter()
                .map(|(name, p)| format!("{name}={:.4e}±{:.1e}", p.value, p.stderr))
                .collect::<Vec<_>>()
        );
    }
}

/// Samples that no physics makes, far off and alone.
fn spoiled(mut recording: Recording, outliers: usize, seed: u64) -> Recording {
    let count = recording.len();
    for column in recording.columns.iter_mut().skip(1) {
        let reach = column.samples.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for k in 0..outliers {
            let place = (seed as usize * 7919 + k * 1543) % count;
            column.samples[place] += if k % 2 == 0 { reach } else { -0.6 * reach };
        }
    }
    recording
}

/// Runs what the plan says and is not kept yet.
pub fn run(plan: &Plan) -> Vec<Done> {
    let mut benches = Benches::default();
    let mut log = Log::open(plan.keep.clone(), plan.has("detail"));
    if plan.has("null") {
        null(plan, &mut benches, &mut log);
    }
    if plan.has("laws") {
        laws(plan, &mut benches, &mut log);
    }
    if plan.has("composites") {
        composites(plan, &mut benches, &mut log);
    }
    if plan.has("left-out") {
        left_out(plan, &mut benches, &mut log);
    }
    if plan.has("absorbed") {
        absorbed(plan, &mut benches, &mut log);
    }
    log.done
}

fn null(plan: &Plan, benches: &mut Benches, log: &mut Log) {
    for seed in plan.seeds() {
        for bench in [Bench::MovedBase, Bench::ForcedBase] {
            for rho in [0.0, 0.5, 0.8, 0.95] {
                for outliers in [0, 5] {
                    let case = format!("{bench:?}, rho {rho}, {outliers} outliers, seed {seed}");
                    log.case("null", &case, benches.of(bench, 40.0), &[], rho, outliers, &[], seed);
                }
            }
        }
    }
}

fn wanted(plan: &Plan) -> Vec<Case> {
    let only = |case: &Case| plan.only.as_ref().is_none_or(|only| only.split(',').any(|id| id == case.id));
    cases().into_iter().filter(only).collect()
}

fn laws(plan: &Plan, benches: &mut Benches, log: &mut Log) {
    for seed in plan.seeds() {
        for case in &wanted(plan) {
            for &db in &plan.db {
                for &times in &plan.times {
                    let sensitivity = benches.of(case.bench, db);
                    let unit = (case.law)(1.0);
                    let which = if unit.parameters.contains_key("quadratic") { " (quadratic)" } else { "" };
                    let name = format!(
                        "{} at {}{which}, {db} dB, {times} times the limit, seed {seed}",
                        case.id, case.location
                    );
                    if log.has("laws", &name) {
                        continue;
                    }
                    let Some(strength) = sensitivity.strength(case, times * LIMIT) else {
                        eprintln!("{name}: cannot be made that strong");
                        continue;
                    };
                    let law = (case.law)(strength);
                    eprintln!(
                        "{name}: {:?}, hidden {:.3}",
                        law.parameters,
                        sensitivity.effect(std::slice::from_ref(&law)).1
                    );
                    measured(&law, sensitivity);
                    let law = sensitivity.as_seen(&law);
                    log.case("laws", &name, sensitivity, &[law], 0.0, 0, &[], seed);
                }
            }
        }
    }
}

/// The laws that may record the same as this one, and whether they do.
fn measured(law: &Physics, sensitivity: &Sensitivity) -> Vec<(Vec<Physics>, bool)> {
    let mut measured = Vec::new();
    for twin in twins(sensitivity.bench, law) {
        let distance = sensitivity.distance(std::slice::from_ref(law), &twin);
        let ids: Vec<&str> = twin.iter().map(|law| law.id.as_str()).collect();
        eprintln!("  {distance:.2} standard errors from {}", ids.join(" with "));
        measured.push((twin, distance < LIMIT));
    }
    measured
}

/// Laws that are left out together.
const COMPOSITES: [&[&str]; 8] = [
    &["coulomb_friction@base", "quadratic_drag@base"],
    &["coulomb_friction@base", "cogging@base"],
    &["coulomb_friction@base", "cable_spring@base", "dead_time@drive"],
    &["cubic_stiffness@beam", "quadratic_drag@beam"],
    &["cubic_stiffness@beam", "delay@sensor"],
    &["quadratic_drag@beam", "crosstalk@sensor"],
    &["cubic_stiffness@beam", "quadratic_drag@beam", "delay@sensor"],
    &["cubic_stiffness@base", "dead_zone@drive"],
];

fn composites(plan: &Plan, benches: &mut Benches, log: &mut Log) {
    let all = cases();
    for seed in plan.seeds() {
        for composite in COMPOSITES {
            let chosen: Vec<&Case> = composite
                .iter()
                .filter_map(|name| all.iter().find(|case| format!("{}@{}", case.id, case.location) == *name))
                .collect();
            let bench = chosen[0].bench;
            let name = format!("{}, seed {seed}", composite.join(" + "));
            if log.has("composites", &name) {
                continue;
            }
            let sensitivity = benches.of(bench, 45.0);
            let laws: Vec<Physics> = chosen
                .iter()
                .filter_map(|case| sensitivity.strength(case, 30.0 * LIMIT).map(case.law))
                .collect();
            log.case("composites", &name, sensitivity, &laws, 0.0, 0, &[], seed);
        }
    }
}

/// Ids that have to be struck so that a law is in the catalogue under no name. Without the last of several
/// laws the others are no more than a part.
fn names_of(law: &Physics, sensitivity: &Sensitivity) -> Vec<String> {
    let mut ids = vec![law.id.clone()];
    for (twin, is_same) in measured(law, sensitivity) {
        if let Some(last) = twin.last().filter(|last| is_same && !ids.contains(&last.id)) {
            ids.push(last.id.clone());
        }
    }
    ids
}

fn left_out(plan: &Plan, benches: &mut Benches, log: &mut Log) {
    for seed in plan.seeds() {
        for case in wanted(plan) {
            let name = |ids: &[&str]| {
                let nor: String = ids[1..].iter().map(|id| format!(" nor {id}")).collect();
                format!("{} at {} not in the catalogue{nor}, seed {seed}", case.id, case.location)
            };
            // What has no twin need not be measured to know its name.
            let unit = (case.law)(1.0);
            let known = [&[case.id], richer_forms(&unit)].concat();
            if twins(case.bench, &unit).is_empty() && log.has("left-out", &name(&known)) {
                continue;
            }
            let sensitivity = benches.of(case.bench, 45.0);
            let Some(strength) = sensitivity.strength(&case, 30.0 * LIMIT) else { continue };
            let law = sensitivity.as_seen(&(case.law)(strength));
            let ids = names_of(&law, sensitivity);
            let struck: Vec<&str> =
                ids.iter().map(String::as_str).chain(richer_forms(&law).iter().copied()).collect();
            let name = name(&struck);
            log.case("left-out", &name, sensitivity, &[law], 0.0, 0, &struck, seed);
        }
    }
}

/// An effect of which a refit hides most on any single recording is found from two amplitudes.
fn absorbed(plan: &Plan, benches: &mut Benches, log: &mut Log) {
    for seed in plan.seeds() {
        for case in wanted(plan) {
            let single: Vec<f64> = (0..RESULT_TRAINED)
                .map(|run| {
                    let alone = Sensitivity::new(case.bench, &RESULT_RUNS[run..=run], &[], 45.0);
                    alone.effect(&[(case.law)(0.1)]).1
                })
                .collect();
            let least = single.iter().copied().fold(1.0, f64::min);
            if least < 0.7 {
                continue;
            }
            let name =
                format!("{} at {}, {:.0} % hidden, seed {seed}", case.id, case.location, 100.0 * least);
            if log.has("absorbed", &name) {
                continue;
            }
            let sensitivity = benches.of(case.bench, 45.0);
            let Some(strength) = sensitivity.strength(&case, 10.0 * LIMIT) else { continue };
            let law = sensitivity.as_seen(&(case.law)(strength));
            log.case("absorbed", &name, sensitivity, &[law], 0.0, 0, &[], seed);
        }
    }
}

/// One line: fields parted by tabs.
fn write(done: &Done) -> String {
    let errors: Vec<String> = done.errors.iter().map(|error| format!("{error:.3}")).collect();
    format!(
        "{}\t{}\t{}\t{:.1}\t{}\t{}",
        done.part,
        done.case,
        done.outcome,
        done.seconds,
        errors.join(" "),
        done.said.replace(['\t', '\n'], " ")
    )
}

fn read(line: &str) -> Option<Done> {
    let mut fields = line.split('\t');
    let mut done = Done {
        part: fields.next()?.to_owned(),
        case: fields.next()?.to_owned(),
        outcome: fields.next()?.to_owned(),
        seconds: fields.next()?.parse().ok()?,
        errors: fields.next()?.split(' ').filter_map(|number| number.parse().ok()).collect(),
        said: fields.next()?.to_owned(),
    };
    // Lines kept from when this had no outcome of its own.
    if done.part == "left-out" && done.said.starts_with("Improved") {
        done.outcome = "Improved".to_owned();
    }
    Some(done)
}
