//! Stamps from counters that overflow, and rows that were written twice.

use super::assemble::Table;

/// Where counters of 16 and 32 bits begin anew, in their own unit, and where one that was divided since does.
const TURNS: [f64; 4] = [65_536.0, 4_294_967_296.0, 4_294_967.296, 4_294.967_296];
/// How many usual intervals the step over the turn may be long.
const LONGEST: f64 = 3.0;
/// Share of rows that may be repeated; of more, the stamps are coarse.
const FEW: f64 = 0.2;

/// Stamps that go on where their counter began anew; and how often it did.
pub(super) fn unwrapped(stamps: &[f64]) -> Option<(Vec<f64>, usize)> {
    let mut steps: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let falls: Vec<[f64; 2]> =
        stamps.windows(2).filter(|pair| pair[1] < pair[0]).map(|pair| [pair[0], pair[1]]).collect();
    if falls.is_empty() || steps.len() < 8 {
        return None;
    }
    let middle = steps.len() / 2;
    let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    // A clock that was set back falls from anywhere, a counter from the turn to zero.
    let turn = TURNS.into_iter().find(|turn| {
        falls.iter().all(|[before, after]| {
            *before < *turn && *after >= 0.0 && (0.0..=LONGEST * usual).contains(&(after + turn - before))
        })
    })?;
    let mut turns = 0;
    let mut last = f64::NEG_INFINITY;
    let go_on = |stamp: &f64| {
        turns += usize::from(*stamp < last);
        last = *stamp;
        stamp + turns as f64 * turn
    };
    let stamps = stamps.iter().map(go_on).collect();
    Some((stamps, turns))
}

/// Leaves out rows that repeat the one before in every column, the time among them.
///
/// Rows of one stamp that differ are samples whose stamps are too coarse: then nothing is left out.
pub(super) fn drop_repeated_rows(table: &mut Table, time: usize) {
    let Some(stamps) = table.columns.get(time) else { return };
    let again: Vec<usize> = (1..stamps.len()).filter(|row| stamps.get(*row) == stamps.get(row - 1)).collect();
    let same = |a: Option<&f64>, b: Option<&f64>| {
        a == b || a.is_some_and(|a| a.is_nan()) && b.is_some_and(|b| b.is_nan())
    };
    let repeats =
        |row: &usize| table.columns.iter().all(|column| same(column.get(*row), column.get(row - 1)));
    if again.is_empty() || again.len() as f64 > FEW * stamps.len() as f64 || !again.iter().all(repeats) {
        return;
    }
    let mut kept = vec![true; stamps.len()];
    again.iter().for_each(|row| kept.iter_mut().skip(*row).take(1).for_each(|kept| *kept = false));
    for column in &mut table.columns {
        let mut kept = kept.iter();
        column.retain(|_| kept.next().copied().unwrap_or(true));
    }
    let mut kept = kept.iter();
    table.lines.retain(|_| kept.next().copied().unwrap_or(true));
    table
        .remarks
        .push(format!("{} rows repeat the one before, its time stamp too, and were left out", again.len()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_go_on_over_their_turn_and_clocks_that_were_set_back_do_not() {
        for (turn, step) in
            [(65_536.0, 400.0), (4_294_967_296.0, 5000.0), (4_294_967.296, 2.5), (4_294.967_296, 0.001)]
        {
            let counted: Vec<f64> =
                (0..2000).map(|k| (turn - 100.0 * step + f64::from(k) * step).rem_euclid(turn)).collect();
            let (stamps, turns) = unwrapped(&counted).unwrap();
            assert!(
                turns > 0
                    && stamps.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() < 1e-6 * turn.min(1e4)),
                "{turn}"
            );
            for back in [1.5 * step, 0.3 * turn, turn + 5.0 * step] {
                let set: Vec<f64> =
                    (0..2000).map(|k| f64::from(k) * step - if k < 900 { 0.0 } else { back }).collect();
                assert!(unwrapped(&set).is_none(), "{turn} {back}");
            }
        }
        let even: Vec<f64> = (0..2000).map(f64::from).collect();
        assert!(unwrapped(&even).is_none());
    }
}
