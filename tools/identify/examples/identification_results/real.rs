//! Real recordings, where they are present.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::PathBuf;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedMode, IdentifiedModes, IdentifyError, InputKind,
    OutputQuantity, Rejected, identify_forced, identify_forced_together, identify_free_decay,
};
use stillbeam_recording::{ReadOptions, Recording, read_recording};

/// The folder of recordings beside the workspace, or wherever `STILLBEAM_DATA` says.
fn data() -> PathBuf {
    match std::env::var_os("STILLBEAM_DATA") {
        Some(folder) => folder.into(),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
    }
}

pub fn read(file: &str) -> Result<Option<Recording>, IdentifyError> {
    let path = data().join(file);
    if !path.is_file() {
        return Ok(None);
    }
    Ok(Some(read_recording(&path, &ReadOptions::default())?.recording))
}

const ABSENT: &str = "Not made: the recording was not there.\n";

fn table_of_points(mode: &IdentifiedMode) -> String {
    let mut text =
        "\n| amplitude | from | to | frequency (Hz) | damping ratio |\n|---|---|---|---|---|\n".to_owned();
    for point in &mode.by_amplitude {
        let [from_s, to_s] = point.window_s;
        let _written = writeln!(
            text,
            "| {:.2e} | {from_s:.1} s | {to_s:.1} s | {:.4} ± {:.4} | {:.5} ± {:.5} |",
            point.amplitude,
            point.frequency_hz.value,
            point.frequency_hz.stderr,
            point.damping_ratio.value,
            point.damping_ratio.stderr
        );
    }
    text
}

/// A steel cantilever, knocked once.
pub fn cantilever() -> Result<String, IdentifyError> {
    let mut text = "## A real steel cantilever, knocked once

Downey lab, CC BY-SA 4.0: 81 920 samples at 1652 Hz. Published: 6.62, 41.4 and 117 Hz; the damping of mode 1 rises from 0.34 % to 1.0 % as it decays.

".to_owned();
    let Some(record) = read("cantilever_downey/beam_impulse_ringdown.csv")? else {
        return Ok(text + ABSENT);
    };
    let found = identify_free_decay(&record, &FreeDecayOptions::new("acceleration_g"))?;
    text += "| mode | frequency (Hz) | damping ratio, whole record |\n|---|---|---|\n";
    for (number, mode) in (1..).zip(&found.modes) {
        let _written = writeln!(
            text,
            "| {number} | {:.3} ± {:.3} | {:.5} ± {:.5} |",
            mode.frequency_hz.value,
            mode.frequency_hz.stderr,
            mode.damping_ratio.value,
            mode.damping_ratio.stderr
        );
    }
    let _written = writeln!(text, "\n{}\n\nMode 1 by amplitude (g):", found.linearity.statement);
    text += &table_of_points(&found.modes[0]);
    Ok(text)
}

/// Plucked belts and shaken printers.
pub fn belts() -> Result<String, IdentifyError> {
    let mut text = "## A belt printer's accelerometer

Klipper logs of a Voron 2.4 (MIT). Plucks, along y, of belts tuned to about 110 Hz (`belt_b_1`: of an older, lower tension; `belt_A_test` is four plucks, the last one is read): the finger's
impact rings the gantry above 600 Hz for some 50 ms, up to a hundred times louder than the belt, which is heard alone afterwards. The fit starts where modes explain all but noise. Shakes, along x: the steppers drive
a line at 341 to 353 Hz and its double; no mode. In brackets the share of the decay's energy and the damping ratio. The spectrum's peak is that of 0.3 s from the same moment, windowed (Hann), between 80 and
140 Hz: it knows nothing of modes, and 0.3 s tell lines apart that are 7 Hz from each other.

| file | read from (after the peak) | modes | spectrum's peak | said of lines |
|---|---|---|---|---|
".to_owned();
    let plucks =
        ["belt_A_1", "belt_A_2", "belt_A_test", "belt_B_1", "belt_B_2", "belt_b_1", "calibration_A_1"];
    let shakes = ["shake_a_oscillation", "shake_a_quick", "shake_b_oscillation"];
    for (name, is_pluck) in
        plucks.map(|name| (name, true)).into_iter().chain(shakes.map(|name| (name, false)))
    {
        let Some(record) = read(&format!("klipper_raw_belt_printer/adxl345-{name}.csv"))? else {
            return Ok(text + "\n" + ABSENT);
        };
        let column = if is_pluck { "acceleration_y_mm_s2" } else { "acceleration_x_mm_s2" };
        let [from, found, peak, lines] = in_words(&record, column)?;
        let _written = writeln!(text, "| {name} | {from} | {found} | {peak} | {lines} |");
    }
    Ok(text)
}

