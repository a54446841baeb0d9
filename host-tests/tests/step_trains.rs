//! Step pulses counted edge by edge by the drive's side of the timer, through moves, applies and stops in any
//! order.

use proptest::prelude::*;
use stillbeam_firmware::control::Inputs;
use stillbeam_firmware::servo::PulseConfiguration;
use stillbeam_firmware::servo::train::TrainRegisters;
use stillbeam_firmware::settings::PulseKind;
use stillbeam_host_tests::bench::Bench;
use stillbeam_host_tests::step_timer::{StepTimer, register};

/// A bench whose steps go out through the timer, as `src/board/step_pulses.rs` drives it.
struct Driven {
    bench: Bench,
    timer: StepTimer,
    configured: PulseConfiguration,
    clocks_per_tick: u32,
    /// Time between the last change of the direction and the next step, the least so far.
    least_setup_clocks: u64,
    changed_ago_clocks: u64,
}

impl Driven {
    fn new() -> Self {
        Self {
            bench: Bench::enabled(),
            timer: StepTimer::default(),
            configured: PulseConfiguration::default(),
            clocks_per_tick: 42_000,
            least_setup_clocks: u64::MAX,
            changed_ago_clocks: u64::MAX / 2,
        }
    }

    /// Sends a line; the machine ticks on while the interrupt has not taken what it asks for.
    fn send(&mut self, line: &str) -> String {
        let mut reply = String::new();
        for byte in line.bytes().chain([b'\r']) {
            self.bench.console().feed(byte, &mut reply);
            while self.bench.console().work(&mut reply) {}
            while self.bench.console().has_waiting_request() {
                self.tick();
            }
        }
        self.follow();
        reply
    }

    fn follow(&mut self) {
        let console = self.bench.console();
        let (rate, drive) = (console.tick_rate(), *console.settings().drive());
        self.clocks_per_tick = 2 * console.clocks_per_tick();
        let wanted = drive.pulse_configuration(rate);
        if wanted == self.configured {
            return;
        }
        while self.timer.is_running() {
            self.timer.advance(1);
        }
        self.timer.write(register::PSC, u32::from(wanted.prescaler()));
        if wanted.kind() != self.configured.kind() {
            let (mode, forced) = match wanted.kind() {
                PulseKind::Quadrature => (3, 4),
                _ => (7, 4),
            };
            for mode in [forced, mode] {
                self.timer.write(register::CCMR1, mode << 4);
                self.timer.write(register::CCMR2, mode << 12);
            }
        }
        self.configured = wanted;
    }

    /// One tick, and the time of it.
    fn tick(&mut self) -> i32 {
        let busy = self.timer.is_running();
        let output = self.bench.tick_with(Inputs { pulses_busy: busy, ..Inputs::default() });
        let kind = self.configured.kind();
        if let Some(up) = output.steps_up {
            if kind == PulseKind::Step && self.timer.direction_up != up {
                assert!(!self.timer.is_running(), "the direction changes between trains");
                self.timer.direction_up = up;
                self.changed_ago_clocks = 0;
            }
            if output.step_period != 0 {
                let train = TrainRegisters::new(kind, output.steps, output.step_period);
                self.timer.write(register::CCR1, u32::from(train.first));
                self.timer.write(register::CCR4, u32::from(train.second));
                self.timer.write(register::ARR, u32::from(train.reload));
                self.timer.write(register::RCR, u32::from(train.repetitions));
                self.timer.write(register::EGR, 1);
                self.timer.write(register::CR1, 9);
            }
        }
        self.run_timer();
        output.setpoint.0
    }

    fn run_timer(&mut self) {
        let mut left = self.clocks_per_tick;
        while left > 0 {
            // Fine at the start of a train, where the set-up time ends.
            let part = left.min(if self.changed_ago_clocks < 100_000 { 7 } else { 4000 });
            let edges = self.timer.counted().edges;
            self.timer.advance(part);
            self.changed_ago_clocks += u64::from(part);
            if self.timer.counted().edges != edges && self.changed_ago_clocks < u64::MAX / 4 {
                self.least_setup_clocks = self.least_setup_clocks.min(self.changed_ago_clocks);
                self.changed_ago_clocks = u64::MAX / 2;
            }
            left -= part;
        }
    }
}

