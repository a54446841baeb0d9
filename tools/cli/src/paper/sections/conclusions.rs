//! What the paper's tables do not say and can be made to.

use super::{Section, Table};
use crate::paper::PaperResult;
use crate::paper::move_search::{EXPLAINING_MOVE, Meaning};
use crate::paper::testbed::MEAN_WIDTH_M;

pub(super) fn which_move(result: &PaperResult) -> Section {
    let rows = result.fits.iter().map(|fit| {
        vec![
            fit.profile.name().to_owned(),
            fit.meaning.name(),
            if fit.is_longest {
                format!("≥ {:.3}", fit.duration_s)
            } else {
                format!("{:.3}", fit.duration_s)
            },
            match fit.meaning {
                Meaning::Overshoot | Meaning::Vibration => format!("{:.2} {}", fit.rms, fit.meaning.unit()),
                _ => format!("{:.3} {}", fit.rms, fit.meaning.unit()),
            },
            format!("{:.1} %", fit.overshoot_rms_pct),
        ]
    });
    let (profile, duration_s) = EXPLAINING_MOVE;
    let telling = [Meaning::CommandEnd, Meaning::Overshoot, Meaning::Vibration];
    let agreeing = result.fits.iter().filter(|fit| fit.profile == profile && telling.contains(&fit.meaning));
    let chosen: Vec<String> = agreeing.map(|fit| format!("{:.3}", fit.duration_s)).collect();
    Section {
        title: "Which move explains Table 2".to_owned(),
        text: vec![
            "The paper prints neither the profile nor the duration of its move nor what settled means. Each row below is one profile and one meaning of a printed column, with the duration \
             (0.05 to 0.70 s) that comes nearest to its six values; the last column asks the printed overshoot about that duration."
                .to_owned(),
        ],
        table: Some(Table::new(
            ["profile", "what the column means", "best duration (s)", "rms deviation", "rms deviation of the overshoot"],
            rows.collect(),
        )),
        notes: vec![
            format!(
                "With a {}, which is the quickest within an acceleration, three columns choose the same move, each by itself: {} s. The printed settling times are then the lengths of the shaped \
                 commands, 0.03 s rms (worst: single-mode ZV, printed 0.73 s, 0.67 s long), and the overshoot of a move of {duration_s} s (4.3 m/s²) is met to 1.1 % rms. A smoother profile does nearly as well; constant velocity does not.",
                profile.name(),
                chosen.join(", "),
            ),
            "They cannot be a 2 % band on the tip. The single-mode rows print 3 to 6 % of vibration left, of an unshaped vibration larger than the move itself, so the tip is outside such a band for many seconds after the printed times; and wider \
             bands that fit the times need a move of 0.6 s or more, with which the tip would hardly overshoot. A base within 2 % fits the times as well as the command's end, with a move of about 0.3 s, but not the \
             overshoot. Settling times that grow with the shaper's length alone say nothing of the vibration."
                .to_owned(),
        ],
        figure: None,
    }
}

