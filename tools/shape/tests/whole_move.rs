//! The shortest command for a whole move: against the closed form where there is one, its limits tick by
//! tick, and what it leaves.

use stillbeam_firmware::shaper::Impulse;
use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_shape::{
    ModeBox, MoveBounds, MoveRequest, OptimalRequest, PlayedMove, ShapeError, command_residual,
};

const RATE_HZ: f64 = 4000.0;
const TOLERANCE: f64 = 0.02;
const BOUNDS: MoveBounds = MoveBounds { velocity_m_s: 0.5, acceleration_m_s2: 5.0, jerk_m_s3: 200.0 };

fn request(modes: Vec<ModeBox>) -> MoveRequest {
    MoveRequest {
        distance_m: 0.05,
        bounds: BOUNDS,
        reversing: false,
        modes,
        tolerance: TOLERANCE,
        rate_hz: RATE_HZ,
    }
}

fn paper_modes() -> Vec<ModeBox> {
    [(1.1, 0.0074), (6.9, 0.0033)].map(|(hz, zeta)| ModeBox::around(hz, zeta, 0.05, 0.05).unwrap()).to_vec()
}

/// Velocity, acceleration and jerk, tick by tick, are what was asked for; rounding each position to a
/// nanometre is allowed for.
fn check_limits(played: &PlayedMove, reversing: bool) {
    let MoveBounds { velocity_m_s, acceleration_m_s2, jerk_m_s3 } = BOUNDS;
    let mut values: Vec<f64> = played.positions_m().collect();
    let mut rounding = 1e-9;
    let limits = [velocity_m_s, acceleration_m_s2, jerk_m_s3];
    for (limit, reached) in limits.into_iter().zip(played.reached) {
        values = values.windows(2).map(|pair| (pair[1] - pair[0]) * RATE_HZ).collect();
        rounding *= 2.0 * RATE_HZ;
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        assert!(largest <= limit * (1.0 + 1e-6) + rounding, "{largest} where {limit} is the limit");
        assert!(reached <= limit * (1.0 + 1e-6), "{reached} where {limit} is the limit");
    }
    if !reversing {
        // Rounding never turns a standstill around by more than the solver's own accuracy.
        let back = played.positions_nm.windows(2).map(|pair| pair[0] - pair[1]).max().unwrap();
        assert!(back <= 1, "{back} nm backwards in a tick");
    }
}

#[test]
fn without_modes_it_is_the_s_curve() {
    // Limits of acceleration and jerk alone: t_j = A/J, T = t_j + √(t_j² + 4D/A).
    let played = request(Vec::new()).solve().unwrap();
    let jerk_s = BOUNDS.acceleration_m_s2 / BOUNDS.jerk_m_s3;
    let closed_s = jerk_s + (jerk_s * jerk_s + 4.0 * 0.05 / BOUNDS.acceleration_m_s2).sqrt();
    assert!((closed_s - 1e-6..closed_s * 1.003).contains(&played.duration_s()), "{} s", played.duration_s());
    check_limits(&played, false);
}

#[test]
fn it_holds_the_tolerance_and_the_limits_and_is_shorter_than_a_shaped_move() {
    let alone_s = request(Vec::new()).solve().unwrap().duration_s();
    let shaper = OptimalRequest {
        modes: paper_modes(),
        rate_hz: RATE_HZ,
        tolerance: TOLERANCE,
        negative_limit: 0.0,
        longest_s: None,
    };
    let shaped_s = alone_s + shaper.solve().unwrap().table.duration_s();
    let mut durations_s = vec![shaped_s];
    for reversing in [false, true] {
        let played = MoveRequest { reversing, ..request(paper_modes()) }.solve().unwrap();
        check_limits(&played, reversing);
        assert_eq!((played.positions_nm[0], played.positions_nm.last()), (0, Some(&50_000_000)));
        // By the core's own formula, inside the boxes too: every tick's step is an impulse.
        let steps = played.positions_nm.windows(2).zip(1..).map(|(pair, tick)| Impulse {
            amplitude: (pair[1] - pair[0]) as f64 / 50e6,
            time_s: f64::from(tick) / RATE_HZ,
        });
        for area in paper_modes() {
            for place in 0..=60 {
                let [low_hz, high_hz] = area.frequency_hz();
                let hz = low_hz + (high_hz - low_hz) * f64::from(place) / 60.0;
                let left = residual_vibration(steps.clone(), hz, area.nominal_damping_ratio());
                assert!(left <= TOLERANCE, "{hz} Hz: {left}");
            }
        }
        durations_s.push(played.duration_s());
    }
    assert!(durations_s.windows(2).all(|pair| pair[1] < pair[0] - 0.05), "{durations_s:?}");
}