/// What a person may do, as a line, and for how many ticks nothing more happens.
fn action() -> impl Strategy<Value = (String, usize)> {
    let line = prop_oneof![
        4 => (-40.0..40.0_f64).prop_map(|to| format!("move {to:.3}")),
        1 => Just("stop".to_owned()),
        1 => Just("set fault.limit category_0\rapply".to_owned()),
        1 => Just("set fault.limit category_2\rapply".to_owned()),
        1 => Just("set stream.decimation 7\rapply".to_owned()),
        1 => Just("set mode1.type zvd\rset mode1.frequency_hz 20\rapply".to_owned()),
        1 => Just("set mode1.type off\rapply".to_owned()),
        1 => Just("disable\rset tick.rate_hz 1000\rapply".to_owned()),
        1 => Just("disable\rset tick.rate_hz 4000\rapply".to_owned()),
        1 => Just("disable\rset pulses.width_us 2.5\rapply".to_owned()),
        1 => Just("disable\rset analog.gain 1.1\rapply".to_owned()),
        4 => Just("enable".to_owned()),
    ];
    (line, 0..600_usize)
}

fn play(kind: &str, setup_us: u32, actions: &[(String, usize)]) -> Driven {
    let mut driven = Driven::new();
    driven.send("disable");
    (0..4).for_each(|_| _ = driven.tick());
    for line in [
        &format!("set pulses.kind {kind}"),
        &format!("set pulses.setup_us {setup_us}"),
        "set pulses.steps_per_mm 200",
        "set move.velocity_mm_s 300",
        "apply",
        "enable",
    ] {
        driven.send(line);
    }
    (0..4).for_each(|_| _ = driven.tick());
    let per_step = if kind == "quadrature" { 2.0 } else { 1.0 };
    for (line, ticks) in actions {
        for line in line.split('\r') {
            driven.send(line);
        }
        for _ in 0..*ticks {
            let setpoint_nm = driven.tick();
            let exact = f64::from(setpoint_nm) * 200e-6;
            let found = driven.timer.counted().counts as f64 / per_step;
            // One tick may have been waited for the set-up of a direction or of the output.
            let slack = 0.51 + 300.0 * 200.0 / driven.bench.console().tick_rate().hz();
            assert!((found - exact).abs() <= slack, "{found} steps for {exact}");
        }
    }
    for _ in 0..40_000 {
        driven.tick();
    }
    driven
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_edge_adds_up_to_the_setpoint_and_none_runs_backwards(
        quadrature in any::<bool>(),
        setup_us in prop_oneof![Just(1_u32), 2..400_u32],
        actions in prop::collection::vec(action(), 1..12),
    ) {
        let kind = if quadrature { "quadrature" } else { "step" };
        let mut driven = play(kind, setup_us, &actions);
        let counted = driven.timer.counted();
        prop_assert_eq!((counted.cut, counted.ambiguous), (0, 0));
        let wanted = (f64::from(driven.tick()) * 200e-6).round() as i64;
        prop_assert!((counted.counts - if quadrature { 2 * wanted } else { wanted }).abs() <= 1, "{counted:?} {wanted}");
        if quadrature {
            prop_assert_eq!(driven.timer.outputs()[0], driven.timer.outputs()[1], "A is B at rest");
        } else {
            prop_assert!(driven.least_setup_clocks >= 168 * u64::from(setup_us), "{}", driven.least_setup_clocks);
        }
    }
}

/// A single move in one direction: the drive's count never goes back, whatever is applied meanwhile.
#[test]
fn harmless_settings_applied_during_a_move_cut_no_train() {
    for kind in ["step", "quadrature"] {
        let mut driven = play(kind, 1, &[]);
        driven.send("move 30");
        let mut before = driven.timer.counted().counts;
        for tick in 0..800 {
            // The table before the last takes some 240 ticks to run out.
            if tick % 300 == 25 {
                let reaction = if tick == 325 { "category_2" } else { "category_0" };
                driven.send(&format!("set fault.limit {reaction}"));
                let reply = driven.send("apply");
                assert!(reply.starts_with("ok apply"), "accepted while it moves: {reply}");
            }
            driven.tick();
            let now = driven.timer.counted().counts;
            assert!(now >= before, "{kind}: {now} after {before}");
            before = now;
        }
        assert_eq!(driven.timer.counted().cut, 0);
        assert_eq!(before, if kind == "step" { 6000 } else { 12_000 });
    }
}
