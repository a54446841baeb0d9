//! Stillbeam plant.
