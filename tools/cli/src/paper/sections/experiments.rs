//! The paper's own tables and figures.

use super::{Figure, Section, Table, holds, interval};
use crate::paper::PaperResult;
use crate::paper::decrement::{DRAWS, DecrementRow};
use crate::paper::force_sweeps::AMPLITUDE_N;
use crate::paper::move_search::EXPLAINING_MOVE;
use crate::paper::responses::COMPARED_S;
use crate::paper::spectrum::PickedPeak;
use crate::paper::sweeps::{AMPLITUDE_MM, SweepResult};

pub(super) fn table_1(result: &PaperResult) -> Section {
    let truths: Vec<(f64, f64)> =
        result.true_modes.iter().map(|mode| (mode.frequency_hz, mode.damping_ratio)).collect();
    let mut rows = Vec::new();
    let (mut inside, mut all) = (0, 0);
    let mut worst_fitted = 0.0_f64;
    let (mut worst_picked, mut worst_exponential) = ((1.0_f64, 1.0_f64), (1.0_f64, 1.0_f64));
    for (mode, (true_hz, true_damping)) in truths.iter().enumerate() {
        for sweep in &result.sweeps {
            if let Some(found) = sweep.identified.modes.get(mode) {
                inside += usize::from(holds(&found.frequency_hz, *true_hz));
                inside += usize::from(holds(&found.damping_ratio, *true_damping));
                all += 2;
                worst_fitted = worst_fitted.max((found.damping_ratio.value / true_damping - 1.0).abs());
            }
            let picked = sweep.picked.get(mode).copied().flatten().and_then(|peak| peak.damping_ratio);
            let exponential = sweep.complex_exponential.get(mode).copied().flatten().map(|(_, ratio)| ratio);
            for (worst, found) in [(&mut worst_picked, picked), (&mut worst_exponential, exponential)] {
                let times = found.map_or(1.0, |ratio| ratio / true_damping);
                *worst = (worst.0.min(times), worst.1.max(times));
            }
            rows.push(table_1_row(sweep, mode));
        }
        rows.push(vec![
            format!("truth, mode {}", mode + 1),
            String::new(),
            String::new(),
            format!("{true_hz:.6}"),
            String::new(),
            String::new(),
            String::new(),
            format!("{true_damping:.4}"),
            String::new(),
            String::new(),
        ]);
    }
    Section {
        title: "Table 1 and Fig. 4: modes from four sweeps".to_owned(),
        text: vec![format!(
            "From 0.1 to 8 Hz, or down, with {AMPLITUDE_MM} mm of the base, recorded for as long as the sweep lasts and no longer: eq. 33 makes the linear \
             one 7.9 s long, less than half the 19.5 s in which the first mode decays by e. \"Ours\" is the output-error fit of the whole record \
             (tools/identify) with 95 % intervals; \
             \"LSCE\" is what the paper describes: one Hamming-windowed transform of the record (Fig. 4), and the least-squares complex exponential method on it, whose stable pole is \
             given (tools/identify/src/poles; none: no pole is stable over the model orders). \"Peak\" is the mode read off the same spectrum: highest bin, and half the width at 1/√2 of the height."
        )],
        table: Some(Table::new(
            [
                "sweep, mode",
                "length (s)",
                "Hz, paper",
                "Hz, ours ± 95 %",
                "Hz, LSCE",
                "Hz, peak",
                "damping, paper",
                "damping, ours ± 95 %",
                "damping, LSCE",
                "damping, peak",
            ],
            rows,
        )),
        notes: vec![
            format!(
                "{inside} of {all} intervals hold the truth (95 % of them should in the long run; tools/identify/tests/coverage.rs counts over many records)."
            ),
            format!(
                "The paper blames the linear sweep's 1.0063 Hz and 0.0011 on the method of sweeping. The record is the trouble: it is so short that a bin is 0.127 Hz \
             wide, and its window, not the mode, makes the width of every peak. Fitted in the time domain the same 7.9 s give the first frequency to a ten-thousandth \
             and its damping to one per cent. In the other rows the spectrum \
                 finds the first frequency to 0.3 %, as the paper did, and the second to 1.2 % or not at all; its dampings say how long the record was and how fast the sweep passed, and scatter as much as the paper's. Worst damping in this table: {:.1} to {:.1} times the truth by LSCE, {:.1} to {:.1} times by the peaks, \
                 {:.1} % off by the fit.",
                worst_exponential.0,
                worst_exponential.1,
                worst_picked.0,
                worst_picked.1,
                100.0 * worst_fitted
            ),
        ],
        figure: Some(Figure::Spectra),
    }
}

