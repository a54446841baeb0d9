//! Motions that `simulate` refuses: told in the words of its command line.

use crate::support;

use support::{paper_beam, stillbeam};

#[test]
fn a_refused_motion_names_the_command_and_no_setting_of_a_board() {
    let beam = paper_beam();
    let cases = [
        ("sweep exponential 0.5 16 60 1000mm/s2", "101.3 mm; it has to be from 0.00001 mm to 100 mm"),
        ("move 5000", "5000 mm"),
        ("sweep linear 0.5 16 60 90mm", "ask for a smaller amplitude or a lower highest frequency"),
        ("sweep exponential 0.5 1600 60 1mm", "TO_HZ is 1600 Hz"),
    ];
    for (command, part) in cases {
        let run = stillbeam(&["simulate", &beam, "--command", command]);
        assert_eq!(run.code, 2, "{}", run.messages);
        assert!(run.messages.contains(part), "{command}: {}", run.messages);
        assert!(!run.messages.contains("move.") && !run.messages.contains("raise"), "{}", run.messages);
    }
}
