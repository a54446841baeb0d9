//! Stillbeam recording.
