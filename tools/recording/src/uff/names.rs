//! What the columns and spectra of a universal file are called.

use std::collections::HashMap;

use super::function::Function;
use super::units;
use crate::column_name::unit_of;

/// Names of time responses; `None` where no unit is stated. Functions alike in everything that makes up a
/// name are told apart by their titles or, where these are alike too, by their numbers.
pub(super) fn column_names(functions: &[Function], si: bool) -> Vec<Option<String>> {
    let names: Vec<Option<String>> =
        functions.iter().map(|function| column_name(function, si, None)).collect();
    let titles: Vec<Option<String>> = functions
        .iter()
        .map(|function| column_name(function, si, slug(&function.title).as_deref()))
        .collect();
    let (alike, titled_alike) = (counts(&names), counts(&titles));
    let numbered =
        |number: usize| column_name(functions.get(number - 1)?, si, Some(&format!("function_{number}")));
    (1..)
        .zip(names.iter().zip(&titles))
        .map(|(number, (name, title))| match name {
            Some(name) if alike.get(name).is_some_and(|count| *count > 1) => match title {
                Some(title) if titled_alike.get(title) == Some(&1) && !alike.contains_key(title) => {
                    Some(title.clone())
                }
                _ => numbered(number),
            },
            other => other.clone(),
        })
        .collect()
}

fn counts(names: &[Option<String>]) -> HashMap<String, usize> {
    let mut counts = HashMap::new();
    for name in names.iter().flatten() {
        *counts.entry(name.clone()).or_insert(0) += 1;
    }
    counts
}

/// The title where it is a column's name, else quantity, node and direction, or `instead` of the last two.
fn column_name(function: &Function, si: bool, instead: Option<&str>) -> Option<String> {
    let unit = function.ordinate.unit(si)?;
    let plain = function.title.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    if plain && instead.is_none() && unit_of(&function.title) == Some(unit.as_str()) {
        return Some(function.title.clone());
    }
    let quantity = units::quantity(function.ordinate.data_type);
    let place = instead.map_or_else(|| function.response.suffix(), |instead| format!("_{instead}"));
    Some(format!("{quantity}{place}_{unit}"))
}

/// A title as part of a name; `None` where nothing is left of it.
fn slug(title: &str) -> Option<String> {
    let words = title.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    let slug = words.collect::<Vec<_>>().join("_").to_lowercase();
    (!slug.is_empty() && slug != "none").then_some(slug)
}

/// Names of functions of frequency, unique.
pub(super) fn spectrum_names(functions: &[&Function]) -> Vec<String> {
    let name = |function: &&Function| {
        let quantity = units::quantity(function.ordinate.data_type);
        let response = format!("{quantity}{}", function.response.suffix());
        match function.kind {
            super::spectra::FREQUENCY_RESPONSE | super::spectra::TRANSMISSIBILITY => {
                let excitation = units::quantity(function.denominator.data_type);
                format!("{response}_over_{excitation}{}", function.reference.suffix())
            }
            _ => response,
        }
    };
    let names: Vec<String> = functions.iter().map(name).collect();
    let mut seen = HashMap::new();
    let mut unique = Vec::with_capacity(names.len());
    for (number, name) in (1..).zip(names) {
        let count = seen.entry(name.clone()).or_insert(0_usize);
        *count += 1;
        unique.push(if *count > 1 { format!("{name}_function_{number}") } else { name });
    }
    unique
}
