//! Naming: which laws of the catalogue the recordings demand.

mod both_exchanged;
pub(crate) mod by_innovations;
mod by_latent_force;
mod from_drawing;
pub(crate) mod gates;
mod gross_laws;
mod guided;
mod guides;
mod hidden_laws;
mod improvement;
mod input_between;
mod judgement;
mod known_from_below;
mod letting_go;
mod lines_over_position;
mod nested;
#[cfg(test)]
pub(crate) mod on_a_spring;
mod other_valleys;
mod pieces;
pub(crate) mod rivals;
pub(crate) mod rounds;
pub(crate) mod same_force;
pub(crate) mod same_lateness;
pub(crate) mod scales;
pub(crate) mod screening;
mod second_tries;
pub(crate) mod selection;
pub(crate) mod sets;
mod sharper_steps;
mod sizing;
mod sketches;
pub(crate) mod stand_ins;
mod superfluous;
pub(crate) mod trials;
mod waves_as_recorded;
mod without_rounding;
