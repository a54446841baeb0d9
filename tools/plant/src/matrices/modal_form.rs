//! From poles and residues to modes, lags and a free motion.

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::hessenberg::Turned;
use super::poles::clusters;
use super::residues::{Part, part};
use super::{Matrices, MatricesProblem};
use crate::model::{Beside, Lag, Quantity, Rigid};
use crate::modes::Mode;

/// A part of the response so small beside the largest of its output is rounding.
const UNSEEN: f64 = 1e-13;
/// The same of a mode's quadrature beside its participation, and of a feedthrough beside what it is the rest
/// of.
pub(crate) const IN_PHASE: f64 = 1e-9;
/// The same of transfer functions, whose coefficients hold fewer digits of their poles and zeros.
pub(crate) const IN_PHASE_OF_POLYNOMIALS: f64 = 1e-8;
/// The same of a growth rate beside the pole.
const NOT_GROWING: f64 = 1e-11;
/// The same of the terms of higher order of poles that coincide.
const FIRST_ORDER: f64 = 1e-11;
/// The modes must give back the system's response as well as this, relative to the largest of each output.
const EXACT: f64 = 1e-9;

/// A system as a modal model has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ModalForm {
    /// Lowest first.
    pub(crate) modes: Vec<Mode>,
    pub(crate) beside: Beside,
}

/// The modes of a system whose outputs are of these quantities, one per row of `C`; what is out of phase by a
/// smaller share than `in_phase` is rounding.
///
/// # Errors
/// [`MatricesProblem`] for what no sum of modes is: growing or coinciding poles, poles that no output shows.
pub(crate) fn modal_form(
    system: &Matrices,
    quantities: &[Quantity],
    in_phase: f64,
) -> Result<ModalForm, MatricesProblem> {
    let turned = Turned::new(system);
    let parts = clusters(&turned.a)?.iter().map(|cluster| part(&turned, cluster)).collect::<Option<_>>();
    let parts = seen(parts.ok_or(MatricesProblem::Inexact)?, &system.d);
    if parts.is_empty() {
        return Err(MatricesProblem::Nothing);
    }
    check_exact(system, &parts)?;
    let (largest, slowest) = (largest(&parts, &system.d), slowest(&parts));
    let mut form = Form {
        quantities,
        in_phase,
        pairs: Vec::new(),
        lags: Vec::new(),
        rigid: None,
        feedthrough: system.d.iter().copied().collect(),
        removed: vec![0.0; quantities.len()],
    };
    for part in parts {
        check_order(&part, &largest, slowest)?;
        form.add(&part)?;
    }
    Ok(form.finished())
}

/// Rate of the slowest pole that is not at zero, 1/s; 1 where there is none.
fn slowest(parts: &[Part]) -> f64 {
    let rates = parts.iter().map(|part| part.centre.norm()).filter(|rate| *rate > 0.0);
    let slowest = rates.fold(f64::INFINITY, f64::min);
    if slowest.is_finite() { slowest } else { 1.0 }
}

/// Per output, the largest steady part of its response.
fn largest(parts: &[Part], d: &DVector<f64>) -> Vec<f64> {
    let rate = slowest(parts);
    let of = |(output, d): (usize, &f64)| {
        parts.iter().map(|part| part.share(output, rate)).fold(d.abs(), f64::max)
    };
    d.iter().enumerate().map(of).collect()
}

/// The parts that some output shows.
fn seen(mut parts: Vec<Part>, d: &DVector<f64>) -> Vec<Part> {
    let (largest, rate) = (largest(&parts, d), slowest(&parts));
    let shows = |part: &Part| {
        largest.iter().enumerate().any(|(output, most)| part.share(output, rate) > UNSEEN * most)
    };
    parts.retain(shows);
    parts
}

fn check_exact(system: &Matrices, parts: &[Part]) -> Result<(), MatricesProblem> {
    let mut rates: Vec<f64> =
        parts.iter().map(|part| part.centre.norm()).filter(|rate| *rate > 0.0).collect();
    if rates.is_empty() {
        rates.push(1.0);
    }
    let outputs = system.c.nrows();
    let (mut most, mut off) = (vec![0.0_f64; outputs], vec![0.0_f64; outputs]);
    // To the right of all poles that do not grow.
    let points = rates.iter().flat_map(|rate| [0.0, 0.7, 1.3].map(|angle| Complex::from_polar(*rate, angle)));
    for s in points {
        let Some(given) = system.response_without_feedthrough(s) else { continue };
        let found = parts.iter().map(|part| part.response(s)).fold(None, |sum, response| match sum {
            None => Some(response),
            Some(sum) => Some(sum + response),
        });
        let Some(found) = found else { continue };
        for output in 0..outputs {
            most[output] = most[output].max(given[output].norm());
            off[output] = off[output].max((given[output] - found[output]).norm());
        }
    }
    let is_exact = off.iter().zip(&most).all(|(off, most)| *off <= EXACT * most);
    if is_exact { Ok(()) } else { Err(MatricesProblem::Inexact) }
}

