//! The tick: all that the interrupt does.
//!
//! ```text
//! request ─▶ motion plan ─▶ command ─▶ shaping ─▶ setpoint ─▶ DAC code
//!                                          └────▶ status, telemetry
//! ```
//!
//! Everything a tick needs has been computed before: plans, tables and scales arrive ready in a
//! lock-free queue, at most one is taken per tick, and memory that is no longer needed goes back through another.

use heapless::spsc::{Consumer, Producer};

use crate::motion::stop::Braking;
use crate::motion::{MovePlan, StopPlan, SweepPlan};
use crate::servo::{AnalogScale, DacCode};
use crate::shaper::{Cascade, Shaping};
use crate::telemetry::{Activity, Sample, Status};
use crate::units::Nanometres;

/// What the console asks of the interrupt.
#[derive(Debug)]
pub enum Request<'m> {
    /// Start a move. It was planned from the command's position at rest.
    Move(MovePlan),
    /// Start a sweep. It was planned around the command's position at rest.
    Sweep(SweepPlan),
    /// Bring the command to rest.
    Stop,
    /// Shape with this cascade from now on.
    Shape(Cascade<'m>),
    /// Brake and scale like this from now on.
    Configure {
        /// For later stops.
        braking: Braking,
        /// For the analog output.
        analog: AnalogScale,
    },
    /// Stream every so-many-th tick; zero stops the stream.
    Stream {
        /// Ticks per sample.
        decimation: u32,
    },
}

/// What one tick puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickOutput {
    /// Where the base should be.
    pub setpoint: Nanometres,
    /// The same for the analog output.
    pub analog: DacCode,
    /// Whether a telemetry sample was queued, so that somebody should be woken to send it.
    pub sample_queued: bool,
}

/// The interrupt's ends of the queues.
pub struct Links<'m> {
    /// Requests from the console.
    pub requests: Consumer<'m, Request<'m>>,
    /// History memory of replaced cascades, going back.
    pub retired: Producer<'m, &'m mut [i32]>,
    /// Samples on their way to the serial port.
    pub samples: Producer<'m, Sample>,
    /// The newest values.
    pub status: &'m Status,
}

/// The state of the control loop.
pub struct Controller<'m> {
    links: Links<'m>,
    shaping: Shaping<'m>,
    motion: Motion,
    braking: Braking,
    analog: AnalogScale,
    command: Nanometres,
    /// The command of the tick before.
    previous: Nanometres,
    /// Ticks since the command last changed, up to the longest shaper.
    quiet_ticks: u32,
    tick: u32,
    stream: Stream,
}

#[derive(Debug)]
enum Motion {
    Hold,
    Move(MovePlan),
    Sweep(SweepPlan),
    Stop(StopPlan),
}

#[derive(Debug, Default)]
struct Stream {
    decimation: u32,
    ticks_to_next: u32,
    sequence: u32,
}

impl<'m> Controller<'m> {
    /// A controller at rest at zero.
    pub fn new(links: Links<'m>, cascade: Cascade<'m>, braking: Braking, analog: AnalogScale) -> Self {
        Self {
            links,
            shaping: Shaping::at_rest(cascade, Nanometres(0)),
            motion: Motion::Hold,
            braking,
            analog,
            command: Nanometres(0),
            previous: Nanometres(0),
            quiet_ticks: u32::MAX,
            tick: 0,
            stream: Stream::default(),
        }
    }

    /// One tick of the control loop.
    #[inline]
    pub fn tick(&mut self) -> TickOutput {
        if let Some(request) = self.links.requests.dequeue() {
            self.accept(request);
        }
        self.advance_command();
        let (setpoint, retired) = self.shaping.step(self.command);
        self.give_back(retired);
        self.links.status.publish(self.activity(), self.tick, self.command, setpoint);
        let sample_queued = self.offer_sample(setpoint);
        self.tick = self.tick.wrapping_add(1);
        TickOutput { setpoint, analog: self.analog.code(setpoint), sample_queued }
    }

    fn give_back(&mut self, history: Option<&'m mut [i32]>) {
        if let Some(history) = history {
            // The queue has room for both histories there are, so this cannot fail.
            let _returned = offer(&mut self.links.retired, history);
        }
    }

    fn accept(&mut self, request: Request<'m>) {
        match request {
            Request::Move(plan) => self.motion = Motion::Move(plan),
            Request::Sweep(plan) => self.motion = Motion::Sweep(plan),
            Request::Stop => {
                if !matches!(self.motion, Motion::Hold | Motion::Stop(_)) {
                    self.motion = Motion::Stop(StopPlan::new(self.previous, self.command, self.braking));
                }
            }
            Request::Shape(cascade) => {
                // The console owns the second history only while no handover is under way, so the cascade
                // is accepted; were it not, its memory would go back at once.
                let replaced = match self.shaping.hand_over(cascade, self.command, self.quiet_ticks) {
                    Ok(replaced) => replaced,
                    Err(refused) => Some(refused.history),
                };
                self.give_back(replaced);
            }
            Request::Configure { braking, analog } => {
                self.braking = braking;
                self.analog = analog;
            }
            Request::Stream { decimation } => self.stream = Stream { decimation, ..Stream::default() },
        }
    }

    fn advance_command(&mut self) {
        let next = match &mut self.motion {
            Motion::Hold => None,
            Motion::Move(plan) => plan.step(),
            Motion::Sweep(plan) => plan.step(),
            Motion::Stop(plan) => plan.step(),
        };
        self.previous = self.command;
        match next {
            Some(position) => {
                self.command = position;
                self.quiet_ticks = 0;
            }
            None => {
                self.motion = Motion::Hold;
                self.quiet_ticks = self.quiet_ticks.saturating_add(1);
            }
        }
    }

    fn activity(&self) -> Activity {
        match self.motion {
            Motion::Move(_) => Activity::Moving,
            Motion::Sweep(_) => Activity::Sweeping,
            Motion::Stop(_) => Activity::Stopping,
            Motion::Hold if self.shaping.is_settled(self.quiet_ticks) => Activity::Rest,
            Motion::Hold => Activity::Settling,
        }
    }

    fn offer_sample(&mut self, setpoint: Nanometres) -> bool {
        let stream = &mut self.stream;
        if stream.decimation == 0 {
            return false;
        }
        if stream.ticks_to_next > 0 {
            stream.ticks_to_next -= 1;
            return false;
        }
        stream.ticks_to_next = stream.decimation - 1;
        let sample = Sample { sequence: stream.sequence, tick: self.tick, command: self.command, setpoint };
        stream.sequence = stream.sequence.wrapping_add(1);
        let queued = offer(&mut self.links.samples, sample).is_ok();
        if !queued {
            self.links.status.count_dropped();
        }
        queued
    }
}

/// Queues `value`, or gives it back when the queue is full.
///
/// heapless reduces its index modulo a length that it keeps at run time, which the compiler guards with a panic for
/// zero. No queue has that length; saying so here takes the panic out of the interrupt.
#[inline]
fn offer<T>(queue: &mut Producer<'_, T>, value: T) -> Result<(), T> {
    // The capacity is the length less one.
    if queue.capacity() == usize::MAX { Err(value) } else { queue.enqueue(value) }
}
