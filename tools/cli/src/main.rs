//! The stillbeam command.
fn main() {
    let (mut out, mut messages) = (std::io::stdout(), std::io::stderr());
    let mut streams = stillbeam::streams::Streams { out: &mut out, messages: &mut messages };
    let r = stillbeam::demo::run(
        &stillbeam::board::BoardTarget::Core,
        std::path::Path::new("/tmp/demo1"),
        &mut streams,
    )
    .unwrap();
    println!("{}", stillbeam::demo::results_table(&r));
}