/// Checks that poles in one place act as poles of first order, or as a free body under a force.
fn check_order(part: &Part, largest: &[f64], slowest: f64) -> Result<(), MatricesProblem> {
    let is_zero = part.centre.norm() == 0.0;
    let (allowed, rate) = if is_zero { (2, slowest) } else { (1, part.centre.norm()) };
    let is_seen = (1..).zip(&part.terms).skip(allowed).any(|(power, term): (i32, _)| {
        let shares = term.iter().map(|entry| entry.norm() / rate.powi(power));
        shares.zip(largest).any(|(share, most)| share > FIRST_ORDER * most)
    });
    let (count, Complex { re, im }) = (part.count, part.centre);
    match (is_seen, is_zero) {
        (false, _) => Ok(()),
        (true, true) => Err(MatricesProblem::FreeFaster { count }),
        (true, false) => Err(MatricesProblem::Coincide { count, re, im }),
    }
}

/// A mode on its way: with its quadrature.
struct Pair {
    mode: Mode,
    quadrature: Vec<f64>,
}

/// The model as it grows pole by pole.
struct Form<'q> {
    quantities: &'q [Quantity],
    in_phase: f64,
    pairs: Vec<Pair>,
    lags: Vec<Lag>,
    rigid: Option<Rigid>,
    feedthrough: Vec<f64>,
    /// Per output, how much its accelerations have taken out of the feedthrough.
    removed: Vec<f64>,
}

impl Form<'_> {
    fn add(&mut self, part: &Part) -> Result<(), MatricesProblem> {
        let Complex { re, im } = part.centre;
        let Some(residues) = part.terms.first() else { return Ok(()) };
        let real = || residues.iter().map(|residue| residue.re).collect::<Vec<f64>>();
        if re > NOT_GROWING * part.centre.norm() {
            return Err(MatricesProblem::Unstable { re, im });
        }
        if im > 0.0 {
            self.add_pair(part.centre, residues);
        } else if re < 0.0 {
            self.lags.push(Lag { time_constant_s: -1.0 / re, participation: real() });
        } else {
            let nothing = || vec![0.0; residues.len()];
            let squares = part.terms.get(1).map(|term| term.iter().map(|entry| entry.re).collect());
            let displacement = squares.unwrap_or_else(nothing);
            self.rigid = Some(Rigid { displacement, velocity: real() });
        }
        Ok(())
    }

    /// A pair of poles: `(rate_share s + value_share) / (s² + 2 zeta omega s + omega²)` at every output.
    fn add_pair(&mut self, pole: Complex<f64>, residues: &DVector<Complex<f64>>) {
        let omega = pole.norm();
        let damping_ratio = (-pole.re / omega).max(0.0);
        let mut pair = Pair {
            mode: Mode { frequency_hz: omega / TAU, damping_ratio, participation: Vec::new() },
            quadrature: Vec::new(),
        };
        for (output, (residue, quantity)) in residues.iter().zip(self.quantities).enumerate() {
            let rate_share = 2.0 * residue.re;
            let value_share = -2.0 * (residue * pole.conj()).re;
            // Participation, quadrature, and what the latter is to be compared with.
            let (participation, mut quadrature, scale) = match quantity {
                Quantity::Position => (value_share, rate_share, 1.0 / omega),
                Quantity::Velocity => (rate_share, value_share, omega),
                Quantity::Acceleration => {
                    let participation = -value_share / (omega * omega);
                    self.feedthrough[output] -= participation;
                    self.removed[output] += participation.abs();
                    (participation, rate_share + 2.0 * damping_ratio * omega * participation, omega)
                }
            };
            if quadrature.abs() <= self.in_phase * scale * participation.abs() {
                quadrature = 0.0;
            }
            pair.mode.participation.push(participation);
            pair.quadrature.push(quadrature);
        }
        self.pairs.push(pair);
    }

    fn finished(mut self) -> ModalForm {
        for (through, removed) in self.feedthrough.iter_mut().zip(&self.removed) {
            if through.abs() <= self.in_phase * removed {
                *through = 0.0;
            }
        }
        self.pairs.sort_by(|a, b| a.mode.frequency_hz.total_cmp(&b.mode.frequency_hz));
        self.lags.sort_by(|a, b| b.time_constant_s.total_cmp(&a.time_constant_s));
        let (modes, quadrature): (Vec<_>, Vec<_>) =
            self.pairs.into_iter().map(|pair| (pair.mode, pair.quadrature)).unzip();
        let unless_zero = |list: Vec<f64>| if list.iter().all(|v| *v == 0.0) { Vec::new() } else { list };
        let has_quadrature = quadrature.iter().flatten().any(|share| *share != 0.0);
        let beside = Beside {
            quadrature: if has_quadrature { quadrature } else { Vec::new() },
            lags: self.lags,
            rigid: self.rigid,
            feedthrough: unless_zero(self.feedthrough),
        };
        ModalForm { modes, beside }
    }
}
