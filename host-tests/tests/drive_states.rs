//! The drive's state machine: every state with every event, and against a model that is written another way.

use std::collections::BTreeMap;

use proptest::prelude::*;
use stillbeam_firmware::drive::{Drive, Event, Outputs, State, Stop, Times};

const EVENTS: [Event; 10] = [
    Event::Permit(false),
    Event::Permit(true),
    Event::Enable,
    Event::Disable,
    Event::Fault(Stop::Coast),
    Event::Fault(Stop::Controlled),
    Event::Fault(Stop::Hold),
    Event::AtRest,
    Event::Tick,
    Event::Clear,
];

/// With and without each of the times.
fn all_times() -> impl Iterator<Item = Times> {
    (0..8_u32).map(|bits| Times { hold: 2 * (bits & 1), release: bits & 2, engage: (bits & 4) / 2, ramp: 3 })
}

/// Every machine that events can make of the first, and how it was reached.
fn reachable(times: &Times) -> Vec<Drive> {
    let mut found = vec![Drive::default()];
    let mut next = 0;
    while let Some(drive) = found.get(next).copied() {
        next += 1;
        for event in EVENTS {
            let after = drive.after(event, times);
            if !found.contains(&after) {
                found.push(after);
            }
        }
    }
    found
}

/// The states that an event may lead to, by CiA 402 and IEC 60204-1; drawn in docs/architecture.md.
fn permitted(from: State, event: Event) -> &'static [State] {
    use State::{Disabled, Enabled, Enabling, Fault, NotReady, Stopping};
    match (from, event) {
        (NotReady | Disabled, Event::Permit(true)) => &[Disabled],
        (NotReady | Disabled, Event::Permit(false)) => &[NotReady],
        (Disabled, Event::Enable) => &[Enabling],
        (Enabling, Event::Tick) => &[Enabling, Enabled],
        // With the brake still closed there is nothing to stop.
        (Enabling, Event::Disable) => &[NotReady, Disabled, Stopping],
        (Enabling, Event::Fault(Stop::Controlled | Stop::Hold)) => &[Fault, Stopping],
        (Enabled, Event::Disable | Event::Fault(Stop::Controlled | Stop::Hold)) => &[Stopping],
        (Stopping, Event::Tick | Event::AtRest) => &[Stopping, NotReady, Disabled, Fault],
        (_, Event::Fault(Stop::Coast)) => &[Fault],
        (NotReady | Disabled, Event::Fault(_)) => &[Fault],
        (Fault, Event::Clear) => &[NotReady, Disabled, Enabled, Fault],
        // One that holds after a stop of category 2 may have to close its brake.
        (Fault, Event::Disable | Event::Fault(_)) => &[Fault, Stopping],
        (NotReady, _) => &[NotReady],
        (Disabled, _) => &[Disabled],
        (Enabling, _) => &[Enabling],
        (Enabled, _) => &[Enabled],
        (Stopping, _) => &[Stopping],
        (Fault, _) => &[Fault],
    }
}

#[test]
fn every_event_takes_every_state_only_where_the_diagram_says() {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for times in all_times() {
        for drive in reachable(&times) {
            for event in EVENTS {
                let (from, to) = (drive.state(), drive.after(event, &times).state());
                let allowed = permitted(from, event);
                assert!(allowed.contains(&to), "{from:?} {event:?} {to:?}: {drive:?} {times:?}");
                *seen.entry(format!("{from:?} {event:?}")).or_default() += 1;
            }
        }
    }
    assert_eq!(seen.len(), State::ALL.len() * EVENTS.len(), "every state meets every event: {seen:?}");
}

#[test]
fn nothing_but_enable_while_all_is_there_begins_to_enable() {
    for times in all_times() {
        for drive in reachable(&times) {
            for event in EVENTS {
                let after = drive.after(event, &times);
                if drive.is_off() && !after.is_off() {
                    assert_eq!((event, drive.state()), (Event::Tick, State::Enabling), "{drive:?}");
                }
                if drive.state() != State::Enabling && after.state() == State::Enabling {
                    assert_eq!((event, drive.state()), (Event::Enable, State::Disabled), "{drive:?}");
                }
            }
        }
    }
}

#[test]
fn the_brake_is_never_open_without_a_drive_that_holds_and_a_coast_is_off_at_once() {
    for times in all_times() {
        for drive in reachable(&times) {
            let Outputs { enable, brake_open } = drive.outputs();
            assert!(enable || !brake_open, "{drive:?}");
            assert!(!drive.may_move() || brake_open, "{drive:?}");
            let coast = drive.after(Event::Fault(Stop::Coast), &times);
            assert_eq!((coast.outputs(), coast.state()), (Outputs::default(), State::Fault));
        }
    }
}

