//! Modes of the beam: the eigenproblem of eq. 24, with the base held and with the base free.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::beam::{Galerkin, basis_functions, galerkin};
use crate::error::PlantError;
use crate::model::BeamOnBase;

/// One mode `q'' + 2 zeta omega q' + omega² q = s(t)`, and what each output sees of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency in hertz, above 0.
    pub frequency_hz: f64,
    /// Damping ratio, 0 to below 1.
    pub damping_ratio: f64,
    /// Contribution of `q` to each output, one per output.
    pub participation: Vec<f64>,
}

impl Mode {
    /// Undamped natural frequency in rad/s.
    pub fn omega_rad_s(&self) -> f64 {
        TAU * self.frequency_hz
    }

    /// Damped natural frequency in rad/s.
    pub fn damped_omega_rad_s(&self) -> f64 {
        self.omega_rad_s() * (1.0 - self.damping_ratio * self.damping_ratio).sqrt()
    }

    /// `zeta omega` in 1/s: the rate at which a free vibration decays.
    pub fn decay_per_s(&self) -> f64 {
        self.damping_ratio * self.omega_rad_s()
    }
}

/// A mode of the beam with its base held, in mass-normalised coordinates (modal mass 1 kg).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClampedMode {
    /// Undamped natural frequency in rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio: the model's, or eq. 22.
    pub damping_ratio: f64,
    /// `phi_r · h` in √kg: how the base's acceleration drives the mode.
    pub coupling: f64,
    /// `phi_r(l)` in 1/√kg: what the tip sees.
    pub tip: f64,
}

impl ClampedMode {
    /// Tip participation `Gamma_r = (phi_r · h) phi_r(l)`, dimensionless, so that with
    /// `q_r'' + 2 zeta_r omega_r q_r' + omega_r² q_r = −y''` the tip's deflection is `Σ Gamma_r q_r`.
    ///
    /// Independent of how the mode is normalised; 1.566 for the first mode of a uniform beam. Over all modes
    /// it sums to one: infinitely fast base motion leaves the tip where it is.
    pub fn tip_participation(&self) -> f64 {
        self.coupling * self.tip
    }

    /// The same mode as a [`Mode`] whose only output is the tip's deflection under base motion.
    pub fn to_mode(self) -> Mode {
        Mode {
            frequency_hz: self.omega_rad_s / TAU,
            damping_ratio: self.damping_ratio,
            participation: vec![self.tip_participation()],
        }
    }
}

/// The modes with the base *held*, lowest first, as many as the model keeps.
///
/// They are what vibrates after a move made by a stiff servo, hence what shapers are designed for.
///
/// # Errors
/// [`PlantError::Invalid`] or [`PlantError::Degenerate`].
pub fn clamped_modes(model: &BeamOnBase) -> Result<Vec<ClampedMode>, PlantError> {
    model.check()?;
    let beam = galerkin(&model.beam, basis_functions(model.beam.modes))?;
    let mut modes = clamped_spectrum(model, &beam)?;
    modes.truncate(model.beam.modes);
    Ok(modes)
}

/// Mass that a servo moves: base, beam and what sits at its tip, kg.
pub(crate) fn moved_mass_kg(model: &BeamOnBase) -> Result<f64, PlantError> {
    Ok(model.base_mass_kg + galerkin(&model.beam, 1)?.beam_mass_kg)
}

/// As many clamped modes as there are basis functions; the highest are no more than numbers.
fn clamped_spectrum(model: &BeamOnBase, beam: &Galerkin) -> Result<Vec<ClampedMode>, PlantError> {
    let (omegas_rad_s, vectors) = eigenmodes(&beam.mass_kg, beam.stiffness_n_m.clone())?;
    let modes = omegas_rad_s.iter().zip(vectors.column_iter()).enumerate();
    let modes = modes.map(|(index, (&omega_rad_s, vector))| ClampedMode {
        omega_rad_s,
        damping_ratio: model.beam.damping_ratio(index, omega_rad_s),
        coupling: vector.dot(&beam.coupling_kg),
        tip: vector.dot(&beam.tip),
    });
    Ok(modes.collect())
}

/// Base and beam as one structure, driven by a force on the base: the modes of eq. 12, reduced.
///
/// Coordinates are mass-normalised: `eta'' + D eta' + Λ eta = base · u`, entry 0 being the rigid translation
/// and the rest the flexible modes kept. `D` is full, because damping of the beam and of the base do not
/// share the modes of the undamped structure.
#[derive(Debug, Clone, PartialEq)]
pub struct CoupledModes {
    /// Undamped natural frequencies in rad/s; entry 0 is 0.
    pub omega_rad_s: Vec<f64>,
    /// `D` in 1/s, symmetric.
    pub damping_per_s: DMatrix<f64>,
    /// Base position per coordinate, 1/√kg.
    pub base: Vec<f64>,
    /// Tip deflection relative to the base per coordinate, 1/√kg; entry 0 is 0.
    pub tip_deflection: Vec<f64>,
}

impl CoupledModes {
    /// Frequency (hertz) and damping ratio of the flexible modes, lowest first: what a force-driven sweep
    /// shows.
    ///
    /// The ratio neglects the off-diagonal entries of `D`, an error of second order in the damping.
    pub fn flexible(&self) -> Vec<(f64, f64)> {
        let diagonal = self.damping_per_s.diagonal();
        let modes = self.omega_rad_s.iter().zip(diagonal.iter()).skip(1);
        modes.map(|(&omega, &damping)| (omega / TAU, damping / (2.0 * omega))).collect()
    }
}

