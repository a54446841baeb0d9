//! The gates that a law has to pass before it is named.
//!
//! | gate | asks |
//! |---|---|
//! | training | is the law's improvement of the training recordings more than chance, whatever the noise's colour |
//! | held out | does it improve recordings it was not fitted to, and make none of them worse |
//! | bounds | is no parameter pressed against a bound, in particular the amplitude against zero |
//! | determined | are the strengths larger than their standard errors; of friction that differs by direction the better known one, of a law with one strength and known shapes by less, or a tenth of it does worse |
//! | size | does it explain a noticeable part of what was left, on the training and on the held-out recordings |
//! | pulls back | does a cable pull towards where it was laid, and not push away from it |
//! | consistent | do all training recordings, and the halves of each, agree about its strength |
//! | stable | does the model stay finite at 1.1 times the largest input, or leave next to nothing up to there |
//! | sufficient | where a structured rest remains that is large beside what the law explains, of the training or of the held-out recordings: is the held-out gain beyond doubt |
//! | unrivalled | where time ended the search with more than noise left: could no other law do its work |
//!
//! The last four are asked of laws that were chosen, not of every one that was tried.

use stillbeam_plant::Physics;
use stillbeam_plant::catalogue::Law;

use super::improvement::Improvement;
use super::rivals::Rivalry;
use crate::intervals::Consistency;
use crate::options::Options;
use crate::result::Gate;
use crate::verdict::MOST_OF_ITS_OWN;

/// What the gates look at.
pub(crate) struct Trialled<'t> {
    /// Improvement of the training recordings.
    pub(crate) training: Improvement,
    /// Improvement of the held-out recordings; `None` when there are none.
    pub(crate) held_out: Option<Improvement>,
    /// Degrees of freedom that the law added.
    pub(crate) freedom: usize,
    /// Name, value, standard error, lower and upper bound of the law's parameters.
    pub(crate) parameters: &'t [(String, f64, f64, f64, f64)],
    /// Which of them set the law's strength.
    pub(crate) amplitudes: &'t [String],
    /// Sum of squares taken off the training residual, and what noise alone would leave of it.
    pub(crate) explained: f64,
    pub(crate) systematic: f64,
    /// The same of the held-out recordings, as a share of what noise does not explain there.
    pub(crate) held_out_share: Option<f64>,
    /// What only chosen laws are asked.
    pub(crate) closer: Option<Closer>,
}

impl Trialled<'_> {
    /// Share that the law takes off what noise does not explain of the training recordings.
    fn share(&self) -> f64 {
        self.explained / self.systematic.max(f64::MIN_POSITIVE)
    }

    /// The smaller of that and the held-out recordings' share.
    fn least_share(&self) -> f64 {
        self.held_out_share.map_or(self.share(), |held_out| held_out.min(self.share()))
    }

    /// What is left that follows the motion, over what the law explains: of the training recordings, or of
    /// the held-out ones if more is left there. A law that others lack beside it may fit what it was trained
    /// on to the noise and be wrong elsewhere. What is foreign to the motion is another one in every
    /// recording, and no law could take it off those held out.
    fn rest_beside(&self, rest: f64, is_foreign: bool) -> f64 {
        let held_out = self.held_out_share.filter(|_| !is_foreign).map_or(0.0, |share| {
            let share = share.clamp(HARDLY_ANY, 1.0);
            (1.0 - share) / share
        });
        held_out.max(rest / self.explained.max(f64::MIN_POSITIVE))
    }

    /// Whether training and held-out recordings show the law twice as clearly as they must.
    fn is_beyond_doubt(&self, options: &Options) -> bool {
        self.training.t() > DOUBT * options.training_gate
            && self.held_out.is_some_and(|held_out| held_out.z > DOUBT * options.held_out_gate)
    }

    /// Whether no laws that were not tried could do its work: it takes nearly all away, or most of it and
    /// others were tried in its place in vain, or does what no others together could, or is beyond doubt and
    /// alone in coming near.
    pub(crate) fn is_unrivalled(&self, rivalry: Option<Rivalry>, options: &Options) -> bool {
        let is_its_own =
            |rivalry: Rivalry| rivalry.own_share > OWN || (rivalry.leads && self.is_beyond_doubt(options));
        let is_kept = rivalry.is_some_and(|rivalry| rivalry.is_kept);
        let (least, is_its_own) = (self.least_share(), rivalry.is_some_and(is_its_own));
        least > NEARLY_ALL || (is_kept && least > MOST_OF_ITS_OWN) || is_its_own
    }
}