/// Where the fit begins, the modes, the peak of the spectrum from there on, and the lines that are no modes.
fn in_words(record: &Recording, column: &str) -> Result<[String; 4], IdentifyError> {
    let nothing = || ["–".to_owned(), "no mode".to_owned(), "–".to_owned()];
    match identify_free_decay(record, &FreeDecayOptions::new(column)) {
        Ok(found) => {
            let after_ms = 1e3 * (found.window_s[0] - peak_s(record, column)?);
            let peak_hz = spectral_peak_hz(record, record.column(column)?, found.window_s[0]);
            let after = format!("{after_ms:.0} ms");
            Ok([after, modes_in_words(&found), format!("{peak_hz:.1} Hz"), tones_in_words(&found)])
        }
        Err(IdentifyError::OnlyTones { tones, .. }) => {
            let each = tones.iter().map(|(hz, reason)| format!("{hz:.1} Hz is a forced tone: {reason}"));
            let [from, modes, peak] = nothing();
            Ok([from, modes, peak, each.collect::<Vec<_>>().join("; ")])
        }
        Err(IdentifyError::NoPeaks { .. } | IdentifyError::TooFewPeaks { .. }) => {
            let [from, modes, peak] = nothing();
            Ok([from, modes, peak, String::new()])
        }
        Err(error) => Err(error),
    }
}

/// Time of the largest deflection, s.
fn peak_s(record: &Recording, column: &str) -> Result<f64, IdentifyError> {
    let samples = record.column(column)?;
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let away = |k: &usize| (samples[*k] - mean).abs();
    let peak = (0..samples.len()).max_by(|a, b| away(a).total_cmp(&away(b)));
    Ok(peak.map_or(0.0, |k| record.time_s[k]))
}

/// Strongest frequency between 80 and 140 Hz in 0.3 s of samples from `from_s` on, Hann window, in steps of
/// 0.05 Hz.
fn spectral_peak_hz(record: &Recording, samples: &[f64], from_s: f64) -> f64 {
    const LENGTH_S: f64 = 0.3;
    let part: Vec<(f64, f64)> = (record.time_s.iter().zip(samples))
        .map(|(t, y)| (t - from_s, *y))
        .filter(|(t, _)| (0.0..LENGTH_S).contains(t))
        .collect();
    let mean = part.iter().map(|(_, y)| y).sum::<f64>() / part.len() as f64;
    let power = |hz: f64| {
        let mut sum = [0.0; 2];
        for (t, y) in &part {
            let windowed = (PI * t / LENGTH_S).sin().powi(2) * (y - mean);
            let (sin, cos) = (TAU * hz * t).sin_cos();
            sum = [sum[0] + windowed * cos, sum[1] + windowed * sin];
        }
        sum[0] * sum[0] + sum[1] * sum[1]
    };
    let grid = (0..=1200).map(|k| 80.0 + 0.05 * f64::from(k));
    let strongest = grid.map(|hz| (hz, power(hz))).max_by(|a, b| a.1.total_cmp(&b.1));
    strongest.map_or(f64::NAN, |(hz, _)| hz)
}

