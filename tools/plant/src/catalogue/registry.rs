//! From a `[[physics]]` table to its law, its place in the model and its units.

use super::law::{Action, Given, Law, ParameterSpec, Place, Structure};
use super::laws;
use crate::model::{DRIVING_POINT, GROUND, InvalidParameter, Model, Physics, Problem, unit_of};
use crate::modes::Mode;

/// A law at a place where this model lets it sit: what a diagnosis may try.
#[derive(Clone, Copy)]
pub struct Candidate {
    /// The law.
    pub law: &'static dyn Law,
    /// Index into [`Model::locations`].
    pub location: usize,
}

impl std::fmt::Debug for Candidate {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} at location {}", self.law.id(), self.location)
    }
}

impl Model {
    /// Names of all places of this model at which laws of the catalogue may sit.
    pub fn locations(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        match self {
            Self::BeamOnBase(_) => names.extend(["base", "beam", "tip"].map(str::to_owned)),
            Self::Modal(model) => {
                names.push("base".to_owned());
                names.extend((1..=model.modes.len()).map(|number| format!("mode {number}")));
                names.push(DRIVING_POINT.to_owned());
            }
            Self::Lumped(model) => {
                let free = |name: &str| model.moved_body() != Some(name);
                let all = || model.bodies.iter().map(|body| body.name.as_str());
                names.extend(all().filter(|name| free(name)).map(str::to_owned));
                for (index, first) in all().enumerate() {
                    names.extend(all().skip(index + 1).map(|second| format!("{first}-{second}")));
                }
            }
        }
        // A place without any law, such as a base that nothing but the input moves, is left out.
        names.retain(|name| place_of(self, name).is_some());
        names.extend(["drive", "sensor", "environment"].map(str::to_owned));
        names
    }
}

/// What kind of place a location is in this model; `None` if the model has no such place.
pub fn place_of(model: &Model, location: &str) -> Option<Place> {
    match location {
        "drive" => return Some(Place::Drive),
        "sensor" => return Some(Place::Sensor),
        "environment" => return Some(Place::Environment),
        _ => {}
    }
    let is_mode = |modes: usize| {
        let number = location.strip_prefix("mode ")?.parse::<usize>().ok()?;
        (1..=modes).contains(&number).then_some(Place::Part)
    };
    match model {
        Model::BeamOnBase(beam) => match location {
            "base" => Some(Place::Base),
            "beam" | "tip" => Some(Place::Beam),
            _ => is_mode(beam.beam.modes),
        },
        Model::Modal(modal) => match location {
            "base" if model.input_is_motion() => Some(Place::Base),
            // A further mode belongs to the structure as a whole.
            "beam" => Some(Place::Beam),
            DRIVING_POINT => modal.driving_output().map(|_| Place::Part),
            _ => is_mode(modal.modes.len()),
        },
        Model::Lumped(lumped) => {
            let known = |name: &str| lumped.bodies.iter().any(|body| body.name == name);
            match location.split_once('-') {
                None => (known(location) && lumped.moved_body() != Some(location)).then_some(Place::Part),
                Some((first, second)) => {
                    let one_moves = known(first) && known(second) && first != second;
                    (one_moves && first != GROUND).then_some(Place::Part)
                }
            }
        }
    }
}

/// All laws at all places of a model.
pub fn candidates(model: &Model) -> Vec<Candidate> {
    let mut found = Vec::new();
    for (location, name) in model.locations().iter().enumerate() {
        for &law in laws() {
            if admit(law, model, name).is_ok() {
                found.push(Candidate { law, location });
            }
        }
    }
    found
}

