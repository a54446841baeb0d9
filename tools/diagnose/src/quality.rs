//! How well the three models fit, in numbers.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use crate::noise::{NoiseFloor, OutputResidual};
use crate::result::{Fits, PooledFit, Quality, RecordRole, RecordingFit, ThreeFits};
use crate::study::{OnAll, Study};

/// Sums that qualities are made of.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: f64,
    count: f64,
    /// Sum of squares of the recorded output about its mean.
    output: f64,
}

impl Sums {
    fn of(part: &OutputResidual<'_>) -> Self {
        let samples = &part.record.outputs[part.output].samples;
        let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
        Self {
            squares: dot(&part.residual, &part.residual),
            count: part.residual.len() as f64,
            output: samples.iter().map(|value| (value - mean).powi(2)).sum(),
        }
    }

    fn add(&mut self, other: Self) {
        self.squares += other.squares;
        self.count += other.count;
        self.output += other.output;
    }

    fn quality(self, floor: f64) -> Quality {
        let rms = (self.squares / self.count.max(1.0)).sqrt();
        Quality { rms, nrmse: (self.squares / self.output).sqrt(), noise_floor: floor }
    }
}

/// The contract's `fit`, for outputs named by `columns`.
pub(crate) fn fits(
    study: &Study,
    columns: &[String],
    models: [&OnAll; 2],
    extended: Option<&OnAll>,
    floors: &[Option<NoiseFloor>],
) -> Fits {
    let mut fits = Fits::default();
    for (index, column) in columns.iter().enumerate() {
        let Some(floor) = &floors[index] else { continue };
        let parts: Vec<Vec<OutputResidual<'_>>> =
            models.iter().copied().chain(extended).map(|on_all| study.parts(on_all, index)).collect();
        let three = |sums: &[Sums]| ThreeFits {
            given: sums[0].quality(floor.rms),
            refitted_linear: sums[1].quality(floor.rms),
            extended: sums.get(2).map(|sums| sums.quality(floor.rms)),
        };
        for role in [Role::Train, Role::HeldOut] {
            let mut pooled = vec![Sums::default(); parts.len()];
            let mut any = false;
            for place in 0..parts[0].len() {
                let record = parts[0][place].record;
                if record.role != role {
                    continue;
                }
                any = true;
                let sums: Vec<Sums> = parts.iter().map(|parts| Sums::of(&parts[place])).collect();
                pooled.iter_mut().zip(&sums).for_each(|(pool, sums)| pool.add(*sums));
                fits.recordings.push(RecordingFit {
                    recording: record.name.clone(),
                    role: role_of(role),
                    output: column.clone(),
                    fits: three(&sums),
                });
            }
            if any {
                fits.pooled.push(PooledFit {
                    role: role_of(role),
                    output: column.clone(),
                    noise_source: floor.source,
                    fits: three(&pooled),
                });
            }
        }
    }
    fits
}

/// The role as the JSON says it.
pub(crate) fn role_of(role: Role) -> RecordRole {
    match role {
        Role::Train => RecordRole::Train,
        Role::HeldOut => RecordRole::HeldOut,
    }
}
