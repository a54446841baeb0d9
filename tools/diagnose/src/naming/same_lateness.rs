//! A late drive and a late sensor, where one output alone was recorded.
//!
//! What a machine does to an input that comes later by a time, it does later by that time: `y(t) = F[u(· −
//! τ)](t) = F[u](t − τ)`, whatever physics is in `F`, as long as none of it goes by the clock and the input
//! reaches the output by no other way. So a dead time of the drive and a delay of all that is read are one
//! thing, whatever fits of the one and the other have come to. Two outputs tell them apart where one of them
//! lies before the machine; in a loop the controller sees what the sensor says late.

use super::selection::Selection;
use super::sets::Member;
use super::trials::Candidate;
use crate::result::Tie;

/// Laws beside which a late drive and a late sensor are two things: an input that leaks into the sensor is
/// not late, what drifts goes by the clock. (A steady tone goes by it too, and its phase is free; a sensor's
/// clock that runs differently is off by its rate times the delay.)
const TELLING: [&str; 2] = ["crosstalk", "parameter_drift"];

/// The tie of a set that is late with the one that is late elsewhere; `None` where they are two things, or in
/// a tie already. `one_output`: whether no recording, held out or not, has another output than the one.
pub(crate) fn same_lateness(
    selection: &Selection,
    candidates: &[Candidate],
    one_output: bool,
) -> Option<Tie> {
    let (laws, other) = late_elsewhere(&selection.chosen, candidates).filter(|_| one_output)?;
    if selection.has_rival(&other) {
        return None;
    }
    let names = |laws: &[usize]| laws.iter().map(|&law| candidates[law].name()).collect::<Vec<String>>();
    let [is, would_be] = laws.map(|law| candidates[law].name());
    let sentence = format!(
        "{is} is the same as {would_be} of that time: recordings of one output alone do not tell them apart."
    );
    Some(Tie { candidates: vec![names(&selection.chosen.laws), names(&other)], sentence })
}

/// The law that is late with its twin, and the set with the twin in its place.
fn late_elsewhere(chosen: &Member, candidates: &[Candidate]) -> Option<([usize; 2], Vec<usize>)> {
    let setup = chosen.fitted.hypothesis.model.setup();
    let (_, found) = setup.physics.split_at_checked(chosen.fitted.hypothesis.own_laws)?;
    if setup.controller.is_some() || setup.physics.iter().any(|law| TELLING.contains(&law.id.as_str())) {
        return None;
    }
    let id = |law: usize| candidates[law].law.id();
    let mut late = chosen.laws.iter().zip(found).filter(|(law, _)| is_late(&candidates[**law]));
    let ((&is, law), None) = (late.next()?, late.next()) else { return None };
    // A sensor may be early, a drive may not.
    law.parameters.get("delay").filter(|delay| **delay > 0.0)?;
    let would_be = (0..candidates.len()).find(|&law| id(law) != id(is) && is_late(&candidates[law]))?;
    let other = chosen.laws.iter().map(|&law| if law == is { would_be } else { law }).collect();
    Some(([is, would_be], other))
}

/// Where several outputs were recorded a sensor's law says of which it is.
fn is_late(candidate: &Candidate) -> bool {
    candidate.law.id() == "dead_time" || (candidate.law.id() == "delay" && candidate.column.is_none())
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Model, Physics};

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched};
    use crate::naming::selection::Search;

    fn late(id: &str, delay_s: f64) -> Physics {
        Physics::new(id, if id == "delay" { "sensor" } else { "drive" }).with("delay", delay_s)
    }

    /// Does something beside the refit to runs of a machine with this law.
    fn beside_the_refit(law: Physics, look: impl FnOnce(&mut Search<'_>, Member)) {
        let mut truth = machine();
        truth.setup_mut().physics = vec![law];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0]), &noisy(&[5.0]), look);
    }

    fn selected(chosen: &Member, rivals: &[Member]) -> Selection {
        Selection {
            chosen: chosen.clone(),
            rivals: rivals.to_vec(),
            judged: Vec::new(),
            screened: Vec::new(),
            first: None,
            tried: Vec::new(),
            kept: Vec::new(),
            left_out: Vec::new(),
            explained_share: None,
        }
    }

    #[test]
    fn a_late_drive_and_a_late_sensor_are_tied_whatever_the_fits_say() {
        beside_the_refit(late("dead_time", 0.02), |search, refitted| {
            let both = ["dead_time", "delay"].map(|id| fitted_with(search, &refitted, &late(id, 0.02)));
            let [drive, sensor] = &both;
            for (chosen, rival) in [(drive, sensor), (sensor, drive)] {
                let alone = selected(chosen, &[]);
                let tie = same_lateness(&alone, search.candidates, true).expect("one output was recorded");
                let names = [chosen, rival].map(|set| vec![search.candidates[set.laws[0]].name()]);
                assert_eq!(tie.candidates, names);
                assert_eq!(same_lateness(&alone, search.candidates, false), None, "two outputs");
                let tied = selected(chosen, std::slice::from_ref(rival));
                assert_eq!(same_lateness(&tied, search.candidates, true), None, "in a tie already");
            }
        });
    }

    #[test]
    fn a_sensor_that_is_early_and_lateness_beside_what_goes_by_the_clock_are_told_apart() {
        beside_the_refit(late("delay", -0.02), |search, refitted| {
            let early = fitted_with(search, &refitted, &late("delay", -0.02));
            assert_eq!(late_elsewhere(&early, search.candidates), None, "no drive is early");
            let mut sensor = early;
            let changed = |sensor: &mut Member, change: &dyn Fn(&mut Model)| {
                change(&mut sensor.fitted.hypothesis.model);
                late_elsewhere(sensor, search.candidates).is_some()
            };
            assert!(changed(&mut sensor, &|model| {
                model.setup_mut().physics[0].parameters.insert("delay".to_owned(), 0.02);
            }));
            for id in TELLING {
                let mut beside = sensor.clone();
                let told = changed(&mut beside, &|model| {
                    model.setup_mut().physics.push(Physics::new(id, "sensor"));
                });
                assert!(!told, "{id}");
            }
            let mut named = search.candidates.to_vec();
            named[sensor.laws[0]].column = Some("position_m".to_owned());
            assert_eq!(late_elsewhere(&sensor, &named), None, "one of several outputs");
        });
    }
}
