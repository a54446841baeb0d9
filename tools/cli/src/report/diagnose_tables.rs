//! The tables of the report of `diagnose`.

use maud::{Markup, html};
use stillbeam_diagnose::{Diagnosis, Effect, Quality, RecordRole};

/// Given, refitted, extended and noise, by role and output.
pub fn fit_table(found: &Diagnosis) -> Markup {
    html! {
        table.numbers {
            thead { tr {
                th { "recordings" } th { "output" } th { "given" } th { "refitted" } th { "with the physics found" } th { "noise floor" }
            } }
            tbody {
                @for pooled in &found.fit.pooled {
                    (fit_row(role_name(pooled.role), &pooled.output, [Some(pooled.fits.given), Some(pooled.fits.refitted_linear), pooled.fits.extended]))
                }
                @for one in &found.fit.recordings {
                    (fit_row(&format!("{} ({})", one.recording, role_name(one.role)), &one.output, [Some(one.fits.given), Some(one.fits.refitted_linear), one.fits.extended]))
                }
            }
        }
        p.muted { "Root mean square of recorded minus simulated, in the output's unit. Offsets and initial states are fitted in every column, nothing else on held-out recordings." }
    }
}

fn fit_row(recordings: &str, output: &str, qualities: [Option<Quality>; 3]) -> Markup {
    let floor = qualities.iter().flatten().next().map(|quality| quality.noise_floor);
    html! {
        tr {
            td { (recordings) }
            td { code { (output) } }
            @for quality in qualities { td { (quality.map_or_else(|| "–".to_owned(), |quality| format!("{:.4e}", quality.rms))) } }
            td { (floor.map_or_else(|| "–".to_owned(), |floor| format!("{floor:.4e}"))) }
        }
    }
}

fn role_name(role: RecordRole) -> &'static str {
    match role {
        RecordRole::Train => "trained on",
        RecordRole::HeldOut => "held out",
    }
}

/// The physics found, with its parameters.
pub fn effect_list(effects: &[Effect]) -> Markup {
    html! {
        @for effect in effects {
            h3 { code { (effect.id) } " at " code { (effect.location) } }
            p { (effect.sentence) }
            table.numbers {
                thead { tr { th { "parameter" } th { "value" } th { "± (standard error)" } th { "unit" } } }
                tbody {
                    @for (name, estimate) in &effect.parameters {
                        tr { td { (name) } td { (format!("{:.5e}", estimate.value)) } td { (format!("{:.1e}", estimate.stderr)) } td { (estimate.unit) } }
                    }
                }
            }
            p.muted {
                "Held-out gain " (format!("{:.1}", effect.evidence.held_out_gain_db)) " dB"
                @if let Some(z) = effect.evidence.held_out_z { ", " (format!("{z:.1}")) " standard errors of its own" }
                "; change of BIC in training " (format!("{:.0}", effect.evidence.delta_bic)) " (for information)."
            }
        }
    }
}

/// Every candidate with its gates.
pub fn candidate_table(found: &Diagnosis) -> Markup {
    html! {
        table {
            thead { tr { th { "candidate" } th { "screen: errors from zero" } th { "hidden by a refit" } th { "gates" } } }
            tbody {
                @for row in &found.candidates {
                    tr {
                        td { @if row.named { strong { (row.id) " at " (row.location) } } @else { (row.id) " at " (row.location) } }
                        td { (format!("{:.1}", row.screen_t)) }
                        td { (format!("{:.0} %", 100.0 * row.hidden_share)) }
                        td style="text-align:left" {
                            @for gate in &row.gates {
                                div { (if gate.passed { "✓ " } else { "✗ " }) (gate.name) ": " (gate.detail) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// How alike the candidates' effects are on these recordings.
pub fn confusability_table(found: &Diagnosis) -> Markup {
    let names = &found.confusability.candidates;
    html! {
        table {
            thead { tr { th { "" } @for number in 1..=names.len() { th { (number) } } } }
            tbody {
                @for (number, (name, row)) in (1..).zip(names.iter().zip(&found.confusability.cosine)) {
                    tr {
                        td { (number) ". " (name) }
                        @for value in row {
                            td style=(format!("background:rgba(0,96,168,{:.2})", 0.7 * value.powi(4))) { (format!("{value:.2}")) }
                        }
                    }
                }
            }
        }
        p.muted { "Absolute cosine between the effects of two candidates on the training recordings, what a refit hides taken out: 0 nothing in common, 1 cannot be told apart." }
    }
}
