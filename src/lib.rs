//! Portable core.
#![no_std]