/// What only chosen laws are asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closer {
    /// Of the parameter that sets the strength and about which the recordings agree least.
    pub(crate) consistency: Option<Consistency>,
    /// Whether the model stays finite when driven harder.
    pub(crate) stable: bool,
    /// Sum of squares that is left over beyond noise; `None` where nothing but noise is left.
    pub(crate) rest: Option<f64>,
    /// Where time ended the search while what is left was louder than noise: what speaks against other laws.
    pub(crate) cut_short: Option<Rivalry>,
    /// Whether nothing that is left goes with the motion: then no law that was not tried is missing beside
    /// this one.
    pub(crate) rest_is_foreign: bool,
}

/// A law takes away at least this share of what noise does not explain.
pub(crate) const NOTICEABLE: f64 = 0.05;

/// Share of what noise does not explain, beside the other laws of its set, that a law takes away when what
/// was not tried cannot be it. A search that time has ended has not seen what a further law beside or instead
/// of this one would do. Whatever that law is, all that is left for it to explain is the rest: a law that
/// only shares the work of another leaves much to it, one that leaves a twentieth has done the work, and a
/// second law can be missing only on top.
const NEARLY_ALL: f64 = 0.95;
/// A law is named beside a large rest too, of a disturbance say, when at least this share of its effect is
/// its own: no laws instead of it could then take away most of what it takes.
const OWN: f64 = 0.5;

/// A structured rest is large when it is this share of what the law explains: a law that is nearly right
/// leaves as much.
const LARGE_REST: f64 = 0.1;
/// A share of the held-out rest below this is as good as none.
const HARDLY_ANY: f64 = 1e-3;
/// The held-out gate is this many times as high where a rest is large: a rest with a structure is no noise
/// that standard errors could be reckoned from.
pub(crate) const DOUBT: f64 = 2.0;

/// Recordings disagree about a parameter when chance would rarely have it, and ...
const DISAGREES_P: f64 = 1e-5;
/// ... it matters: a half recording's own value is off by this share.
const DISAGREES_BY: f64 = 0.2;

/// Standard errors that a law's only strength lies from zero at least.
const ONLY_STRENGTH: f64 = 2.0;
/// The same of every strength of a law that is published as one that may be there.
const MAY_BE: f64 = 2.0;

/// Name of the gate of strengths that are larger than their errors.
pub(super) const DETERMINED: &str = "determined";

/// Name of the gate of the held-out recordings.
pub(crate) const HELD_OUT: &str = "held out";
const UNRIVALLED: &str = "unrivalled";
const SUFFICIENT: &str = "sufficient";

/// Gates that a law may fail for another one that is missing beside it.
pub(super) const FOR_ANOTHER: [&str; 3] = [HELD_OUT, NO_WORSE, SIZE];
const NO_WORSE: &str = "no recording worse";
const SIZE: &str = "size";
/// Name of the gate of a machine that is driven harder.
const STABLE: &str = "stable";

fn gate(name: &str, passed: bool, detail: String) -> Gate {
    Gate { name: name.to_owned(), passed, detail }
}

/// Runs all gates.
pub(crate) fn gates(trialled: &Trialled<'_>, options: &Options) -> Vec<Gate> {
    let mut gates = vec![training_gate(trialled, options)];
    gates.extend(held_out_gates(trialled, options));
    gates.push(bounds_gate(trialled));
    gates.extend(determined_gate(trialled, options));
    let share = trialled.share();
    gates.push(gate(
        SIZE,
        share > NOTICEABLE && trialled.held_out_share.is_none_or(|share| share > NOTICEABLE),
        size_in_words(share, trialled.held_out_share),
    ));
    if let Some(closer) = &trialled.closer {
        gates.extend(closer.consistency.map(consistency_gate));
        gates.push(stable_gate(trialled, closer));
        gates.extend(closer.cut_short.map(|rivalry| rivalry_gate(trialled, closer, rivalry, options)));
        gates.extend(rest_gate(trialled, closer, options));
    }
    gates
}

