//! A diagnosis in a sentence.

use crate::adequacy::Rest;
use crate::result::{Effect, Fits, RecordRole, Verdict};
use crate::verdict::{Contender, unsettled};
use crate::wording::sizes;

/// A model that is adequate down to a noise that is not white: a force that nobody recorded is as loud where
/// the machine is quiet.
pub(crate) const COLOURED: &str = " That noise is not white: a disturbance from outside that acts all the time, or the sensor's own colour. What is \
     smaller than it is hidden.";

/// How much may be overlooked.
pub(crate) fn bounded(excess: f64) -> String {
    format!(" What is left has at most {:.1} % more power than noise.", 100.0 * excess)
}

/// The verdict in words, with the numbers of the first output that was recorded; `waiting`: the laws that a
/// search which its limit ended did not try to the end.
pub(crate) fn sentence(
    verdict: Verdict,
    (effects, contenders, waiting): (&[Effect], &[Contender], Option<&[String]>),
    fit: &Fits,
    (rest, is_tied): (Rest, bool),
) -> String {
    let (numbers, remains) = (numbers(fit), remains(rest));
    let first = effects.first().map(|effect| effect.sentence.as_str()).unwrap_or_default();
    match verdict {
        Verdict::Adequate => format!(
            "Nothing is missing: refitted within its own parameters the model explains the recordings down to the noise. {numbers}"
        ),
        Verdict::Unexplained if !contenders.is_empty() => {
            let ended =
                waiting.map_or("", |_| " The search was ended before it had tried what others do together.");
            format!("{}{ended} {numbers}", unsettled(contenders))
        }
        Verdict::Unexplained if let Some(waiting) = waiting => {
            let showed = if waiting.is_empty() {
                String::new()
            } else {
                format!(": {} showed and were not tried to the end", waiting.join(", "))
            };
            format!("Something is missing, and the search was ended before it was done{showed}. {numbers}")
        }
        Verdict::Unexplained => {
            format!("Something is missing that no law of the catalogue explains. {numbers}")
        }
        Verdict::Ambiguous => {
            format!("Several candidates explain the recordings equally well. {first} {numbers}{remains}")
        }
        Verdict::Improved if is_tied => {
            format!("{first} {numbers}{remains} Other laws would take as much away.")
        }
        Verdict::Improved => format!("{first} {numbers}{remains}"),
        Verdict::Explained => format!("{first} {numbers}"),
    }
}

/// The same where every recording by itself is explained, and all together are not.
pub(crate) fn from_run_to_run(fit: &Fits) -> String {
    format!(
        "The machine was another one from recording to recording: the model explains each by itself down to the noise, \
         within its own parameters, and no one set of them explains all. Temperature, clamping or load may have \
         changed, or the machine depends on how hard it is driven; nothing of the catalogue is named. {}",
        numbers(fit)
    )
}

/// How the error of the first output that was recorded goes, with the noise.
fn numbers(fit: &Fits) -> String {
    let held_out = fit.pooled.iter().find(|pooled| pooled.role == RecordRole::HeldOut);
    let Some(pooled) = held_out.or_else(|| fit.pooled.first()) else { return String::new() };
    let fits = &pooled.fits;
    let role = if pooled.role == RecordRole::HeldOut { "held-out" } else { "training" };
    let last = fits.extended.map_or(fits.refitted_linear, |extended| extended);
    let values = [fits.given.rms, fits.refitted_linear.rms, last.rms, fits.given.noise_floor];
    let ([given, refitted, extended, noise], unit) = sizes(values, &pooled.output);
    let extended = fits.extended.map_or_else(String::new, |_| format!(" to {extended} {unit} with it"));
    let goes = if last.rms <= fits.given.rms { "falls" } else { "rises" };
    format!(
        "The {role} error of {} {goes} from {given} as given to {refitted} refitted{extended}, the noise being {noise} {unit}.",
        pooled.output
    )
}

fn remains(rest: Rest) -> &'static str {
    match rest {
        Rest::Noise => "",
        Rest::Foreign => {
            " What remains does not go with the motion: a disturbance from outside, another one in every recording."
        }
        Rest::Structured => " A structured rest remains.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_of_which_nothing_settles_which_it_is_are_said_where_nothing_is_named() {
        let fit = Fits { recordings: Vec::new(), pooled: Vec::new() };
        let said = |contenders: &[Contender], waiting: Option<&[String]>| {
            sentence(Verdict::Unexplained, (&[], contenders, waiting), &fit, (Rest::Structured, false))
        };
        let contenders = [
            Contender { name: "hysteresis at mode 1".to_owned(), taken: 0.93, is_unconfirmed: false },
            Contender { name: "dead_zone at drive".to_owned(), taken: 0.5, is_unconfirmed: true },
        ];
        let open = said(&contenders, None);
        assert!(
            open.contains("hysteresis at mode 1 takes 93 %; dead_zone at drive takes 50 % (the"),
            "{open}"
        );
        assert!(open.contains("do not settle what") && !open.contains("ended before"), "{open}");
        assert!(said(&contenders, Some(&[])).contains("ended before"), "time ended the search");
        assert!(said(&[], None).contains("no law of the catalogue"));
    }

    #[test]
    fn a_search_that_a_limit_ended_does_not_say_that_no_law_explains() {
        let fit = Fits { recordings: Vec::new(), pooled: Vec::new() };
        for waiting in [&["saturation at drive".to_owned()][..], &[]] {
            let found = (&[][..], &[][..], Some(waiting));
            let said = sentence(Verdict::Unexplained, found, &fit, (Rest::Structured, false));
            assert!(said.contains("ended before it was done") && !said.contains("no law"), "{said}");
            assert_eq!(said.contains("saturation at drive"), !waiting.is_empty(), "{said}");
        }
    }

    #[test]
    fn what_remains_is_said_to_be_the_machines_own_or_not() {
        let fit = Fits { recordings: Vec::new(), pooled: Vec::new() };
        let said = |rest: Rest| sentence(Verdict::Improved, (&[], &[], None), &fit, (rest, false));
        assert!(said(Rest::Foreign).contains("does not go with the motion"));
        assert!(said(Rest::Structured).contains("A structured rest remains"));
        assert!(!said(Rest::Noise).contains("remain"), "time ended the search, and nothing is left");
        let tied = sentence(Verdict::Improved, (&[], &[], None), &fit, (Rest::Structured, true));
        assert!(tied.contains("A structured rest remains. Other laws would take as much away"), "{tied}");
    }
}
