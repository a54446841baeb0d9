//! The brown-out level by the console: asked for with the drive off only, and reported as the option bytes
//! hold it.

use stillbeam_firmware::brown_out::BrownOut;
use stillbeam_host_tests::bench::Bench;

fn level(bench: &mut Bench) -> String {
    let reply = bench.send("info");
    reply.iter().find_map(|line| line.strip_prefix("brown_out ")).expect("in info").to_owned()
}

#[test]
fn a_level_is_written_by_its_name_and_shown_by_info() {
    let mut bench = Bench::new();
    bench.tick();
    assert_eq!(level(&mut bench), "unknown");
    for name in ["level_3", "off", "level_1", "level_2"] {
        assert_eq!(bench.accept(&format!("brownout set {name}")), format!("ok brownout level={name}"));
        assert_eq!(level(&mut bench), name);
    }
}

#[test]
fn a_level_that_the_option_bytes_do_not_take_is_refused_with_the_one_they_keep() {
    let mut bench = Bench::new();
    bench.tick();
    bench.stick_brown_out_at(BrownOut::Off);
    let refusal = bench.refuse("brownout set level_3");
    assert!(refusal.starts_with("err flash brownout: the level is still off"), "{refusal}");
    assert_eq!(level(&mut bench), "off");
}

#[test]
fn an_enabled_drive_or_a_word_that_is_no_level_changes_nothing() {
    let mut bench = Bench::enabled();
    assert!(bench.refuse("brownout set level_3").starts_with("err fault brownout: "));
    bench.disable();
    for line in ["brownout", "brownout set", "brownout set level_4", "brownout set off off", "brownout off"] {
        assert!(bench.refuse(line).starts_with("err syntax brownout: usage: brownout set "), "{line}");
    }
    assert_eq!(level(&mut bench), "unknown");
}