/// Whatever the tick rate, the board's sums end where they should to far less than the 0.004 nm that it asks
/// for.
#[test]
fn rounding_leaves_less_than_the_board_asks_for() {
    for (rate_hz, distance_m) in [(500.0, 0.2), (1000.0, 0.0123456789), (4000.0, 0.05), (20_000.0, 0.3)] {
        let played = MoveRequest { rate_hz, distance_m, ..request(paper_modes()) }.solve().unwrap();
        let bytes = played.plan.bytes();
        let mut course = stillbeam_firmware::motion::PieceCourse::default();
        let end = std::iter::from_fn(|| course.step(&bytes)).last().unwrap();
        let off_nm = end.0 as f64 / 2f64.powi(24) - (distance_m * 1e9).round();
        let [_, acceleration, velocity] = course.derivatives().map(|units| units as f64 / 2f64.powi(38));
        println!("{rate_hz} Hz: off by {off_nm:.1e} nm, {velocity:.1e} nm, {acceleration:.1e} nm");
        assert!(off_nm.abs() < 1e-3 && velocity.abs() < 2e-6 && acceleration.abs() < 4e-9);
        assert_eq!(played.plan.ticks() as usize + 1, played.positions_nm.len());
        let rate = stillbeam_firmware::units::TickRate::from_hz(rate_hz).unwrap();
        let outline = stillbeam_firmware::motion::PlanOutline::of(rate, &bytes).unwrap();
        let [velocity, acceleration, jerk] = outline.largest_mm();
        assert!(velocity <= 1e3 * BOUNDS.velocity_m_s && acceleration <= 1e3 * BOUNDS.acceleration_m_s2);
        assert!(jerk <= 1e3 * BOUNDS.jerk_m_s3, "{jerk}");
    }
}

#[test]
fn the_residual_of_a_step_is_all_of_it() {
    let area = ModeBox::around(2.0, 0.0, 0.1, 0.0).unwrap();
    assert!((command_residual(&[0, 7], RATE_HZ, &area) - 1.0).abs() < 1e-12);
    assert_eq!(command_residual(&[3, 3], RATE_HZ, &area), 0.0);
    assert_eq!(command_residual(&[], RATE_HZ, &area), 0.0);
}

#[test]
fn moves_without_meaning_are_refused() {
    let good = request(paper_modes());
    for (request, part) in [
        (MoveRequest { distance_m: -0.05, ..good.clone() }, "a distance of -0.05"),
        (MoveRequest { distance_m: f64::NAN, ..good.clone() }, "a distance of NaN"),
        (MoveRequest { bounds: MoveBounds { jerk_m_s3: 0.0, ..BOUNDS }, ..good.clone() }, "a jerk of 0"),
        (MoveRequest { tolerance: 1.0, ..good.clone() }, "a tolerance of 1"),
        (MoveRequest { rate_hz: 1.0, ..good.clone() }, "1 Hz"),
    ] {
        let message = request.solve().unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    let slow = MoveRequest { bounds: MoveBounds { velocity_m_s: 1e-4, ..BOUNDS }, ..good };
    assert!(matches!(slow.solve(), Err(ShapeError::LongMove { .. })));
}
