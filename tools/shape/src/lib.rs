//! Stillbeam shape.