fn training_gate(trialled: &Trialled<'_>, options: &Options) -> Gate {
    // Every parameter fitted to noise takes about one square of it away.
    let threshold = options.training_gate + 0.5 * (trialled.freedom.saturating_sub(1)) as f64;
    let t = trialled.training.t();
    let detail = format!("{t:.1} standard errors from no effect on the training recordings");
    gate("training", t > threshold, detail)
}

fn held_out_gates(trialled: &Trialled<'_>, options: &Options) -> Vec<Gate> {
    let Some(held_out) = &trialled.held_out else {
        return vec![gate(HELD_OUT, false, "nothing was held out".to_owned())];
    };
    vec![
        gate(
            HELD_OUT,
            held_out.z > options.held_out_gate,
            format!("improves the held-out recordings by {:.1} standard errors", held_out.z),
        ),
        gate(
            NO_WORSE,
            held_out.worst_z > -2.0,
            format!("the held-out recording that gains least: {:.1} standard errors", held_out.worst_z),
        ),
    ]
}

fn bounds_gate(trialled: &Trialled<'_>) -> Gate {
    let at_bound = trialled.parameters.iter().find(|(_, value, _, lower, upper)| {
        let close = 1e-6 * value.abs();
        (value - lower).abs() <= close || (upper - value).abs() <= close
    });
    match at_bound {
        Some((name, value, ..)) => {
            gate("bounds", false, format!("{name} = {value:.4e} is pressed against its bound"))
        }
        None => gate("bounds", true, "no parameter is at a bound".to_owned()),
    }
}

/// Whether the least of a law's strengths is more than its standard error; `None` for a law without any.
fn determined_gate(trialled: &Trialled<'_>, options: &Options) -> Option<Gate> {
    let strengths = || {
        let amplitudes = trialled.parameters.iter().filter(|(name, ..)| trialled.amplitudes.contains(name));
        amplitudes.map(|(name, value, stderr, ..)| (name.as_str(), value.abs() / stderr))
    };
    // Friction that acts one way only differs by direction all the same: of its two forces the better known
    // one counts.
    let is_outdone = |name: &str, t: f64| {
        other_direction(name).is_some_and(|other| strengths().any(|(name, its)| name == other && its > t))
    };
    let weakest = strengths().filter(|(name, t)| !is_outdone(name, *t)).min_by(|a, b| a.1.total_cmp(&b.1));
    let (name, t) = weakest?;
    // That a law's only strength is not nothing, its gain on the training recordings has shown. A stop that
    // is touched shortly is certain without being known well: how far away it is is clear, how hard it pushes
    // back is not. A hysteresis of unknown strength and unknown yield is dry friction, and not named on top.
    let is_only = only_strength(trialled.parameters, trialled.amplitudes, options).is_some();
    let needed = if is_only { ONLY_STRENGTH } else { options.training_gate };
    Some(gate(DETERMINED, t > needed, format!("{name} is {t:.1} standard errors from zero")))
}

fn consistency_gate(Consistency { p, spread, .. }: Consistency) -> Gate {
    let detail = format!(
        "recordings and their halves on their own would have it up to {:.0} % different (p = {p:.1e})",
        100.0 * spread
    );
    gate("consistent", p > DISAGREES_P || spread < DISAGREES_BY, detail)
}

fn rivalry_gate(trialled: &Trialled<'_>, closer: &Closer, rivalry: Rivalry, options: &Options) -> Gate {
    let is_beside_noise = closer.rest_is_foreign && trialled.is_beyond_doubt(options);
    gate(
        UNRIVALLED,
        trialled.is_unrivalled(Some(rivalry), options) || is_beside_noise,
        format!(
            "the search was ended with more than noise left; takes {:.0} % off what noise does not explain beside the other laws, {:.0} % \
             of its effect being what no others make",
            100.0 * trialled.least_share().clamp(0.0, 1.0),
            100.0 * rivalry.own_share
        ),
    )
}

