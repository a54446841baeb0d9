//! Prints docs/results/still_beam.md.

fn main() {
    print!("{}", stillbeam_host_tests::still_beam::results_page());
}
