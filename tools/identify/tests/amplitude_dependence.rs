//! Records with an input of machines one of whose modes goes with its amplitude: one mode each, and "not
//! linear" said, never of a machine that is linear. `STILLBEAM_SEEDS` sets how many machines each cell of the
//! grid gets; with `STILLBEAM_EACH` every wrong one gets a line.

use crate::synthetic;

use stillbeam_identify::{ForcedOptions, IdentifiedMode, IdentifiedModes, LinearityVerdict, identify_forced};
use stillbeam_recording::Recording;
use synthetic::amplitude::{CHANGES, Case, Change, DRIVES, Drive, Machine};

const RATIOS: [f64; 3] = [1.35, 2.7, 6.3];

fn seeds(usual: u64) -> u64 {
    std::env::var("STILLBEAM_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

fn identified(recording: &Recording, input: &str) -> IdentifiedModes {
    let options = ForcedOptions {
        cross_checks: false,
        max_delay_s: 0.05,
        ..ForcedOptions::new(input, "tip_deflection_m")
    };
    identify_forced(recording, &options).unwrap()
}

/// Records with the right modes, records called not linear, or not constant, and all.
#[derive(Default, Debug, Clone, Copy)]
struct Tally {
    right: usize,
    not_linear: usize,
    /// Records of which a mode was said to go with its amplitude.
    with_amplitude: usize,
    /// Records called not constant in time.
    not_constant: usize,
    all: usize,
}

impl Tally {
    fn take(&mut self, machine: &Machine) {
        let case = machine.case();
        let begin = std::time::Instant::now();
        let found = identified(&case.recording, "force_N");
        let not_linear = found.linearity.verdict == LinearityVerdict::NotLinear;
        let right = is_right(&case, &found);
        self.all += 1;
        self.right += usize::from(right);
        self.not_linear += usize::from(not_linear);
        let changes = |mode: &IdentifiedMode| !mode.amplitude_changes.is_empty();
        self.with_amplitude += usize::from(found.modes.iter().any(changes));
        self.not_constant += usize::from(found.linearity.verdict == LinearityVerdict::NotConstant);
        if std::env::var_os("STILLBEAM_EACH").is_some()
            && (!right || not_linear != (machine.change_pct > 0.0) || changes_in_time(machine))
        {
            let modes: Vec<String> = found
                .modes
                .iter()
                .map(|m| format!("{:.4}/{:.4}", m.frequency_hz.value, m.damping_ratio.value))
                .collect();
            eprintln!(
                "{machine:?}\n  truth {:?} {:?}\n  {modes:?} {} ({:.1} s)",
                case.frequencies_hz,
                case.damping_ratios,
                found.linearity.statement,
                begin.elapsed().as_secs_f64()
            );
        }
    }
}

/// One mode each; that which goes with its amplitude by any frequency that it has.
fn is_right(case: &Case, found: &IdentifiedModes) -> bool {
    let [low, high] = case.first_hz;
    let ranges = [[low, high], [case.frequencies_hz[1]; 2]];
    let is = |mode: usize, [low, high]: [f64; 2]| {
        (low * 0.997..=high * 1.003).contains(&found.modes[mode].frequency_hz.value)
    };
    found.modes.len() == 2 && (0..2).all(|mode| is(mode, ranges[mode]))
}

fn grid(change_pct: f64, changes: &[Change], drives: &[Drive], noises_pct: &[f64], seeds: u64) -> Tally {
    let mut all = Tally::default();
    for (&noise_pct, number) in noises_pct.iter().zip(0_u64..) {
        for &change in changes {
            for &drive in drives {
                let mut tally = Tally::default();
                for seed in 0..seeds {
                    let ratio = RATIOS[(seed as usize + drive as usize) % RATIOS.len()];
                    let seed = 100 * seed + 10 * number + drive as u64;
                    tally.take(&Machine { drive, change, change_pct, noise_pct, ratio, seed });
                }
                println!("{change_pct} %, noise {noise_pct} %, {change:?}, {drive:?}: {tally:?}");
                all.all += tally.all;
                all.right += tally.right;
                all.not_linear += tally.not_linear;
                all.with_amplitude += tally.with_amplitude;
                all.not_constant += tally.not_constant;
            }
        }
    }
    println!("{change_pct} %: {all:?}");
    all
}

fn changes_in_time(machine: &Machine) -> bool {
    machine.change == Change::Jumps
}

#[test]
fn a_linear_machine_has_its_modes_and_is_never_called_not_linear() {
    let all = grid(0.0, &[Change::Softens], &DRIVES, &[0.0, 0.3, 2.0, 10.0], seeds(1));
    assert_eq!((all.not_linear, all.not_constant), (0, 0), "{all:?}");
    assert_eq!(all.right, all.all, "{all:?}");
}

/// A few samples show each blow, and what is wrong between them changes from blow to blow.
#[test]
fn a_linear_machine_that_is_struck_is_not_said_to_change_with_amplitude_or_time() {
    let all = grid(0.0, &[Change::Softens], &[Drive::Blows], &[0.0, 0.3, 2.0, 10.0], seeds(2));
    assert_eq!((all.with_amplitude, all.not_constant), (0, 0), "{all:?}");
}

#[test]
fn a_mode_that_goes_with_its_amplitude_is_one_and_told() {
    for (change_pct, noises_pct) in [(3.0, [0.0]), (10.0, [0.3])] {
        let all = grid(change_pct, &CHANGES, &DRIVES, &noises_pct, seeds(1));
        assert!(all.right * 10 >= all.all * 9, "{all:?}");
        assert!(all.not_linear * 10 >= all.all * 9, "{all:?}");
    }
}

#[test]
fn a_change_of_a_hundredth_makes_no_second_mode() {
    let all = grid(1.0, &CHANGES, &DRIVES, &[2.0], seeds(1));
    assert!(all.right * 10 >= all.all * 9, "{all:?}");
}

/// Who passes a resonance once sees its amplitude and its time change together. A sweep may have passed it
/// before it jumps, and then shows nothing.
#[test]
fn a_mode_that_jumps_at_a_moment_is_not_said_to_go_with_its_amplitude() {
    let all = grid(2.0, &[Change::Jumps], &DRIVES, &[1.0], seeds(2));
    assert_eq!(all.with_amplitude, 0, "{all:?}");
    assert!(all.not_constant * 10 >= all.all * 7, "{all:?}");
}