/// Whether what remains is small beside what a law explains, or the law beyond doubt; `None` where nothing
/// remains and where nothing was held out.
fn rest_gate(trialled: &Trialled<'_>, closer: &Closer, options: &Options) -> Option<Gate> {
    let (rest, held_out) = (closer.rest?, trialled.held_out.as_ref()?);
    let beside = trialled.rest_beside(rest, closer.rest_is_foreign);
    Some(gate(
        SUFFICIENT,
        beside < LARGE_REST || held_out.z > DOUBT * options.held_out_gate,
        format!("{}, held-out gain {:.1} standard errors", rest_in_words(beside), held_out.z),
    ))
}

/// Springs that soften let go of a machine somewhere. One that leaves next to nothing of any recording is
/// right as far as those went, wherever it lets go.
fn stable_gate(trialled: &Trialled<'_>, closer: &Closer) -> Gate {
    let is_right_so_far = trialled.least_share() > NEARLY_ALL;
    let detail = match (closer.stable, is_right_so_far) {
        (false, true) => "runs away at 1.1 times the largest input, and leaves next to nothing up to there",
        (false, false) => "runs away at 1.1 times the largest input",
        (true, _) => "simulated at 1.1 times the largest input",
    };
    gate(STABLE, closer.stable || is_right_so_far, detail.to_owned())
}

/// The shares of what noise does not explain that a law takes off the training and the held-out recordings.
/// How much worse it makes those, in shares of a rest that may be next to nothing, says nothing.
fn size_in_words(share: f64, held_out: Option<f64>) -> String {
    let per_cent = |share: f64| 100.0 * share.min(1.0);
    let takes = format!("takes {:.0} % off what noise does not explain", per_cent(share));
    match held_out {
        Some(held_out) if held_out < 0.0 => format!("{takes}, and makes the held-out recordings worse"),
        Some(held_out) => format!("{takes}, {:.0} % of the held-out recordings", per_cent(held_out)),
        None => takes,
    }
}

/// A structured rest in terms of what a law explains; infinite where the noise is not known apart from it.
fn rest_in_words(beside: f64) -> String {
    if beside.is_finite() {
        format!("a structured rest {beside:.2} times as large as what it explains")
    } else {
        "a structured rest that what it explains cannot be compared with".to_owned()
    }
}

/// Whether a law that can only pull does; `None` for other laws.
pub(crate) fn pulls_back(known: &dyn Law, law: &Physics) -> Option<Gate> {
    let name = known.pulls_by()?;
    let strength = law.parameters.get(name)?;
    Some(gate("pulls back", *strength > 0.0, format!("{name} of {strength:.3e}")))
}

/// Name of a law's strength where it has one and its shapes are clear: rows are name, value, standard error
/// and bounds.
pub(super) fn only_strength<'p>(
    parameters: &'p [(String, f64, f64, f64, f64)],
    amplitudes: &[String],
    options: &Options,
) -> Option<&'p str> {
    let (strengths, mut shapes): (Vec<_>, Vec<_>) =
        parameters.iter().partition(|(name, ..)| amplitudes.contains(name));
    shapes.retain(|(_, value, stderr, ..)| value.abs() <= options.training_gate * stderr);
    match strengths[..] {
        [(name, ..)] if shapes.is_empty() => Some(name),
        _ => None,
    }
}

/// The same strength in the other direction; `None` for what has none.
fn other_direction(name: &str) -> Option<String> {
    let turned = |from: &str, to: &str| Some(format!("{}{to}", name.strip_suffix(from)?));
    turned("_forward", "_backward").or_else(|| turned("_backward", "_forward"))
}

/// Whether this gate, and no other, refuses a law.
pub(super) fn fails_only(gates: &[Gate], name: &str) -> bool {
    let mut failed = gates.iter().filter(|gate| !gate.passed);
    failed.next().is_some_and(|gate| gate.name == name) && failed.next().is_none()
}

/// Whether the held-out recordings neither confirm nor contradict a law that passes all other gates: they
/// hardly show it.
pub(crate) fn is_only_unconfirmed(gates: &[Gate], held_out: Option<Improvement>) -> bool {
    fails_only(gates, HELD_OUT) && held_out.is_some_and(|held_out| held_out.z > 0.0)
}