/// The law that a `[[physics]]` table means: that of its id which may sit at its location.
///
/// # Errors
/// [`InvalidParameter`] for an unknown id, or a location where no law of that id can act.
pub fn find(model: &Model, physics: &Physics) -> Result<&'static dyn Law, InvalidParameter> {
    let named: Vec<_> = laws().iter().copied().filter(|law| law.id() == physics.id).collect();
    let mut refused = None;
    for law in &named {
        match admit(*law, model, &physics.location) {
            Ok(()) => return Ok(*law),
            Err(remedy) => refused = Some(remedy),
        }
    }
    match refused {
        Some(remedy) => {
            let what = format!("{} cannot sit at \"{}\"", physics.id, physics.location);
            Err(InvalidParameter::new("location", Problem::LawPlace { what, remedy }))
        }
        None => {
            let mut allowed: Vec<String> = laws().iter().map(|law| law.id().to_owned()).collect();
            allowed.dedup();
            let found = physics.id.clone();
            Err(InvalidParameter::new("id", Problem::UnknownLaw { found, allowed }))
        }
    }
}

/// `Ok` when the law may sit there, otherwise what to do instead.
fn admit(law: &dyn Law, model: &Model, location: &str) -> Result<(), String> {
    let Some(place) = place_of(model, location) else {
        return Err(format!("this model has the places {}", model.locations().join(", ")));
    };
    if !law.places().contains(&place) {
        let fitting: Vec<String> = model
            .locations()
            .into_iter()
            .filter(|name| place_of(model, name).is_some_and(|place| law.places().contains(&place)))
            .collect();
        return Err(if fitting.is_empty() {
            "this kind of model has no place for it".to_owned()
        } else {
            format!("it can sit at {}", fitting.join(", "))
        });
    }
    if let Some(objection) = law.objection(model, location) {
        return Err(objection.to_owned());
    }
    let ideal_base = place == Place::Base && model.input_is_motion() && model.servo().is_none();
    if ideal_base && law.id() != "backlash" {
        return Err("the input prescribes the motion of the base, so no force can change it; use a force as input, or give the model a [drive]".to_owned());
    }
    if place == Place::Beam && matches!(model, Model::Modal(_)) && law.id() != "extra_mode" {
        return Err("a modal model has modes in place of a beam; name one, such as \"mode 1\"".to_owned());
    }
    if place == Place::Drive && law.id() == "force_ripple" {
        let knows_place = match model {
            Model::Modal(_) => model.servo().is_some(),
            Model::Lumped(_) => !model.input_is_motion(),
            Model::BeamOnBase(_) => !model.input_is_motion() || model.servo().is_some(),
        };
        if !knows_place {
            return Err("a force that varies with place needs a model whose drive exerts a force: a force as input, or a [drive]".to_owned());
        }
    }
    if place == Place::Drive && model.input().is_none() {
        return Err("a free decay has no drive; add an [input]".to_owned());
    }
    Ok(())
}

/// Parameters of a law at a place, with units spelled out: name, unit, bounds, default.
pub fn parameters_of(model: &Model, law: &dyn Law, location: &str) -> Vec<(ParameterSpec, String)> {
    let (z, force) = units_at(model, location);
    let input = model.input().map(|input| unit_of(&input.column)).unwrap_or_default();
    let output = model.output_columns().first().map(|column| unit_of(column)).unwrap_or_default();
    let spell = |template: &str| {
        template.replace("{F}", &force).replace("{z}", &z).replace("{u}", &input).replace("{y}", &output)
    };
    law.parameters().iter().map(|spec| (*spec, spell(spec.unit))).collect()
}

/// Units of displacement and force at a place.
fn units_at(model: &Model, location: &str) -> (String, String) {
    let of = |z: &str, force: &str| (z.to_owned(), force.to_owned());
    match model {
        Model::Lumped(model) => (model.displacement_unit(), model.force_unit()),
        Model::BeamOnBase(_) if location.starts_with("mode ") => {
            if model.input_is_motion() {
                of("m", "m/s²")
            } else {
                of("m·√kg", "m·√kg/s²")
            }
        }
        Model::BeamOnBase(_) => of("m", "N"),
        Model::Modal(_) if location == "base" => of("m", "m/s²"),
        Model::Modal(modal) if location == DRIVING_POINT => modal.driving_units(),
        Model::Modal(modal) => {
            let position =
                modal.outputs.iter().find(|output| output.quantity == crate::model::Quantity::Position);
            let unit = position.map(|output| unit_of(&output.column)).filter(|unit| !unit.is_empty());
            let unit = unit.unwrap_or_else(|| "m".to_owned());
            (unit.clone(), format!("{unit}/s²"))
        }
    }
}

