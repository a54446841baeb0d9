//! Diagnoses one simulated case: `cargo run --release -p stillbeam-diagnose --example one_case -- moved
//! cubic_stiffness beam stiffness=50`; with `controls=6` the diagnosis is tried on that very experiment too,
//! as `stillbeam diagnose --controls` does.

#[path = "../tests/truth/mod.rs"]
mod truth;

use stillbeam_diagnose::{Options, Progress, controls, diagnose};
use stillbeam_plant::Physics;
use truth::Bench;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let bench =
        if arguments.first().is_some_and(|a| a == "forced") { Bench::ForcedBase } else { Bench::MovedBase };
    let rest = &arguments[1.min(arguments.len())..];
    let mut laws = Vec::new();
    let mut seed = 1;
    let mut rho = 0.0;
    let mut control_runs = 0;
    let mut options = Options::default();
    let mut k = 0;
    while k < rest.len() {
        if let Some(value) = rest[k].strip_prefix("seed=") {
            seed = value.parse().unwrap_or(1);
            k += 1;
        } else if let Some(value) = rest[k].strip_prefix("rho=") {
            rho = value.parse().unwrap_or(0.0);
            k += 1;
        } else if let Some(value) = rest[k].strip_prefix("controls=") {
            control_runs = value.parse().unwrap_or(0);
            k += 1;
        } else if let Some(value) = rest[k].strip_prefix("without=") {
            options.without.push(value.to_owned());
            k += 1;
        } else {
            let mut law = Physics::new(rest[k].clone(), rest[k + 1].clone());
            k += 2;
            while let Some((name, value)) = rest.get(k).and_then(|text| text.split_once('=')) {
                if ["seed", "rho", "without", "controls"].contains(&name) {
                    break;
                }
                law = law.with(name, value.parse().unwrap_or(0.0));
                k += 1;
            }
            laws.push(law);
        }
    }
    let short = std::env::var("SHORT").is_ok();
    let all =
        if short { bench.short_recordings(&laws, rho, seed) } else { bench.recordings(&laws, rho, seed) };
    let train = if short { 2 } else { 3 };
    let model = bench.wrong_model();
    let (trained, held_out) = all.split_at(train);
    let mut tell = |progress: &Progress| eprintln!("{:3.0} % {}", 100.0 * progress.done, progress.step);
    let found = diagnose(&model, trained, held_out, &options, &mut tell);
    match found {
        Err(error) => println!("{error}"),
        Ok(found) => {
            if control_runs > 0 {
                let begun = std::time::Instant::now();
                match controls(&model, trained, held_out, &options, &found, control_runs, &mut tell) {
                    Ok(controls) => println!("{}", controls.sentence()),
                    Err(error) => println!("{error}"),
                }
                println!("controls took {:.0} s", begun.elapsed().as_secs_f64());
            }
            println!("{:?}: {}", found.verdict, found.sentence);
            for effect in &found.effects {
                println!(
                    "  {} at {}: {:?} {:?}",
                    effect.id, effect.location, effect.parameters, effect.evidence
                );
            }
            for tie in &found.ties {
                println!("  tie: {}", tie.sentence);
            }
            println!(
                "  undetermined {:?}; changes {:?}",
                found.undetermined_parameters, found.parameter_changes
            );
            for parameter in found.refitted_model.parameters() {
                println!("  refitted without laws: {} {:.5e}", parameter.path, parameter.value);
            }
            for pooled in &found.fit.pooled {
                println!(
                    "  {:?} {}: {:.3e} {:.3e} {:?} floor {:.3e}",
                    pooled.role,
                    pooled.output,
                    pooled.fits.given.rms,
                    pooled.fits.refitted_linear.rms,
                    pooled.fits.extended.map(|quality| quality.rms),
                    pooled.fits.given.noise_floor
                );
            }
            println!("  {:?}", found.residual_tests);
            for row in found.candidates.iter().take(14) {
                let gates: Vec<String> = row
                    .gates
                    .iter()
                    .map(|g| format!("{}{}: {}", if g.passed { "+" } else { "-" }, g.name, g.detail))
                    .collect();
                println!(
                    "  {} {} at {}: t {:.1} hidden {:.3} | {}",
                    if row.named { "*" } else { " " },
                    row.id,
                    row.location,
                    row.screen_t,
                    row.hidden_share,
                    gates.join("; ")
                );
            }
            println!(
                "  {} candidates, {:.1} s; set aside {:?}; caps {:?}",
                found.candidates.len(),
                found.seconds,
                found.set_aside,
                found.caps
            );
        }
    }
}
