//! A late drive and a late sensor, where one output alone was recorded.
//!
//! What a machine does to an input that comes later by a time, it does later by that time: `y(t) = F[u(· − τ)](t) = F[u](t − τ)`, whatever
//! physics is in `F`, as long as none of it goes by the clock and the input reaches the output by no other way. So a dead time of the
//! drive and a delay of all that is read are one thing, whatever fits of the one and the other have come to. Two outputs tell
//! them apart where one of them lies before the machine; in a loop the controller sees what the sensor says late.

use stillbeam_plant::Model;

use super::sets::Member;
use super::trials::Candidate;
use crate::result::Tie;

/// Laws beside which a late drive and a late sensor are two things: an input that leaks into the sensor is not late, what drifts goes by
/// the clock.
const TELLING: [&str; 2] = ["crosstalk", "parameter_drift"];

/// The tie of a set that is late with the one that is late elsewhere; `None` where they are two things, or in a tie already.
pub(crate) fn same_lateness(chosen: &Member, rivals: &[Member], candidates: &[Candidate]) -> Option<Tie> {
    let (laws, other) = late_elsewhere(&chosen.fitted.hypothesis.model, &chosen.laws, candidates)?;
    let is_it =
        |rival: &Member| rival.laws.len() == other.len() && rival.laws.iter().all(|law| other.contains(law));
    if rivals.iter().any(is_it) {
        return None;
    }
    let names = |laws: &[usize]| laws.iter().map(|&law| candidates[law].name()).collect::<Vec<String>>();
    let [is, would_be] = laws.map(|law| candidates[law].name());
    let sentence = format!(
        "{is} is the same as {would_be} of that time: recordings of one output alone do not tell them apart."
    );
    Some(Tie { candidates: vec![names(&chosen.laws), names(&other)], sentence })
}

/// The law that is late with its twin, and the set with the twin in its place.
fn late_elsewhere(
    model: &Model,
    laws: &[usize],
    candidates: &[Candidate],
) -> Option<([usize; 2], Vec<usize>)> {
    let id = |law: usize| candidates[law].law.id();
    if model.setup().controller.is_some() || laws.iter().any(|&law| TELLING.contains(&id(law))) {
        return None;
    }
    // Where several outputs were recorded a sensor's law says of which it is.
    let is_late =
        |law: &usize| id(*law) == "dead_time" || (id(*law) == "delay" && candidates[*law].column.is_none());
    let mut late = laws.iter().copied().filter(is_late);
    let (is, None) = (late.next()?, late.next()) else { return None };
    let would_be = (0..candidates.len()).filter(|law| id(*law) != id(is)).find(is_late)?;
    let other = laws.iter().map(|&law| if law == is { would_be } else { law }).collect();
    Some(([is, would_be], other))
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched};

    fn late(id: &str) -> Physics {
        Physics::new(id, if id == "delay" { "sensor" } else { "drive" }).with("delay", 0.02)
    }

    #[test]
    fn a_late_drive_and_a_late_sensor_are_tied_whatever_the_fits_say() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![late("dead_time")];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0]), &noisy(&[5.0]), |search, refitted| {
            let [drive, sensor] = ["dead_time", "delay"].map(|id| fitted_with(search, &refitted, &late(id)));
            for (chosen, rival) in [(&drive, &sensor), (&sensor, &drive)] {
                let tie = same_lateness(chosen, &[], search.candidates).expect("one output was recorded");
                let names = [chosen, rival].map(|set| vec![search.candidates[set.laws[0]].name()]);
                assert_eq!(tie.candidates, names);
                let known = same_lateness(chosen, std::slice::from_ref(rival), search.candidates);
                assert_eq!(known, None, "in a tie already");
            }
            let of = |id: &str| search.candidates.iter().position(|c| c.law.id() == id).unwrap();
            let model = &drive.fitted.hypothesis.model;
            let beside = |id: &str| late_elsewhere(model, &[of(id), drive.laws[0]], search.candidates);
            assert_eq!(beside("cubic_stiffness").unwrap().1, [of("cubic_stiffness"), of("delay")]);
            assert_eq!(beside("crosstalk"), None, "what leaks into the sensor is not late");
            assert_eq!(beside("delay"), None, "both are late");
            let mut named = search.candidates.to_vec();
            named[of("delay")].column = Some("position_m".to_owned());
            assert_eq!(late_elsewhere(model, &drive.laws, &named), None, "one of several outputs");
        });
    }
}