fn modes_in_words(found: &IdentifiedModes) -> String {
    let all: f64 = found.modes.iter().map(IdentifiedMode::energy).sum();
    let mut modes: Vec<&IdentifiedMode> = found.modes.iter().collect();
    modes.sort_by(|a, b| b.energy().total_cmp(&a.energy()));
    let each = modes.iter().map(|mode| {
        format!(
            "{:.1} ± {:.1} Hz ({:.0} %, {:.4} ± {:.4})",
            mode.frequency_hz.value,
            mode.frequency_hz.stderr,
            100.0 * mode.energy() / all,
            mode.damping_ratio.value,
            mode.damping_ratio.stderr
        )
    });
    each.collect::<Vec<_>>().join(", ")
}

fn tones_in_words(found: &IdentifiedModes) -> String {
    let each = found.rejected.iter().filter_map(|entry| match entry {
        Rejected::Pole { frequency_hz, reason, .. } if reason.starts_with("a forced tone") => {
            Some(format!("{frequency_hz:.1} Hz is {reason}"))
        }
        _ => None,
    });
    each.collect::<Vec<_>>().join("; ")
}

/// Samples of the growing sweep, and of each multisine, in the circuit's recording.
const ARROW_END: usize = 40_600;
const MULTISINE: usize = 8192;

/// An electronic oscillator with a hardening spring.
pub fn circuit() -> Result<String, IdentifyError> {
    let mut text = "## A real electronic oscillator with a hardening spring

Silverbox (Wigren and Schoukens 2013): random-phase multisines of one level, and a record in which the level grows. Expected of the multisines: 68 to 70 Hz, damping ratio about
0.049, and that the plant is not linear.

".to_owned();
    let Some(record) = read("silverbox/silverbox_SNLS80mV.csv")? else {
        return Ok(text + ABSENT);
    };
    let options = ForcedOptions {
        input_kind: Some(InputKind::Force),
        output_quantity: Some(OutputQuantity::Position),
        ..ForcedOptions::new("input_force_V", "output_displacement_V").with_modes(1)
    };
    let multisines: Vec<Recording> = (0..3)
        .map(|k| {
            let start = 41_000 + k * MULTISINE;
            part(&record, start..start + MULTISINE, &format!("multisine {}", k + 1))
        })
        .collect();
    text += "| part | frequency (Hz) | damping ratio | rms left (V) |\n|---|---|---|---|\n";
    for one in &multisines {
        row(&mut text, &identify_forced(one, &options)?);
    }
    let all: Vec<&Recording> = multisines.iter().collect();
    let together = identify_forced_together(&all, &options)?;
    row(&mut text, &together);
    let arrow = identify_forced(&part(&record, 0..ARROW_END, "growing level"), &options)?;
    row(&mut text, &arrow);
    let _written = writeln!(text, "\nThe multisines together: {}", together.linearity.statement);
    for warning in together.warnings.iter().take(3) {
        let _written = writeln!(text, "- {}", warning.message);
    }
    let _written = writeln!(text, "\nThe growing level: {}", arrow.linearity.statement);
    text += &table_of_points(&arrow.modes[0]);
    Ok(text)
}

fn part(record: &Recording, rows: std::ops::Range<usize>, name: &str) -> Recording {
    let time_s = record.time_s.get(rows.clone()).unwrap_or_default().to_vec();
    record.columns.iter().fold(Recording::new(name, time_s), |part, column| {
        part.with_column(column.name.clone(), column.samples.get(rows.clone()).unwrap_or_default().to_vec())
    })
}

fn row(text: &mut String, found: &IdentifiedModes) {
    for mode in &found.modes {
        let _written = writeln!(
            text,
            "| {} | {:.2} ± {:.2} | {:.4} ± {:.4} | {:.2e} |",
            found.recording,
            mode.frequency_hz.value,
            mode.frequency_hz.stderr,
            mode.damping_ratio.value,
            mode.damping_ratio.stderr,
            found.residual_rms
        );
    }
}