pub(super) fn model_errors(result: &PaperResult) -> Section {
    let errors = &result.model_errors;
    let percent = |value: Option<f64>| {
        value.map_or_else(|| "none".to_owned(), |fraction| format!("{:+.1} %", 100.0 * fraction))
    };
    let left = errors.left_pct.iter().zip(&errors.third_mode_pct);
    let rows = errors.rows.iter().zip(left).map(|(row, (left, third))| {
        vec![
            row.case.name(),
            row.case.paper.map_or_else(String::new, |paper| format!("{:.2}", paper.percentage_vibration_pct)),
            format!("{:.2}", row.exact_pct),
            percent(row.alone[0]),
            percent(row.alone[1]),
            format!("{left:.2}"),
            format!("{third:.2}"),
        ]
    });
    Section {
        title: "Which printed residuals a model explains".to_owned(),
        text: vec![
            "Percentage vibration of the tip with the design's frequencies exact; then the smallest error of one frequency alone (first: up to ±15 %, second: up to ±40 %) that would leave what is printed; and what all rows \
             have left if the first frequency has the error that explains the two-mode ZV, and if nothing is wrong but the beam has a third mode (19.3 Hz)."
                .to_owned(),
        ],
        table: Some(Table::new(
            [
                "shaper",
                "paper (%)",
                "exact (%)",
                "first frequency off by",
                "second frequency off by",
                &format!("left with the first off by {:+.2} % (%)", 100.0 * errors.first_frequency),
                "left with a third mode (%)",
            ],
            rows.collect(),
        )),
        notes: vec![
            "Single-mode rows: the second mode alone, which these shapers hardly touch, leaves as much as is printed, to 1.2 % of the unshaped vibration. How much depends on the move and on the beam's unknown participations. The printed values fall faster from ZV to ZVDD than \
             the second mode does (1 : 0.62 : 0.49 against 1 : 0.88 : 0.78); an error of the first frequency adds to ZV only and has the right sign."
                .to_owned(),
            format!(
                "Two-mode rows: no pure model with the design's own frequencies leaves any of them. A first frequency 1.4 % off explains both ZV rows; the sweeps of Table 1 scatter by 0.34 %, so that is more than they admit, and about half of what \
                 separates a held base from a free one. The two-mode ZVD (1.26 %) would need 7.5 % and the ZVDD (0.36 %) more than 10 %, which would leave more than 10 % in the ZV row. The second frequency would have to be off by more than 20 %. So no \
                 error of a linear model's frequencies explains the three rows together, and a third mode does not either. What remains is what the model does not have: friction and the servo at the end of a move, disturbances, and the camera: 0.36 % of \
                 our unshaped vibration of {:.0} mm is {:.2} mm. Recordings would tell; the table cannot.",
                1e3 * errors.unshaped_peak_m,
                3.6 * errors.unshaped_peak_m,
            ),
        ],
        figure: None,
    }
}

pub(super) fn testbed(result: &PaperResult) -> Section {
    let rows = result.testbed.iter().map(|section| {
        let pair = |values: [f64; 2]| format!("{:.2} → {:.2}", 1e3 * values[0], 1e3 * values[1]);
        let thickness = section.thickness_m.map(|metres| 1e3 * metres);
        vec![
            section.name.clone(),
            pair(section.width_m),
            format!("{:.3} → {:.3}", thickness[0], thickness[1]),
            format!("{:.3}", section.beam_kg),
            section.held_hz.map(|hz| format!("{hz:.3}")).join(", "),
            section.free_hz.map(|hz| format!("{hz:.3}")).join(", "),
            section.participation.map(|value| format!("{value:.3}")).join(", "),
        ]
    });
    Section {
        title: "The testbed".to_owned(),
        text: vec![
            "Printed: length 0.9 m, density 8190 kg/m³, Young's modulus 190 GPa, base 2.5 kg, and frequencies of 1.1 and 6.9 Hz. Not printed: the section. All strips below but the plain uniform one are tuned to 1.100 and \
             6.900 Hz with the base held."
                .to_owned(),
        ],
        table: Some(Table::new(
            [
                "strip",
                "width, root → tip (mm)",
                "thickness, root → tip (mm)",
                "mass (kg)",
                "held (Hz)",
                "free (Hz)",
                "participations of the tip",
            ],
            rows.collect(),
        )),
        notes: vec![
            format!(
                "Two frequencies fix the thickness and one relation between the tapers of width and thickness; everything else is free. The width's scale has no effect at all on the held frequencies (mean {:.0} mm here, by assumption) and sets the mass. \
                 Even a uniform strip has 1.1 and 6.9 Hz as far as the paper's text prints them; the fourth digits of Table 1 (ratios of 6.29 to 6.30 for the exponential sweeps, against 6.27) are what a taper rests on, and a few grams at the tip, such as a camera's target, or a clamp that yields a little would do as well.",
                1e3 * MEAN_WIDTH_M
            ),
            "It matters little here: over the whole table the first participation stays within 5 % of the shipped beam's, the second within 15 %, the third frequency within 0.2 % and the free base's first frequency within 0.3 %."
                .to_owned(),
        ],
        figure: None,
    }
}
