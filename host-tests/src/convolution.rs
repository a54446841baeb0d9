//! What the setpoint has to be for a counted input, from the definitions: gearing, mean, and one sum of
//! products per stage and tick.

use stillbeam_firmware::shaper::ShaperTable;

/// The positions after each of these numbers of counts, in nanometres from where they began, by a gearing of
/// nanometres for counts.
pub fn positions_nm(counts: &[i32], (gear_nm, gear_counts): (i32, u32)) -> Vec<i64> {
    let mut counted = 0_i128;
    counts
        .iter()
        .map(|&counts| {
            counted += i128::from(counts);
            (counted * i128::from(gear_nm)).div_euclid(i128::from(gear_counts)) as i64
        })
        .collect()
}

/// The command: the mean of the last 2^`bits` positions from `origin_nm` on, where it has been for ever, to
/// the nearest nanometre.
pub fn averaged_nm(positions_nm: &[i64], bits: u32, origin_nm: i32) -> Vec<i32> {
    let ticks = 1_i64 << bits;
    (0..positions_nm.len())
        .map(|newest| {
            let sum: i64 = (0..1_usize << bits)
                .map(|back| newest.checked_sub(back).map_or(0, |tick| positions_nm[tick]))
                .sum();
            origin_nm + (2 * sum + ticks).div_euclid(2 * ticks) as i32
        })
        .collect()
}

/// The setpoint: the command through one stage after the other, each rounded to the nearest nanometre from
/// `origin_nm`, where the command has been for ever.
pub fn shaped_nm(command_nm: &[i32], table: &ShaperTable, origin_nm: i32) -> Vec<i32> {
    let mut samples: Vec<i64> = command_nm.iter().map(|nm| i64::from(nm - origin_nm)).collect();
    for stage in table.stages() {
        samples = (0..samples.len())
            .map(|newest| {
                let sum: i64 = stage
                    .taps()
                    .iter()
                    .filter_map(|tap| {
                        let sample = samples[newest.checked_sub(tap.delay_ticks as usize)?];
                        Some(i64::from(tap.weight) * sample)
                    })
                    .sum();
                (sum + (1 << 29)) >> 30
            })
            .collect();
    }
    samples.into_iter().map(|nm| origin_nm + nm as i32).collect()
}