/// What the parameter list of a model shows of one `[[physics]]` table; nothing for one that is not valid.
pub(crate) fn bounds(model: &Model, physics: &Physics) -> Vec<(String, String, (f64, f64), f64)> {
    let Ok(law) = find(model, physics) else { return Vec::new() };
    let parameters = parameters_of(model, law, &physics.location).into_iter();
    parameters
        .map(|(spec, unit)| (spec.name.to_owned(), unit, (spec.lower, spec.upper), spec.default))
        .collect()
}

/// Checks every `[[physics]]` table of a model.
pub(crate) fn check(model: &Model) -> Result<(), InvalidParameter> {
    for (number, physics) in (1..).zip(&model.setup().physics) {
        check_one(model, physics).map_err(|invalid| {
            InvalidParameter::new(format!("physics.{number}.{}", invalid.key), invalid.problem)
        })?;
    }
    Ok(())
}

fn check_one(model: &Model, physics: &Physics) -> Result<(), InvalidParameter> {
    let law = find(model, physics)?;
    if let Some(on) = &physics.on {
        let place = place_of(model, on);
        if !matches!(place, Some(Place::Base | Place::Beam | Place::Part)) {
            let what = format!("{} cannot act on \"{on}\"", physics.id);
            let remedy = format!("this model has the places {}", model.locations().join(", "));
            return Err(InvalidParameter::new("on", Problem::LawPlace { what, remedy }));
        }
    }
    let specs = parameters_of(model, law, &physics.location);
    for (name, &value) in &physics.parameters {
        let key = format!("parameters.{name}");
        let Some((spec, unit)) = specs.iter().find(|(spec, _)| spec.name == name) else {
            let allowed = specs.iter().map(|(spec, _)| spec.name.to_owned()).collect();
            let law = physics.id.clone();
            return Err(InvalidParameter::new(key, Problem::LawParameter { law, allowed }));
        };
        if !(spec.lower..=spec.upper).contains(&value) {
            let (lower, upper, unit) = (spec.lower, spec.upper, unit.clone());
            return Err(InvalidParameter::new(key, Problem::OutOfBounds { value, lower, upper, unit }));
        }
    }
    Ok(())
}

/// A law put to work at a point where the linear model has this stiffness.
pub(crate) fn action(model: &Model, physics: &Physics, stiffness: f64) -> Result<Action, InvalidParameter> {
    let law = find(model, physics)?;
    Ok(law.action(&Given {
        values: &physics.parameters,
        parameters: law.parameters(),
        stiffness,
        moves_base: physics.location == "base" && model.input_is_motion(),
    }))
}

/// The model with its linear left-out physics built in, and the further modes among it.
pub(crate) fn structure(model: &Model) -> Result<(Model, Vec<Mode>), InvalidParameter> {
    let mut changed = model.clone();
    let mut modes = Vec::new();
    for physics in &model.setup().physics {
        let Action::Structure(structure) = action(model, physics, 0.0)? else { continue };
        match (structure, &mut changed) {
            (Structure::Mode(mode), _) => modes.push(mode),
            (Structure::TipMass(mass_kg), Model::BeamOnBase(beam)) => {
                beam.beam.fittings.tip_mass_kg += mass_kg;
            }
            (Structure::ClampCompliance(compliance), Model::BeamOnBase(beam)) if compliance > 0.0 => {
                let rigid = beam.beam.fittings.clamp_stiffness_n_m_rad;
                let before = rigid.map_or(0.0, |stiffness| 1.0 / stiffness);
                beam.beam.fittings.clamp_stiffness_n_m_rad = Some(1.0 / (before + compliance));
            }
            _ => {}
        }
    }
    Ok((changed, modes))
}