fn table_1_row(sweep: &SweepResult, mode: usize) -> Vec<String> {
    let printed = &sweep.printed;
    let found = sweep.identified.modes.get(mode);
    let picked = sweep.picked.get(mode).copied().flatten();
    let exponential = sweep.complex_exponential.get(mode).copied().flatten();
    let missing = || "–".to_owned();
    let none = || "none".to_owned();
    vec![
        format!("{}, mode {}", printed.name(), mode + 1),
        format!("{:.1}", printed.duration_s()),
        format!("{:.4}", printed.frequency_hz[mode]),
        found.map_or_else(missing, |found| interval(&found.frequency_hz)),
        exponential.map_or_else(none, |(hz, _)| format!("{hz:.4}")),
        picked.map_or_else(missing, |PickedPeak { frequency_hz, .. }| format!("{frequency_hz:.3}")),
        format!("{:.4}", printed.damping_ratio[mode]),
        found.map_or_else(missing, |found| interval(&found.damping_ratio)),
        exponential.map_or_else(none, |(_, ratio)| format!("{ratio:.4}")),
        picked.and_then(|peak| peak.damping_ratio).map_or_else(missing, |ratio| format!("{ratio:.4}")),
    ]
}

pub(super) fn force(result: &PaperResult) -> Section {
    let truth = |mode: usize| result.free_modes.get(mode).copied().unwrap_or((f64::NAN, f64::NAN));
    let mut rows: Vec<Vec<String>> = result
        .force_sweeps
        .iter()
        .map(|sweep| {
            let mut row = vec![sweep.printed.name()];
            for mode in &sweep.identified.modes {
                row.extend([interval(&mode.frequency_hz), interval(&mode.damping_ratio)]);
            }
            row
        })
        .collect();
    let mut last = vec!["truth, base free".to_owned()];
    for mode in 0..2 {
        let (hz, ratio) = truth(mode);
        last.extend([format!("{hz:.5}"), format!("{ratio:.5}")]);
    }
    rows.push(last);
    let held = result.true_modes.first().map_or(f64::NAN, |mode| mode.frequency_hz);
    Section {
        title: "The same sweeps as a force on a free base".to_owned(),
        text: vec![format!(
            "The paper calls its input \"the excitation force\". A force of {AMPLITUDE_N} N on a base that nothing holds drives base and beam together, eq. 12, and finds the \
             coupled modes. They are not what rings after a move: then the servo holds the base."
        )],
        table: Some(Table::new(
            ["sweep of the force", "mode 1 (Hz)", "damping", "mode 2 (Hz)", "damping"],
            rows,
        )),
        notes: vec![format!(
            "A shaper for {:.3} Hz on a beam that rings at {held:.3} Hz is {:.1} % off: ZV then leaves {:.1} %. So either the paper's base followed its motor stiffly during the \
             sweeps, or its shapers were designed for a frequency that its beam did not have. That its sweeps agree with each other to 0.4 % does not tell.",
            truth(0).0,
            100.0 * (truth(0).0 / held - 1.0),
            100.0 * (std::f64::consts::FRAC_PI_2 * held / truth(0).0).cos().abs(),
        )],
        figure: None,
    }
}

pub(super) fn decrement(result: &PaperResult) -> Section {
    let decrement = &result.decrement;
    let cells = |row: &DecrementRow| {
        [format!("{:.4} ± {:.4}", row.mean, row.deviation), format!("{:.4}", row.as_printed)]
    };
    let rows = decrement.first_alone.iter().zip(&decrement.both_modes).map(|(alone, both)| {
        let [alone_right, alone_printed] = cells(alone);
        let [both_right, both_printed] = cells(both);
        vec![alone.peaks.to_string(), alone_right, alone_printed, both_right, both_printed]
    });
    let fitted: Vec<String> = decrement.fitted.iter().map(interval).collect();
    Section {
        title: "The logarithmic decrement".to_owned(),
        text: vec![format!(
            "The tip after the unshaped move, from the highest frame of every period of the first mode, over {DRAWS} draws of the camera's noise: mean ± standard deviation. \
             True: 0.0074, which the paper printed."
        )],
        table: Some(Table::new(
            [
                "peaks",
                "first mode alone",
                "eq. 29 as printed",
                "both modes, as seen",
                "eq. 29 as printed",
            ],
            rows.collect(),
        )),
        notes: vec![
            "Eq. 29 as printed divides by the number of peaks instead of periods, and with two peaks halves the result. That the paper's 0.0074 agrees with its \
             sweeps (0.0059 to 0.0083) suggests that it counted right."
                .to_owned(),
            format!(
                "The first two peaks are the wrong ones all the same: one period apart the first mode falls by 4.5 %, while the second mode stands in another phase and moves \
                 the peaks by as much. On this beam after this move the two peaks are off by far more than the noise, and even thirty periods do not get rid of it. (That eq. 29 as printed brings the two peaks back to about 0.0074 is chance: after a move of \
                 0.200 s it is 0.0081.) Fitting both modes to the \
                 decay gives {}.",
                fitted.join(" and ")
            ),
        ],
        figure: Some(Figure::FreeVibration),
    }
}

