//! Emulator driver and fixtures.