/// The modes with the base *free* under force: rigid translation and as many flexible modes as the model
/// keeps.
///
/// The problem is set up in the clamped modes, all of them, which span the same space as the basis of eq. 9:
/// `M = [[J, gᵀ], [g, 1]]`, `K = diag(0, omega²)`, `C = diag(viscous, 2 zeta omega)`. So the damping of a
/// model file means the same beam whether its base is held or free. A flexible mode moves no momentum, `J y +
/// g · eta = 0`, which takes the base out of the eigenproblem and leaves `M = 1 − g gᵀ / J`; the rigid
/// translation is known without it.
///
/// # Errors
/// [`PlantError::Invalid`] or [`PlantError::Degenerate`].
pub fn coupled_modes(model: &BeamOnBase) -> Result<CoupledModes, PlantError> {
    model.check()?;
    let beam = galerkin(&model.beam, basis_functions(model.beam.modes))?;
    let clamped = clamped_spectrum(model, &beam)?;
    let size = clamped.len();
    let total_mass_kg = model.base_mass_kg + beam.beam_mass_kg;
    let per_mode =
        |value: &dyn Fn(&ClampedMode) -> f64| DVector::from_iterator(size, clamped.iter().map(value));
    let coupling = per_mode(&|mode| mode.coupling);
    let tip = per_mode(&|mode| mode.tip);
    let stiffness = per_mode(&|mode| mode.omega_rad_s * mode.omega_rad_s);
    let damping = per_mode(&|mode| 2.0 * mode.damping_ratio * mode.omega_rad_s);
    let mass = DMatrix::identity(size, size) - &coupling * coupling.transpose() / total_mass_kg;
    let (flexible_rad_s, shapes) = eigenmodes(&mass, DMatrix::from_diagonal(&stiffness))?;
    let kept = shapes.columns(0, model.beam.modes);
    let rigid = 1.0 / total_mass_kg.sqrt();
    let flexible_base = -(kept.transpose() * &coupling) / total_mass_kg;
    let base = flexible_base.insert_row(0, rigid);
    let beam_damping = kept.transpose() * DMatrix::from_diagonal(&damping) * kept;
    let damping_per_s = beam_damping.insert_row(0, 0.0).insert_column(0, 0.0)
        + model.base_viscous_n_s_m * &base * base.transpose();
    let flexible_rad_s = flexible_rad_s.into_iter().take(model.beam.modes);
    Ok(CoupledModes {
        omega_rad_s: std::iter::once(0.0).chain(flexible_rad_s).collect(),
        damping_per_s,
        tip_deflection: std::iter::once(0.0).chain((kept.transpose() * tip).iter().copied()).collect(),
        base: base.iter().copied().collect(),
    })
}

/// Solves `K v = omega² M v`: circular frequencies in rad/s, ascending, and vectors with `vᵀ M v = 1` as
/// columns.
///
/// The solver's error is rounding times the *largest* eigenvalue, so the problem is turned round, `M v =
/// omega⁻² K v`: the lowest modes, which count, then have the largest eigenvalues and all their digits.
///
/// # Errors
/// [`PlantError::Degenerate`] when either matrix is not positive definite.
fn eigenmodes(mass: &DMatrix<f64>, stiffness: DMatrix<f64>) -> Result<(Vec<f64>, DMatrix<f64>), PlantError> {
    let size = mass.nrows();
    let factor = Cholesky::new(stiffness).ok_or(PlantError::Degenerate)?;
    let lower = factor.unpack();
    let half = lower.solve_lower_triangular(mass).ok_or(PlantError::Degenerate)?;
    let reduced = lower.solve_lower_triangular(&half.transpose()).ok_or(PlantError::Degenerate)?;
    // Rounding leaves it slightly unsymmetric, and the solver reads one triangle only.
    let symmetric = 0.5 * (&reduced + reduced.transpose());
    // The solver turns for ever on a NaN.
    if !symmetric.iter().all(|entry| entry.is_finite()) {
        return Err(PlantError::Degenerate);
    }
    let eigen =
        SymmetricEigen::try_new(symmetric, f64::EPSILON, 100 * size.max(10)).ok_or(PlantError::Degenerate)?;
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_unstable_by(|&a, &b| f64::total_cmp(&eigen.eigenvalues[b], &eigen.eigenvalues[a]));
    let mut omegas_rad_s = Vec::with_capacity(size);
    let mut vectors = DMatrix::zeros(size, size);
    for (place, &index) in order.iter().enumerate() {
        let eigenvalue = eigen.eigenvalues[index];
        if !(eigenvalue.is_finite() && eigenvalue > 0.0) {
            return Err(PlantError::Degenerate);
        }
        let omega_rad_s = 1.0 / eigenvalue.sqrt();
        omegas_rad_s.push(omega_rad_s);
        vectors.set_column(place, &(eigen.eigenvectors.column(index) * omega_rad_s));
    }
    let vectors = lower.transpose().solve_upper_triangular(&vectors).ok_or(PlantError::Degenerate)?;
    Ok((omegas_rad_s, vectors))
}
