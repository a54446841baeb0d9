//! What a recorder does wrong without saying so: frames lost under even stamps, and modes beyond half its
//! rate.

use crate::synthetic;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, LinearityVerdict, WarningKind, identify_forced,
    identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, Sweep, clean_sweep, noisy};

fn beam() -> [Mode; 2] {
    [
        Mode { frequency_hz: 1.1, damping_ratio: 0.0071, participation: 1.566 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 },
    ]
}

fn lost(found: &IdentifiedModes) -> Vec<(i64, f64)> {
    let told = found.warnings.iter().filter_map(|warning| match warning.kind {
        WarningKind::LostFrames { count, at_s, .. } => Some((count, at_s)),
        _ => None,
    });
    told.collect()
}

#[test]
fn frames_lost_by_the_camera_of_a_sweep_are_counted_and_placed() {
    // As the command line does: a delay may be found.
    let options = ForcedOptions {
        max_delay_s: 0.05,
        ..ForcedOptions::new("base_position_m", "tip_deflection_m").with_modes(2)
    };
    let (time_s, clean) = clean_sweep(Sweep::Linear, &beam(), 1);
    for seed in 0..3 {
        let whole = identify_forced(&noisy(Sweep::Linear, &time_s, &clean, 50e-6, seed), &options).unwrap();
        assert!(lost(&whole).is_empty(), "{:?}", whole.warnings);
        for (count, at) in [(1, 4000), (2, 5500)] {
            // The camera's samples move up; its stamps, written by counting, do not show it.
            let early: Vec<f64> = (0..clean.len())
                .map(|k| clean[if k < at { k } else { (k + count).min(clean.len() - 1) }])
                .collect();
            let found =
                identify_forced(&noisy(Sweep::Linear, &time_s, &early, 50e-6, seed), &options).unwrap();
            let told = lost(&found);
            assert!(
                told.iter().any(|(n, at_s)| *n == count as i64 && (at_s - 0.01 * at as f64).abs() < 1.0),
                "{count} lost at {}: {told:?}",
                0.01 * at as f64
            );
        }
    }
}

/// Nobody says how many modes there are: what lost frames leave is no further mode and no law of the
/// structure.
#[test]
fn lost_frames_are_no_mode_and_no_structure_that_is_not_linear() {
    let options = ForcedOptions {
        max_delay_s: 0.05,
        cross_checks: false,
        ..ForcedOptions::new("base_position_m", "tip_deflection_m")
    };
    for (sweep, count, at) in [
        (Sweep::Linear, 1, 4000),
        (Sweep::Linear, 2, 5500),
        (Sweep::Exponential, 1, 5000),
        (Sweep::Linear, 3, 3000),
    ] {
        let (time_s, clean) = clean_sweep(sweep, &beam(), 1);
        let early: Vec<f64> = (0..clean.len())
            .map(|k| clean[if k < at { k } else { (k + count).min(clean.len() - 1) }])
            .collect();
        let found = identify_forced(&noisy(sweep, &time_s, &early, 50e-6, count as u64), &options).unwrap();
        assert_eq!(found.modes.len(), 2, "{count} {at}: {:?}", found.modes);
        assert_eq!(found.linearity.verdict, LinearityVerdict::NotTested, "{:?}", found.linearity);
        assert!(lost(&found).iter().any(|(n, _)| *n == count as i64), "{count} {at}: {:?}", found.warnings);
    }
}

/// A decay sampled at 100 Hz, evenly or with stamps that scatter by a fifth of the interval.
fn decay(frequency_hz: f64, scatter_s: f64, seed: u64) -> Recording {
    let mut noise = Noise(seed);
    let time_s: Vec<f64> = (0..3000)
        .map(|k| 0.01 * f64::from(k) + scatter_s * (noise.normal() / 3.0).clamp(-0.9, 0.9))
        .collect();
    let omega = std::f64::consts::TAU * frequency_hz;
    let values =
        time_s.iter().map(|t| 5e-3 * (-0.4 * t).exp() * (omega * t).cos() + 20e-6 * noise.normal()).collect();
    Recording::new("decay", time_s).with_column("tip_deflection_m", values)
}

fn aliased(found: &IdentifiedModes) -> Vec<bool> {
    let told = found.warnings.iter().filter_map(|warning| match warning.kind {
        WarningKind::MayBeAliased { likelier, .. } => Some(likelier),
        _ => None,
    });
    told.collect()
}

#[test]
fn even_stamps_leave_an_image_possible_and_uneven_ones_exclude_it_or_show_it() {
    let options = FreeDecayOptions::new("tip_deflection_m").with_modes(1);
    for seed in 0..4 {
        let even = identify_free_decay(&decay(44.0, 0.0, seed), &options).unwrap();
        assert_eq!(aliased(&even), [false], "{:?}", even.warnings);
        let uneven = identify_free_decay(&decay(44.0, 0.002, seed), &options).unwrap();
        assert!(aliased(&uneven).is_empty(), "{:?}", uneven.warnings);
        // 58 Hz looks like 42 Hz, but only to even stamps.
        let image = identify_free_decay(&decay(58.0, 0.002, seed), &options).unwrap();
        assert_eq!(aliased(&image), [true], "{:?} {:?}", image.modes, image.warnings);
        // Rounded stamps of an even recorder tell no more than the even ones.
        let mut rounded = decay(44.0, 0.0, seed);
        rounded.time_s.iter_mut().for_each(|t| *t = (*t / 1.003 * 1e4).round() / 1e4);
        let rounded = identify_free_decay(&rounded, &options).unwrap();
        assert_eq!(aliased(&rounded), [false], "{:?}", rounded.warnings);
        // Far below half the rate nothing is said.
        let low = identify_free_decay(&decay(6.9, 0.0, seed), &options).unwrap();
        assert!(aliased(&low).is_empty(), "{:?}", low.warnings);
    }
}
