//! Stillbeam identify.
