//! Naming: which laws of the catalogue the recordings demand.

pub(crate) mod gates;
pub(crate) mod scales;
pub(crate) mod screening;
pub(crate) mod selection;
pub(crate) mod trials;