pub(super) fn responses(result: &PaperResult) -> Section {
    let rows = result.responses.iter().map(|response| {
        let [f1, f2] = response.frequency_hz;
        let [z1, z2] = response.damping_ratio;
        let [alpha1, alpha2] = response.rayleigh;
        vec![
            response.name.clone(),
            format!("{f1:.4}, {f2:.4}"),
            format!("{z1:.4}, {z2:.4}"),
            format!("{alpha1:.4}"),
            format!("{alpha2:.2e}"),
            format!("{:.2} %", 100.0 * response.error),
        ]
    });
    Section {
        title: "Fig. 5: the response with each set of parameters".to_owned(),
        text: vec![format!(
            "The unshaped move and {COMPARED_S:.0} s of free vibration, simulated with every set of the paper's parameters and with ours from the sweep of 3 octaves per \
             minute. Error: rms of model minus beam over that of the beam; unrelated signals have about 140 %. The paper's sets describe its own beam, so their errors here show how much the sets \
             differ, not how good they are. Rayleigh's coefficients follow from eq. 22."
        )],
        table: Some(Table::new(
            ["parameters", "Hz", "damping", "α₁ (1/s)", "α₂ (s)", "error"],
            rows.collect(),
        )),
        notes: vec![
            "Two sets have a negative coefficient: the linear sweep's α₁ pushes on a base that moves, and the α₂ of 7 octaves per minute lets everything above 23 Hz grow. As Rayleigh \
             damping, which is how the paper uses them, they describe no beam."
                .to_owned(),
        ],
        figure: Some(Figure::Responses),
    }
}

pub(super) fn table_2(result: &PaperResult) -> Section {
    let unshaped = result.moves.first();
    let rows = result.moves.iter().map(|outcome| {
        let printed = |value: &dyn Fn(&crate::demo::cases::PaperRow) -> f64| {
            outcome.case.paper.as_ref().map_or_else(|| "–".to_owned(), |paper| format!("{:.2}", value(paper)))
        };
        let seconds = |value: Option<f64>| value.map_or_else(|| "never".to_owned(), |s| format!("{s:.2}"));
        let vibration = unshaped.map(|unshaped| outcome.simulated.percentage_vibration(&unshaped.simulated));
        vec![
            outcome.case.name(),
            printed(&|paper| paper.settling_time_s),
            format!("{:.3}", outcome.command_end_s),
            format!("{:.2}", outcome.base_settling_s),
            seconds(outcome.tip_settling_s[0]),
            seconds(outcome.tip_settling_s[2]),
            printed(&|paper| paper.overshoot_pct),
            format!("{:.1}", outcome.simulated.metrics.overshoot_pct),
            printed(&|paper| paper.percentage_vibration_pct),
            vibration.map_or_else(String::new, |vibration| format!("{:.3}", vibration.tip_pct)),
        ]
    });
    let (profile, duration_s) = EXPLAINING_MOVE;
    Section {
        title: "Table 2 and Figs. 6 to 9: six shapers".to_owned(),
        text: vec![
            format!(
                "50 mm in {duration_s} s ({}, the move found below), shaped for 1.1 and 6.9 Hz with a damping ratio of 0.0074 each, eq. 35, on the beam with 0.0074 and 0.0033.",
                profile.name()
            ),
            "Our definitions. Command's end: the setpoint has come to rest. Base and tip settling: from the command's start until the position stays within the band around the target for good. \
             Overshoot: the furthest of the tip's absolute position beyond its target, percent of the move. Vibration: largest deflection of the tip in the two periods of the first mode after the setpoint has come to \
             rest, percent of that after the unshaped move."
                .to_owned(),
        ],
        table: Some(Table::new(
            [
                "shaper",
                "settling (s), paper",
                "command's end (s)",
                "base within 2 % (s)",
                "tip within 2 % (s)",
                "tip within 10 % (s)",
                "overshoot (%), paper",
                "overshoot (%)",
                "vibration (%), paper",
                "vibration (%)",
            ],
            rows.collect(),
        )),
        notes: Vec::new(),
        figure: Some(Figure::Moves),
    }
}
