//! Tells the linker of the image where its scripts are.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        if let Ok(root) = env::var("CARGO_MANIFEST_DIR") {
            // memory.x is included by cortex-m-rt's link.x.
            println!("cargo:rustc-link-search={root}");
        }
        if env::var_os("CARGO_FEATURE_DEFMT").is_some() {
            println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
        }
    }
}
