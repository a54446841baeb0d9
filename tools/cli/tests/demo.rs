//! The main job on the core: everything is written, and the results are what they must be.

use crate::support;

use std::time::{Duration, Instant};

use stillbeam::demo::summary::Summary;
use stillbeam_shape::ShaperDesign;
use support::stillbeam;

#[test]
fn the_demo_on_the_core_writes_everything_and_stills_the_beam() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let began = Instant::now();
    let run = stillbeam(&["demo", "--out", out.to_str().unwrap()]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(began.elapsed() < Duration::from_secs(60), "{:?}", began.elapsed());
    assert!(run.messages.contains("simulated") && run.messages.contains("100 %"), "{}", run.messages);

    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let summary: Summary = serde_json::from_str(&read("summary.json")).unwrap();
    assert_eq!((summary.schema_version, summary.board.as_str()), (1, "core"));
    let names: Vec<&str> = summary.moves.iter().map(|result| result.shaper.as_str()).collect();
    let expected = [
        "none",
        "single-mode zv",
        "single-mode zvd",
        "single-mode zvdd",
        "two-mode zv",
        "two-mode zvd",
        "two-mode zvdd",
    ];
    assert_eq!(names, expected);

    // The beam was given 1.1 and 6.9 Hz (to its file's four digits), 0.0074 and 0.0033.
    for (mode, (hz, zeta)) in summary.modes.iter().zip([(1.1, 0.0074), (6.9, 0.0033)]) {
        assert!((mode.frequency_hz.value / hz - 1.0).abs() < 1e-3, "{mode:?}");
        assert!((mode.damping_ratio.value / zeta - 1.0).abs() < 0.02, "{mode:?}");
    }

    let [none, single @ .., _, _, _] = summary.moves.as_slice() else { panic!("{names:?}") };
    let two = &summary.moves[4..];
    assert!((none.percentage_vibration_pct - 100.0).abs() < 1e-9);
    for (single, two) in single.iter().zip(two) {
        // The second mode is left over, as the paper found.
        assert!((1.0..20.0).contains(&single.percentage_vibration_pct), "{single:?}");
        assert!(two.percentage_vibration_pct < 0.05, "{two:?}");
        assert!(two.overshoot_pct < single.overshoot_pct, "{single:?} {two:?}");
        assert!(two.settling_time_s.unwrap() < single.settling_time_s.unwrap());
        assert!(single.mode_vibration_pct[0] < 0.05 && single.mode_vibration_pct[1] > 1.0, "{single:?}");
    }
    // Robustness costs time.
    assert!(two.windows(2).all(|pair| pair[0].settling_time_s < pair[1].settling_time_s));

    for result in &summary.moves {
        let recording = stillbeam_recording::read_csv(&out.join(&result.setpoint_csv)).unwrap();
        assert_eq!(recording.column("setpoint_m").unwrap().last(), Some(&0.05), "{}", result.shaper);
        if result.shaper != "none" {
            let file = out.join(format!("shaper-{}.json", result.shaper.replace(' ', "-")));
            let design = ShaperDesign::read(&file).unwrap();
            assert_eq!(design.crc32.to_string(), result.crc32);
        }
        assert!(run.out.contains(&result.shaper), "{}", run.out);
    }
    // The paper's first row.
    assert!(run.out.contains("22.04") && run.out.contains("5.83"), "{}", run.out);
    let sweep = stillbeam_recording::read_csv(&out.join("sweep.csv")).unwrap();
    let frames = sweep.column("tip_deflection_m").unwrap().iter().filter(|tip_m| !tip_m.is_nan()).count();
    // The camera sees 100 frames a second, from the first sample to the last.
    let expected = (100.0 * sweep.duration_s()).floor() as usize + 1;
    assert_eq!(frames, expected, "{frames} of {}", sweep.len());
    let report = read("report.html");
    assert!(report.matches("<svg").count() >= 9 && report.ends_with("</html>"));
    // One file that fetches nothing; its script makes the charts answer to the pointer.
    assert!(!report.contains("http://") && !report.contains("https://") && !report.contains("<script src"));
    assert_eq!(report.matches("<script>").count(), 1);
}