/// Whether nothing speaks against a law but that the held-out recordings hardly show it, that a large rest
/// remains beside it, or that time ended the search for others.
pub(crate) fn may_be_it(gates: &[Gate], held_out: Option<Improvement>) -> bool {
    let is_shown = held_out.is_some_and(|held_out| held_out.z > 0.0);
    gates
        .iter()
        .filter(|gate| !gate.passed)
        .all(|gate| gate.name == UNRIVALLED || gate.name == SUFFICIENT || (gate.name == HELD_OUT && is_shown))
}

/// Whether a law passes all gates but that of its strengths, which are some standard errors from nothing all
/// the same: a one-sided spring of which neither the contact nor the stiffness is known well may do what a
/// cubic one does, whose only number is.
pub(super) fn is_only_undetermined(
    gates: &[Gate],
    parameters: &[(String, f64, f64, f64, f64)],
    amplitudes: &[String],
) -> bool {
    let mut strengths = parameters.iter().filter(|(name, ..)| amplitudes.contains(name));
    fails_only(gates, DETERMINED) && strengths.all(|(_, value, stderr, ..)| value.abs() > MAY_BE * stderr)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stillbeam_plant::catalogue::laws;

    #[test]
    fn a_law_of_which_only_the_strength_is_not_known_well_may_be_the_one_that_is_there() {
        let said = |t: f64, also_failed: &[&str]| {
            let failed = [&[DETERMINED], also_failed].concat();
            let gate = |name: &&str| Gate { name: (*name).to_owned(), passed: false, detail: String::new() };
            let gates: Vec<Gate> = failed.iter().map(gate).collect();
            let row =
                |name: &str, value: f64| (name.to_owned(), value, 1.0, f64::NEG_INFINITY, f64::INFINITY);
            is_only_undetermined(
                &gates,
                &[row("stiffness", -t), row("contact", 0.1)],
                &["stiffness".to_owned()],
            )
        };
        assert!(said(3.1, &[]));
        assert!(!said(1.4, &[]), "it may as well be nothing");
        assert!(!said(3.1, &[HELD_OUT]), "it fails elsewhere too");
    }

    /// A law that takes these shares off what noise does not explain, found by a search that time has ended.
    fn cut_short(training: f64, held_out: f64, rivalry: Rivalry) -> bool {
        let improvement = Improvement { z: 50.0, worst_z: 20.0, gain_db: 20.0 };
        let closer = Closer {
            consistency: None,
            stable: true,
            rest: Some(1.0),
            cut_short: Some(rivalry),
            rest_is_foreign: false,
        };
        let parameters = [("force".to_owned(), 1.0, 0.01, 0.0, f64::INFINITY)];
        let trialled = Trialled {
            training: improvement,
            held_out: Some(improvement),
            freedom: 1,
            parameters: &parameters,
            amplitudes: &["force".to_owned()],
            explained: 1e4 * training,
            systematic: 1e4,
            held_out_share: Some(held_out),
            closer: Some(closer),
        };
        gates(&trialled, &Options::default()).iter().all(|gate| gate.passed)
    }

    /// Whether a law passes that takes these shares off training and held-out recordings.
    fn passes_where_it_runs_away(training: f64, held_out: f64) -> bool {
        let improvement = Improvement { z: 50.0, worst_z: 20.0, gain_db: 20.0 };
        let stable = false;
        let closer =
            Closer { consistency: None, stable, rest: None, cut_short: None, rest_is_foreign: false };
        let trialled = Trialled {
            training: improvement,
            held_out: Some(improvement),
            freedom: 1,
            parameters: &[("stiffness".to_owned(), -1.0, 0.01, f64::NEG_INFINITY, f64::INFINITY)],
            amplitudes: &["stiffness".to_owned()],
            explained: 1e4 * training,
            systematic: 1e4,
            held_out_share: Some(held_out),
            closer: Some(closer),
        };
        gates(&trialled, &Options::default()).iter().all(|gate| gate.passed)
    }

    #[test]
    fn a_law_with_which_the_machine_runs_away_passes_only_where_it_leaves_next_to_nothing() {
        assert!(passes_where_it_runs_away(0.999, 0.99));
        assert!(!passes_where_it_runs_away(0.9, 0.99), "training recordings lack more");
        assert!(!passes_where_it_runs_away(0.999, 0.9), "held-out ones do");
    }

    /// A share of nothing has hundreds of digits.
    #[test]
    fn what_a_law_makes_worse_is_said_without_a_share_of_next_to_nothing() {
        assert_eq!(
            size_in_words(0.994, Some(0.5)),
            "takes 99 % off what noise does not explain, 50 % of the held-out recordings"
        );
        assert_eq!(size_in_words(1.7, None), "takes 100 % off what noise does not explain");
        for worse in [-0.2, -5e300, f64::NEG_INFINITY] {
            let words = size_in_words(0.99, Some(worse));
            assert!(words.ends_with("and makes the held-out recordings worse"), "{words}");
        }
        assert!(rest_in_words(0.5).contains("0.50 times"));
        assert!(!rest_in_words(f64::INFINITY).contains("inf"));
    }

    /// The wave over position that was fitted to what a circuit's cubic spring leaves took all of it off the
    /// multisines that it was trained on, and 9 % off the louder record held out, by 2.9 standard errors.
    #[test]
    fn a_law_that_leaves_most_of_the_held_out_rest_needs_held_out_evidence_beyond_doubt() {
        let passes = |held_out_z: f64, held_out_share: f64, rest: Option<f64>, rest_is_foreign: bool| {
            let of = |z: f64| Improvement { z, worst_z: z, gain_db: 0.3 };
            let parameters = [("force".to_owned(), 1.0, 0.01, 0.0, f64::INFINITY)];
            let closer = Closer { consistency: None, stable: true, rest, cut_short: None, rest_is_foreign };
            let trialled = Trialled {
                training: of(3.9),
                held_out: Some(of(held_out_z)),
                freedom: 1,
                parameters: &parameters,
                amplitudes: &["force".to_owned()],
                explained: 1e4,
                systematic: 1e4,
                held_out_share: Some(held_out_share),
                closer: Some(closer),
            };
            gates(&trialled, &Options::default()).iter().all(|gate| gate.passed)
        };
        assert!(!passes(2.9, 0.09, Some(1.0), false));
        assert!(passes(10.2, 0.43, Some(1.0), false), "beyond doubt");
        assert!(passes(2.9, 0.95, Some(1.0), false), "hardly anything is left there either");
        assert!(passes(2.9, 0.09, Some(1.0), true), "a disturbance, another one in every recording");
        assert!(passes(2.9, 0.09, None, false), "nothing but noise is left");
    }

    #[test]
    fn a_law_may_be_it_if_only_time_a_rest_or_silent_held_out_recordings_refuse_it() {
        let said = |failed: &[&str], z: f64| {
            let gate = |name: &&str| Gate { name: (*name).to_owned(), passed: false, detail: String::new() };
            let passed = Gate { name: "training".to_owned(), passed: true, detail: String::new() };
            let gates: Vec<Gate> = failed.iter().map(gate).chain([passed]).collect();
            may_be_it(&gates, Some(Improvement { z, worst_z: z, gain_db: 0.1 }))
        };
        assert!(said(&[], 3.0) && said(&[UNRIVALLED, SUFFICIENT], 3.0) && said(&[HELD_OUT], 1.0));
        assert!(!said(&[HELD_OUT], -1.0), "they contradict it");
        assert!(!said(&[DETERMINED], 3.0) && !said(&[UNRIVALLED, DETERMINED], 3.0));
    }

    #[test]
    fn a_law_that_held_out_recordings_hardly_show_is_unconfirmed_and_one_that_they_contradict_is_not() {
        let said = |z: f64, others_pass: bool| {
            let gate =
                |name: &str, passed: bool| Gate { name: name.to_owned(), passed, detail: String::new() };
            let gates = [gate("training", others_pass), gate(HELD_OUT, z > 2.5), gate("size", true)];
            is_only_unconfirmed(&gates, Some(Improvement { z, worst_z: z, gain_db: 0.1 }))
        };
        assert!(said(0.2, true));
        assert!(!said(-0.2, true), "contradicted");
        assert!(!said(3.0, true), "confirmed");
        assert!(!said(0.2, false), "not seen in training either");
        assert!(!is_only_unconfirmed(&[], None));
    }

    /// Whether strengths of these values and errors are determined.
    fn determined(strengths: [(&str, f64, f64); 2]) -> bool {
        let parameters = strengths
            .map(|(name, value, stderr)| (name.to_owned(), value, stderr, f64::NEG_INFINITY, f64::INFINITY));
        is_determined(&parameters, &strengths.map(|(name, ..)| name.to_owned()))
    }

    fn is_determined(parameters: &[(String, f64, f64, f64, f64)], amplitudes: &[String]) -> bool {
        let improvement = Improvement { z: 50.0, worst_z: 20.0, gain_db: 20.0 };
        let trialled = Trialled {
            training: improvement,
            held_out: Some(improvement),
            freedom: 2,
            parameters,
            amplitudes,
            explained: 1e4,
            systematic: 1e4,
            held_out_share: Some(1.0),
            closer: None,
        };
        let gates = gates(&trialled, &Options::default());
        gates.iter().find(|gate| gate.name == DETERMINED).unwrap().passed
    }

    #[test]
    fn an_only_strength_need_not_be_well_known_where_its_shape_is() {
        let passes = |stiffness: (f64, f64), distance: (f64, f64)| {
            let parameter = |name: &str, (value, stderr): (f64, f64)| {
                (name.to_owned(), value, stderr, f64::NEG_INFINITY, f64::INFINITY)
            };
            let parameters = [parameter("stiffness", stiffness), parameter("distance", distance)];
            is_determined(&parameters, &["stiffness".to_owned()])
        };
        assert!(passes((6.6e3, 2.4e3), (0.0171, 9e-5)), "touched shortly");
        assert!(!passes((6.6e3, 2.4e3), (0.0171, 9e-3)), "nor is it known where");
        assert!(!passes((6.6e3, 4.0e3), (0.0171, 9e-5)), "hardly more than nothing");
    }

    #[test]
    fn every_strength_is_determined_and_of_two_directions_the_better_known_one() {
        assert!(determined([("force_forward", 0.052, 0.014), ("force_backward", 0.195, 0.014)]));
        assert!(determined([("force_forward", 0.195, 0.014), ("force_backward", 0.0, 0.014)]));
        assert!(!determined([("force_forward", 0.052, 0.014), ("force_backward", 0.195, 0.06)]));
        assert!(!determined([("force", 0.052, 0.014), ("static_force", 0.195, 0.014)]));
        assert!(determined([("force", 0.058, 0.014), ("static_force", 0.195, 0.014)]));
    }

    #[test]
    fn a_cable_that_pushes_is_none() {
        let passes = |id: &str, stiffness: f64| {
            let known = laws().iter().find(|law| law.id() == id).unwrap();
            let law = Physics::new(id, "base").with("stiffness", stiffness);
            pulls_back(*known, &law).map(|gate| gate.passed)
        };
        assert_eq!(passes("cable_spring", 40.0), Some(true));
        assert_eq!(passes("cable_spring", -40.0), Some(false));
        assert_eq!(passes("cubic_stiffness", -40.0), None, "a spring may soften");
    }

    #[test]
    fn a_search_that_time_has_ended_names_what_leaves_nearly_nothing_or_does_what_no_others_do() {
        let own = |own_share: f64| Rivalry { own_share, leads: false, is_kept: false };
        assert!(cut_short(0.999, 0.99, own(0.0)), "nothing is left for another law to do");
        assert!(cut_short(0.66, 0.66, own(0.98)), "a line beside a random force: no other law makes a line");
        assert!(
            !cut_short(0.94, 0.97, own(0.05)),
            "dry friction in place of friction with a dip at low speed"
        );
        assert!(
            !cut_short(0.999, 0.78, own(0.05)),
            "what was fitted is not what is there on other recordings"
        );
        let leads = Rivalry { leads: true, ..own(0.05) };
        assert!(cut_short(0.92, 0.7, leads), "a sensor without a sign: nothing else came near");
        let kept = Rivalry { is_kept: true, ..own(0.02) };
        assert!(cut_short(0.94, 0.93, kept), "all others were looked for in its place");
        assert!(!cut_short(0.7, 0.7, kept), "others may share its work");
    }
}
