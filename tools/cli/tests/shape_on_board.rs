//! The shortest shaper on the in-process board: what it streams is what the host computed, and modes at the
//! corners of their boxes keep no more than the tolerance.

use stillbeam::board::BoardTarget;
use stillbeam::command_signal::{MotionCommand, shaped_setpoints_m};
use stillbeam_plant::{Mode, PrescribedBase, ResidualVibration};
use stillbeam_shape::{BoardTable, ModeBox, OptimalRequest, ShaperDesign};

const RATE_HZ: f64 = 4000.0;
const DECIMATION: usize = 8;

#[test]
fn the_board_streams_the_hosts_setpoints_and_perturbed_modes_stay_still() {
    for (tolerance, fraction, negative_limit) in [(0.02, 0.05, 0.0), (0.05, 0.1, 0.3)] {
        let modes = [(1.1, 0.0074), (6.9, 0.0033)]
            .map(|(hz, zeta)| ModeBox::around(hz, zeta, fraction, fraction).unwrap());
        let request = OptimalRequest {
            modes: modes.to_vec(),
            rate_hz: RATE_HZ,
            tolerance,
            negative_limit,
            longest_s: None,
        };
        let shaper = request.solve().unwrap();
        let design = ShaperDesign::optimal(&shaper);
        let command: MotionCommand = "move 50mm".parse().unwrap();
        let shaped_m = shaped_setpoints_m(&command, RATE_HZ, Some(&shaper.table)).unwrap();

        let mut session = BoardTarget::parse("core").connect(&mut |_| {}).unwrap();
        session.enable_virtual_drive().unwrap();
        let table = BoardTable::from_json("table", &design.to_json()).unwrap();
        assert_eq!(session.upload_table(&table).unwrap(), design.crc32);
        let motion = session.run_motion("move 50", DECIMATION as u32, 0.05, &mut |_| {}).unwrap();
        let streamed_m = motion.setpoints_m();
        let same = |offset: usize| {
            streamed_m.iter().enumerate().all(|(index, streamed_m)| {
                let tick = (index * DECIMATION).saturating_sub(offset);
                let host_m = shaped_m.get(tick).or(shaped_m.last()).unwrap();
                (host_m - streamed_m).abs() < 1e-12
            })
        };
        assert!((0..=DECIMATION).any(same), "the board's setpoints are not the host's");
        assert!(streamed_m.len() * DECIMATION >= shaped_m.len());

        // Unshaped, but as slow as with this shaper: the board plans slower where weights are negative.
        let gain = shaper.table.absolute_gain();
        let settings = stillbeam_firmware::settings::Settings::default();
        let mut limits = settings.limits();
        limits.velocity_mm_s /= gain;
        limits.acceleration_mm_s2 /= gain;
        let unshaped_m = stillbeam::command_signal::setpoints_within_m(
            &command,
            RATE_HZ,
            None,
            limits,
            settings.profile(),
        )
        .unwrap();
        for area in modes {
            for hz in area.frequency_hz() {
                for damping_ratio in area.damping_ratio() {
                    let mode = Mode { frequency_hz: hz, damping_ratio, participation: vec![1.0] };
                    let left = |setpoints_m: &[f64]| {
                        let plant =
                            PrescribedBase::from_modes(vec![mode.clone()], None, RATE_HZ, 0.0).unwrap();
                        ResidualVibration::after(plant, setpoints_m).unwrap()
                    };
                    let relative = left(&shaped_m).relative_to(&left(&unshaped_m)).modes_pct[0];
                    assert!(relative <= 100.0 * tolerance * 1.0005, "{hz} Hz: {relative} %");
                }
            }
        }
    }
}