#[test]
fn every_stop_ends_within_its_time_whether_the_setpoint_comes_to_rest_or_not() {
    for times in all_times() {
        for start in reachable(&times).into_iter().filter(|drive| drive.state() == State::Stopping) {
            for rests in [false, true] {
                let mut drive = start;
                for _ in 0..times.ramp + times.engage {
                    if rests {
                        drive = drive.after(Event::AtRest, &times);
                    }
                    drive = drive.after(Event::Tick, &times);
                }
                assert_ne!(drive.state(), State::Stopping, "{start:?} {times:?}");
            }
        }
    }
}

/// What is known of a drive from outside, kept in the plainest way.
#[derive(Clone, Copy, Debug, Default)]
struct Model {
    permit: bool,
    fault: bool,
    enable: bool,
    /// Ticks since `enable` was said, and while it counts.
    coming_up: Option<u32>,
    /// Ticks left of a stop, and whether the drive goes on holding after it.
    stopping: Option<(u32, bool)>,
    closing: Option<u32>,
    holds: bool,
}

impl Model {
    fn off(&mut self) {
        *self = Self { permit: self.permit, fault: self.fault, ..Self::default() };
    }

    fn close(&mut self, times: &Times) {
        (self.stopping, self.holds, self.coming_up) = (None, false, None);
        self.closing = Some(times.engage);
        if times.engage == 0 {
            self.off();
        }
    }

    fn stop(&mut self, holding: bool, times: &Times) {
        if self.closing.is_some() {
            return;
        }
        if let Some(ticks) = self.coming_up {
            // The brake opens when the drive holds.
            if self.enable && ticks > times.hold { self.close(times) } else { self.off() }
        } else if let Some((_, then)) = &mut self.stopping {
            *then &= holding;
        } else if self.holds {
            if !holding {
                self.close(times);
            }
        } else if self.enable {
            self.stopping = Some((times.ramp, holding));
        }
    }

    fn tick(&mut self, times: &Times) {
        if let Some(ticks) = &mut self.coming_up {
            *ticks += 1;
            self.enable = true;
            if *ticks > times.hold + times.release {
                self.coming_up = None;
            }
        } else if let Some((left, _)) = &mut self.stopping {
            *left -= 1;
            if *left == 0 {
                self.off();
            }
        } else if let Some(left) = &mut self.closing {
            *left -= 1;
            if *left == 0 {
                self.off();
            }
        }
    }

    fn take(&mut self, event: Event, times: &Times) {
        match event {
            Event::Permit(permit) => self.permit = permit,
            Event::Enable => {
                if self.state() == State::Disabled {
                    self.coming_up = Some(0);
                }
            }
            Event::Disable => self.stop(false, times),
            Event::Fault(Stop::Coast) => {
                self.fault = true;
                self.off();
            }
            Event::Fault(Stop::Controlled) => {
                self.fault = true;
                self.stop(false, times);
            }
            Event::Fault(Stop::Hold) => {
                self.fault = true;
                self.stop(true, times);
            }
            Event::AtRest => match self.stopping {
                Some((_, true)) => (self.stopping, self.holds) = (None, true),
                Some((_, false)) => self.close(times),
                None => {}
            },
            Event::Tick => self.tick(times),
            Event::Clear => {
                if self.holds || (!self.enable && self.coming_up.is_none()) {
                    (self.fault, self.holds) = (false, false);
                }
            }
        }
    }

    fn state(&self) -> State {
        match self {
            Self { coming_up: Some(_), .. } => State::Enabling,
            Self { stopping: Some(_), .. } | Self { closing: Some(_), .. } => State::Stopping,
            Self { holds: true, .. } => State::Fault,
            Self { enable: true, .. } => State::Enabled,
            Self { fault: true, .. } => State::Fault,
            Self { permit: true, .. } => State::Disabled,
            _ => State::NotReady,
        }
    }
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        3 => Just(Event::Permit(true)),
        1 => Just(Event::Permit(false)),
        4 => Just(Event::Enable),
        1 => Just(Event::Disable),
        1 => Just(Event::Fault(Stop::Coast)),
        1 => Just(Event::Fault(Stop::Controlled)),
        2 => Just(Event::Fault(Stop::Hold)),
        2 => Just(Event::AtRest),
        8 => Just(Event::Tick),
        3 => Just(Event::Clear),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn the_machine_does_what_the_model_does(
        (hold, release, engage, ramp) in (0_u32..4, 0_u32..4, 0_u32..4, 1_u32..6),
        history in prop::collection::vec(event(), 1..200),
    ) {
        let times = Times { hold, release, engage, ramp };
        let (mut drive, mut model) = (Drive::default(), Model::default());
        for (index, event) in history.iter().enumerate() {
            drive = drive.after(*event, &times);
            model.take(*event, &times);
            prop_assert_eq!(drive.state(), model.state(), "{} {:?}: {:?} {:?}", index, event, drive, model);
            prop_assert_eq!(drive.outputs().enable, model.enable, "{} {:?}: {:?} {:?}", index, event, drive, model);
        }
    }
}
