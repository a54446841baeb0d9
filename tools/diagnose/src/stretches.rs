//! Recordings cut where rows are missing.
//!
//! What drove the machine while nothing was recorded is not known, and a lightly damped machine remembers it:
//! a simulation across the gap is another motion. What follows a gap is therefore a recording of its own that
//! begins in motion. A free decay is driven by nothing, and a controller makes its command from what was
//! recorded of its reference: these stay whole.

use stillbeam_identify::driven_stretches;
use stillbeam_plant::Model;
use stillbeam_recording::{Recording, Role};

use crate::error::DiagnoseError;
use crate::record::Record;

/// A recording of a driven machine as records that have no rows missing, and lines that say so.
pub(crate) fn stretches(
    recording: &Recording,
    role: Role,
    model: &Model,
    (slowest_hz, fastest_hz): (Option<f64>, Option<f64>),
) -> Result<(Vec<Record>, Vec<String>), DiagnoseError> {
    let ready = |recording: &Recording| Record::new(recording, role, model, slowest_hz, fastest_hz);
    let whole = ready(recording)?;
    let input = model.input().filter(|_| !whole.rerun.is_in_loop());
    let parts = input.and_then(|input| driven_stretches(recording, &input.column)).unwrap_or_default();
    let mut records = Vec::new();
    for part in &parts {
        let begins_moving = part.time_s.first() != recording.time_s.first();
        let name = match part.time_s.first() {
            Some(start_s) if begins_moving => format!("{} from {start_s:.3} s", recording.name),
            _ => recording.name.clone(),
        };
        // One that is too short to tell anything is left out.
        if let Ok(record) = ready(&Recording { name, ..part.clone() }) {
            records.push(Record { begins_moving, ..record });
        }
    }
    if records.is_empty() {
        return Ok((vec![whole], Vec::new()));
    }
    let lines = lines(recording, &records);
    Ok((records, lines))
}

/// What is said of a recording that is read in these parts.
fn lines(recording: &Recording, parts: &[Record]) -> Vec<String> {
    let ends = |time_s: &[f64]| Some((*time_s.first()?, *time_s.last()?));
    let read: Vec<(f64, f64)> = parts.iter().filter_map(|part| ends(&part.time_s)).collect();
    let missing = read.windows(2).map(|pair| {
        format!(
            "rows are missing between {:.4} s and {:.4} s, and with them what drove the machine: what follows is \
             taken for a recording of its own that begins in motion",
            pair[0].1, pair[1].0
        )
    });
    let (Some(all), Some(first), Some(last)) = (ends(&recording.time_s), read.first(), read.last()) else {
        return Vec::new();
    };
    let too_short = "is too short, beside the rows that are missing, to tell anything: it was left out";
    let before = (all.0 < first.0).then(|| format!("what comes before {:.4} s {too_short}", first.0));
    let after = (all.1 > last.1).then(|| format!("what comes after {:.4} s {too_short}", last.1));
    let lines = missing.chain(before).chain(after);
    lines.map(|line| format!("{}: {line}", recording.name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::naming::on_a_spring::{machine, runs};

    /// A run of 20 s at 100 Hz without its rows between these times.
    fn without_rows(gaps_s: &[(f64, f64)]) -> Recording {
        let mut run = runs(&machine(), &[3.0]).remove(0);
        let is_kept = |t: f64| gaps_s.iter().all(|(from, to)| !(*from..*to).contains(&t));
        let kept: Vec<usize> = (0..run.len()).filter(|&k| is_kept(run.time_s[k])).collect();
        let of = |samples: &[f64]| kept.iter().map(|&k| samples[k]).collect::<Vec<f64>>();
        run.time_s = of(&run.time_s);
        run.columns.iter_mut().for_each(|column| column.samples = of(&column.samples));
        run
    }

    #[test]
    fn a_driven_recording_is_cut_where_rows_are_missing_and_what_is_too_short_is_said() {
        for (gaps_s, moving, said) in [
            (&[][..], &[false][..], 0),
            (&[(6.0, 6.02)], &[false], 0),
            (&[(6.0, 6.3)], &[false, true], 1),
            (&[(6.0, 6.3), (12.0, 12.4)], &[false, true, true], 2),
            // Half a second is no three periods of 1.9 Hz.
            (&[(0.5, 0.9), (12.0, 12.4)], &[true, true], 2),
            (&[(8.0, 8.4), (19.5, 19.7)], &[false, true], 2),
        ] {
            let run = without_rows(gaps_s);
            let found = stretches(&run, Role::Train, &machine(), (Some(1.9), Some(1.9))).unwrap();
            let begin: Vec<bool> = found.0.iter().map(|record| record.begins_moving).collect();
            assert_eq!((begin.as_slice(), found.1.len()), (moving, said), "{gaps_s:?}: {:?}", found.1);
        }
    }
}
