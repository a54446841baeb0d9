//! The tick: all that the interrupt does.
//!
//! ```text
//! request ─▶ motion plan ─▶ command ─▶ shaping ─▶ guard ─▶ setpoint ─▶ DAC code, steps
//! pulses ──▶ source ──────┘
//! inputs ──▶ faults ────────────┴──────────────────┘  └────▶ status, telemetry
//! ```
//!
//! The setpoint moves only while the drive is enabled ([`crate::drive`]). A fault brakes the setpoint itself,
//! past the shaper, and the command goes with it ([`supervision`]).
//!
//! Everything a tick needs has been computed before: plans, tables and scales arrive ready in a lock-free
//! queue, at most one is taken per tick, and memory that is no longer needed goes back through another.

mod following;
mod homing;
mod supervision;

use heapless::spsc::{Consumer, Producer};

use crate::drive::{Drive, DriveSetup, Event as DriveEvent, Lines, Outputs, Unusual};
use crate::fault::{Event, EventRecord, Fault, Latch, Reactions, TravelGuard};
use crate::homing::{Homing, HomingPlan};
use crate::motion::stop::Braking;
use crate::motion::{FinePosition, MotionMemory, MotionPlan, StopPlan};
use crate::real_time::Asked;
use crate::servo::analog::{Owed, Target};
use crate::servo::pulses::StepTrain;
use crate::servo::{AnalogOutput, DacCode, Encoder, EncoderScale, PulseConfiguration, PulseScale, Pulses};
use crate::shaper::{Cascade, Fade, Shaping};
use crate::source::{Average, Source, SourceSetup};
use crate::telemetry::{Activity, Flags, Sample, Status};
use crate::units::Nanometres;

/// What the console asks of the interrupt.
#[derive(Debug)]
pub enum Request<'m> {
    /// Start a motion. It was planned from the command's position at rest.
    Start(MotionPlan<'m>),
    /// Look for the reference. It was planned for a machine at rest.
    Home(HomingPlan),
    /// Bring the command to rest.
    Stop,
    /// Shape with this cascade from now on, the command's motion going over like this.
    Shape(Cascade<'m>, Fade),
    /// Brake, guard and put out like this from now on.
    Configure(Setup),
    /// Stop as the setting for emergencies says.
    Emergency,
    /// Go on after a fault, if the setpoint has settled.
    Clear,
    /// Let the drive run, from where the encoder says that the machine is, if there is one. With a shaper
    /// whose history is that of rest.
    Enable,
    /// Bring the setpoint to rest and switch the drive off.
    Disable,
    /// The machine stands here; the drive is off. With a shaper whose history is that of rest.
    SetPosition(Nanometres),
    /// The machine is where the setpoint is: count the encoder from there.
    ReferenceEncoder,
    /// Stream every so-many-th tick; zero stops the stream.
    Stream {
        /// Ticks per sample.
        decimation: u32,
    },
}

/// What the settings make of the tick, ready for one tick rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// For stops of later motions.
    pub braking: Braking,
    /// The travel.
    pub guard: TravelGuard,
    /// How far from where it was enabled a machine may go that has yet to find its reference; `None` where it
    /// has none to find.
    pub unreferenced: Option<Nanometres>,
    /// What faults do.
    pub reactions: Reactions,
    /// What enabling needs and how long it takes.
    pub drive: DriveSetup,
    /// The analog output.
    pub analog: AnalogOutput,
    /// The step pulses, if any.
    pub pulses: Option<PulseScale>,
    /// The encoder, if there is one.
    pub encoder: Option<EncoderScale>,
    /// Another controller's pulses, if they are the command.
    pub source: Option<SourceSetup>,
}

/// What one tick is told by the hardware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// The encoder's counter.
    pub encoder_counter: u16,
    /// The counter of another controller's pulses.
    pub source_counter: u16,
    /// Whether the emergency input is active, or was since the last tick.
    pub emergency: bool,
    /// The levels of the general inputs: the flags [`Flags::CONTACTS`] has.
    pub contacts: Flags,
    /// Ticks that the timer counted and nobody ran since the last one.
    pub missed_ticks: u16,
    /// Whether the step output still makes the steps of an earlier tick.
    pub pulses_busy: bool,
    /// Whether the last tick ended after this one was due.
    pub late: bool,
}

/// What one tick puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickOutput {
    /// Where the base should be.
    pub setpoint: Nanometres,
    /// The same for the analog output.
    pub analog: DacCode,
    /// Steps to make in this tick, the sign being the direction; 0 without step pulses.
    pub steps: i16,
    /// Counts of the pulse timer per step; 0 for no steps.
    pub step_period: u16,
    /// The direction of these steps or of those to come; `None` without step pulses.
    pub steps_up: Option<bool>,
    /// Whether the drive may run, and the brake is open.
    pub drive: Outputs,
    /// The same, and what others are told, as levels.
    pub lines: Lines,
    /// Whether a telemetry sample was queued, so that somebody should be woken to send it.
    pub sample_queued: bool,
}

/// The interrupt's ends of the queues.
pub struct Links<'m> {
    /// Requests from the console.
    pub requests: Consumer<'m, Request<'m>>,
    /// History memory of replaced cascades and what motions borrowed, going back.
    pub retired: Producer<'m, MotionMemory<'m>>,
    /// Samples on their way to the serial port.
    pub samples: Producer<'m, Sample>,
    /// Events on their way to the console.
    pub events: Producer<'m, EventRecord>,
    /// The newest values.
    pub status: &'m Status,
    /// What single bytes ask for.
    pub asked: &'m Asked,
}

/// The state of the control loop.
pub struct Controller<'m> {
    links: Links<'m>,
    shaping: Shaping<'m>,
    motion: Motion<'m>,
    setup: Setup,
    /// That of the limits the motion was planned with: with weaker braking it could leave the travel.
    braking: Braking,
    /// Of an analog velocity.
    owed: Owed,
    /// The longest that this braking takes from the velocity limit that the motion was planned with.
    ramp_ticks: u32,
    pulses: Option<Pulses>,
    /// The steps of the last tick, where there are pulses.
    train: StepTrain,
    encoder: Option<Encoder>,
    /// The encoder's counter in the last tick.
    encoder_counter: u16,
    /// Where the command comes from another controller's pulses.
    source: Option<Source>,
    /// The limits keep the setpoint away from the shaped command.
    lags: bool,
    latch: Latch,
    drive: Drive,
    /// What [`Drive`] puts out.
    outputs: Outputs,
    /// What goes to the pins, the charge pump in every other tick only.
    lines: Lines,
    /// Whether somebody has said where the machine is, or an encoder has watched it since.
    position_known: bool,
    /// Whether positions count from a reference.
    referenced: bool,
    /// Where the drive was enabled.
    anchor: Nanometres,
    /// The positions that are permitted now.
    guard: TravelGuard,
    /// The reference that homing has found, until positions count from it.
    found: Option<FinePosition>,
    /// Whether the tick has to look at more than it does every time: the drive is not simply enabled, or an
    /// input is unusual.
    attention: bool,
    /// Whether the setpoint is the command itself, past the shaper.
    past_shaper: bool,
    /// Conditions that were there in the last tick, so that each is an event once.
    conditions: Conditions,
    command: Nanometres,
    /// The command of the last three ticks before it was rounded, the newest last.
    recent: [FinePosition; 3],
    setpoint: Nanometres,
    /// In the tick before.
    earlier_setpoint: Nanometres,
    /// Ticks since the command last changed, up to the longest shaper.
    quiet_ticks: u32,
    tick: u32,
    stream: Stream,
}

/// Told apart by one byte: without `repr` the tag would hide in the unused values of a field of 64 bits,
/// which takes seven instructions to read, several times a tick.
#[derive(Debug)]
#[repr(u8)]
enum Motion<'m> {
    Hold,
    Planned(MotionPlan<'m>),
    /// Another controller's pulses are the command.
    Following,
    /// The machine looks for its reference.
    Homing(Homing),
    Stop(StopPlan),
    /// The setpoint itself is braked.
    Braking(StopPlan),
}

/// What was wrong in the last tick.
#[derive(Clone, Copy, Debug, Default)]
struct Conditions {
    /// The inputs: emergency, and the encoder outside its window.
    flags: Flags,
    /// The general inputs that were not as they are while all is well.
    unusual: Unusual,
    limit: bool,
    clamp: bool,
}

impl Conditions {
    /// Sets or clears a flag; whether it was set before.
    #[inline]
    fn put(&mut self, flag: Flags, set: bool) -> bool {
        let before = self.flags.contains(flag);
        self.flags = Flags(if set { self.flags.0 | flag.0 } else { self.flags.0 & !flag.0 });
        before
    }
}

#[derive(Debug, Default)]
struct Stream {
    decimation: u32,
    ticks_to_next: u32,
    sequence: u32,
}

impl<'m> Controller<'m> {
    /// Another controller's pulses have paused when the command has not changed for longer than its mean
    /// takes.
    const PAUSE_TICKS: u32 = Average::MOST_TICKS as u32;

    /// A controller at rest at zero, the drive off.
    pub fn new(links: Links<'m>, cascade: Cascade<'m>, setup: Setup) -> Self {
        let zero = Nanometres(0);
        let mut controller = Self {
            links,
            shaping: Shaping::at_rest(cascade, zero),
            motion: Motion::Hold,
            owed: Owed::default(),
            pulses: setup.pulses.map(|scale| Pulses::new(scale, zero)),
            train: StepTrain::default(),
            encoder: setup.encoder.map(|scale| Encoder::new(scale, 0, zero)),
            source: setup.source.map(Source::new),
            lags: false,
            braking: setup.braking,
            ramp_ticks: setup.drive.times.ramp,
            setup,
            encoder_counter: 0,
            latch: Latch::default(),
            drive: Drive::default(),
            outputs: Outputs::default(),
            lines: Lines::CHARGE_PUMP,
            position_known: false,
            referenced: false,
            anchor: zero,
            guard: setup.guard,
            found: None,
            attention: true,
            past_shaper: false,
            conditions: Conditions { flags: Flags::DRIVE_DISABLED, ..Conditions::default() },
            command: zero,
            recent: [zero.into(); 3],
            setpoint: zero,
            earlier_setpoint: zero,
            quiet_ticks: u32::MAX,
            tick: 0,
            stream: Stream::default(),
        };
        controller.guard_travel();
        controller.look_at_drive();
        controller.publish::<true>(None);
        controller
    }

    /// What the tick publishes.
    pub fn status(&self) -> &'m Status {
        self.links.status
    }

    /// Takes all that waits, before the first tick.
    pub fn take_waiting_requests(&mut self) {
        while let Some(request) = self.links.requests.dequeue() {
            self.accept(request);
        }
    }

    /// The steps to make in the tick that has just been computed; `None` without step pulses.
    #[inline]
    pub fn train(&self) -> Option<StepTrain> {
        self.pulses.as_ref().map(|_| self.train)
    }

    /// Starts in [`Fault::Restart`]: after a crash nothing moves before a person says so.
    pub fn hold_after_crash(&mut self) {
        self.trip(Fault::Restart);
        // Known before the first tick.
        self.publish::<true>(None);
    }

    #[inline]
    fn publish<const FOLLOWS: bool>(&mut self, encoder: Option<Nanometres>) -> (Flags, Activity) {
        let (flags, activity) = (self.flags(), self.activity::<FOLLOWS>());
        self.links.status.publish(activity, self.tick, self.command, self.setpoint);
        self.links.status.publish_faults(self.latch.fault(), flags, encoder);
        (flags, activity)
    }

    /// One tick of the control loop.
    #[inline]
    pub fn tick(&mut self, inputs: Inputs) -> TickOutput {
        let pulses_busy = |_| inputs.pulses_busy;
        if self.has_source() {
            self.tick_asking::<true>(inputs, pulses_busy)
        } else {
            self.tick_asking::<false>(inputs, pulses_busy)
        }
    }

    /// Whether another controller's pulses are the command.
    #[inline]
    pub fn has_source(&self) -> bool {
        self.source.is_some()
    }

    /// A tick, asking whether the step output still makes the steps of an earlier tick only where there is
    /// one: [`Inputs::pulses_busy`] is not looked at. `FOLLOWS` is what [`Controller::has_source`] says: a
    /// tick of its own for either, so that the one pays nothing for the other. What a request changes in this
    /// is so from the next tick on.
    #[inline(always)]
    pub fn tick_asking<const FOLLOWS: bool>(
        &mut self,
        inputs: Inputs,
        pulses_busy: impl FnOnce(PulseConfiguration) -> bool,
    ) -> TickOutput {
        if self.links.requests.ready() {
            self.take_request();
        }
        if FOLLOWS && let Some(source) = &mut self.source {
            source.count(inputs.source_counter);
        }
        let encoder = self.observe(inputs);
        self.advance_command::<FOLLOWS>();
        let (shaped, retired) = self.shaping.step(self.command);
        self.give_back(retired.map(MotionMemory::History));
        let before = self.setpoint;
        self.setpoint = self.guarded::<FOLLOWS>(shaped);
        self.earlier_setpoint = before;
        let drive_enabled = self.outputs.enable;
        let target = Target { setpoint: self.setpoint, previous: before, encoder, drive_enabled };
        let analog = self.setup.analog.code(target, &mut self.owed);
        let pulses_behind = match &mut self.pulses {
            Some(pulses) => {
                self.train = pulses.step(self.setpoint, pulses_busy(pulses.configuration()));
                self.train.behind
            }
            None => false,
        };
        self.note_clamping(analog.clamped | pulses_behind);
        let (flags, activity) = self.publish::<FOLLOWS>(encoder);
        let sample_queued = self.offer_sample(encoder, flags, activity);
        self.tick = self.tick.wrapping_add(1);
        let train = self.train();
        TickOutput {
            setpoint: self.setpoint,
            analog: analog.code,
            steps: train.map_or(0, |train| train.steps),
            step_period: train.map_or(0, |train| train.period),
            steps_up: train.map(|train| train.up),
            drive: self.outputs,
            lines: self.lines.in_tick(self.tick),
            sample_queued,
        }
    }

    /// Apart from the tick, which then has registers enough for what it does every time.
    #[cold]
    #[inline(never)]
    fn take_request(&mut self) {
        if let Some(request) = self.links.requests.dequeue() {
            self.accept(request);
        }
    }

    /// What single bytes ask for, whatever the console is about.
    fn take_asked(&mut self) {
        let asked = self.links.asked.take_for_tick();
        if asked.stop {
            self.accept(Request::Stop);
        }
        // The byte works twice, and is one emergency.
        if asked.emergency && self.latch.fault() != Some(Fault::Emergency) {
            self.accept(Request::Emergency);
        }
    }

    #[inline]
    fn give_back(&mut self, memory: Option<MotionMemory<'m>>) {
        if let Some(memory) = memory {
            self.return_memory(memory);
        }
    }

    #[cold]
    #[inline(never)]
    fn return_memory(&mut self, memory: MotionMemory<'m>) {
        // One of the two histories is always live; the queue has room for the other and an uploaded command.
        let _returned = offer(&mut self.links.retired, memory);
    }

    fn accept(&mut self, request: Request<'m>) {
        match request {
            // Planned from rest, which a fault may have ended since.
            Request::Start(plan) if !self.drive.may_move() || self.has_source() => {
                self.give_back(plan.into_memory());
            }
            Request::Start(plan) => {
                // Planned at rest, where a lag has nothing left to hold back.
                self.shaping.end_lag();
                // At rest the shaper is where the setpoint is.
                self.past_shaper = false;
                // Where a stop ended need not be a whole nanometre; a motion begins at one.
                self.recent = [self.command.into(); 3];
                self.braking = self.setup.braking;
                self.ramp_ticks = self.setup.drive.times.ramp;
                self.change_motion(Motion::Planned(plan));
            }
            Request::Stop => match self.motion {
                Motion::Planned(_) => {
                    self.change_motion(Motion::Stop(StopPlan::new(self.recent, self.braking)));
                }
                Motion::Following => self.stop_following(),
                Motion::Homing(_) => {
                    self.change_motion(Motion::Stop(StopPlan::new(self.recent, self.braking.hardest())));
                }
                _ => {}
            },
            Request::Home(plan) => self.begin_homing(plan),
            Request::Shape(cascade, fade) => {
                // The console owns the second history only while no handover is under way, so the cascade
                // is accepted; were it not, its memory would go back at once.
                let replaced = match self.shaping.hand_over(cascade, fade, self.command, self.quiet_ticks) {
                    Ok(replaced) => replaced,
                    Err(refused) => Some(refused.history),
                };
                self.give_back(replaced.map(MotionMemory::History));
            }
            Request::Configure(setup) => self.configure(setup),
            Request::Emergency => {
                self.note(Event::Emergency, 0);
                self.trip(Fault::Emergency);
            }
            Request::Clear => {
                if self.latch.fault().is_some() && self.is_at_rest() && !self.drive.is_stopping() {
                    self.clear();
                }
            }
            Request::Enable => self.enable(),
            Request::Disable => self.tell_drive(DriveEvent::Disable),
            Request::SetPosition(position) => self.set_position(position),
            Request::ReferenceEncoder => {
                if let Some(encoder) = &mut self.encoder {
                    encoder.set_reference(self.setpoint);
                    self.position_known = true;
                }
            }
            Request::Stream { decimation } => self.stream = Stream { decimation, ..Stream::default() },
        }
    }

    /// Outputs and encoder go on from the setpoint, without a step, where their scale has changed.
    fn configure(&mut self, mut setup: Setup) {
        setup.guard = self.lenient_guard(setup.guard);
        let rescales = setup.pulses != self.setup.pulses || setup.encoder != self.setup.encoder;
        if setup.pulses != self.setup.pulses {
            let setpoint = self.setpoint;
            self.pulses = setup.pulses.map(|scale| match &self.pulses {
                Some(pulses) => pulses.rescaled(scale, setpoint),
                None => Pulses::new(scale, setpoint),
            });
        }
        if setup.encoder != self.setup.encoder {
            let (counter, at) = (self.encoder_counter, self.setpoint);
            self.encoder = setup.encoder.map(|scale| Encoder::new(scale, counter, at));
            self.conditions.put(Flags::ENCODER_OFF, false);
        }
        self.configure_source(setup.source);
        self.setup = setup;
        // Who has to find a reference has to find it again: what was found is another distance now.
        self.referenced &= !rescales || setup.unreferenced.is_none();
        self.guard_travel();
    }

    /// Looks at the inputs and stops the machine where they say so. Returns where the encoder says it is.
    // Part of either tick, as its telemetry is.
    #[inline(always)]
    fn observe(&mut self, inputs: Inputs) -> Option<Nanometres> {
        // One branch for all that hardly ever happens.
        let unusual = self.setup.drive.inputs.unusual(inputs.contacts);
        let asked = self.links.asked.waits_for_tick();
        let flagged = u32::from(inputs.emergency)
            | u32::from(inputs.late)
            | u32::from(self.attention)
            | u32::from(asked);
        if flagged | u32::from(unusual.bits()) | u32::from(inputs.missed_ticks) != 0 {
            self.react(unusual, inputs.emergency, inputs.missed_ticks, inputs.late);
        }
        self.conditions.flags = self.conditions.flags.with_contacts(inputs.contacts);
        self.encoder_counter = inputs.encoder_counter;
        let setpoint = self.setpoint;
        let encoder = self.encoder.as_mut()?;
        let position = encoder.update(inputs.encoder_counter);
        let off = encoder.is_off(position, setpoint);
        let was_off = self.conditions.put(Flags::ENCODER_OFF, off);
        if off {
            self.note_encoder(position, was_off);
        }
        Some(position)
    }

    /// The setpoint that may go out.
    fn guarded<const FOLLOWS: bool>(&mut self, shaped: Nanometres) -> Nanometres {
        let shaped = if FOLLOWS { self.limited(shaped) } else { shaped };
        if self.past_shaper {
            return self.command;
        }
        if self.guard.forbids(self.setpoint, shaped) {
            return self.brake_at_limit(shaped);
        }
        shaped
    }

    fn note(&mut self, event: Event, value: i32) {
        self.links.status.counters().add(event);
        // Where the queue is full, the counter still tells.
        let _counted = offer(&mut self.links.events, EventRecord { tick: self.tick, event, value });
    }

    #[inline]
    fn note_clamping(&mut self, clamped: bool) {
        if clamped != self.conditions.clamp {
            self.conditions.clamp = clamped;
            if clamped {
                self.note(Event::Clamp, self.setpoint.0);
            }
        }
    }

    #[inline]
    fn flags(&self) -> Flags {
        if self.latch.fault().is_none() {
            return self.conditions.flags;
        }
        let settled = self.is_at_rest() && !self.drive.is_stopping();
        let settled = if settled { Flags::SETTLED.0 } else { 0 };
        Flags(self.conditions.flags.0 | Flags::FAULT.0 | settled)
    }

    /// Of the tick alone, so that it is part of it.
    #[inline]
    fn advance_command<const FOLLOWS: bool>(&mut self) {
        let next = match &mut self.motion {
            Motion::Following if FOLLOWS => return self.follow_source(),
            Motion::Homing(_) => return self.step_homing(),
            Motion::Hold | Motion::Following => None,
            Motion::Planned(plan) if !FOLLOWS => plan.step(),
            Motion::Planned(_) => None,
            Motion::Stop(plan) | Motion::Braking(plan) => plan.step(),
        };
        let Some(position) = next else {
            if !matches!(self.motion, Motion::Hold) {
                self.end_motion();
            }
            self.quiet_ticks = self.quiet_ticks.saturating_add(1);
            return;
        };
        self.follow(position);
    }

    /// The next position of the command.
    #[inline]
    fn follow(&mut self, position: FinePosition) {
        self.command = position.rounded();
        self.quiet_ticks = 0;
        let [_, before, now] = self.recent;
        self.recent = [before, now, position];
    }

    #[cold]
    #[inline(never)]
    fn end_motion(&mut self) {
        self.change_motion(Motion::Hold);
    }

    fn change_motion(&mut self, next: Motion<'m>) {
        self.lines = self.lines.with(Lines::IN_POSITION, false);
        if let Motion::Planned(plan) = core::mem::replace(&mut self.motion, next) {
            self.give_back(plan.into_memory());
        }
    }

    /// Whether a command that stays where it is no longer moves the setpoint.
    #[inline]
    fn is_settled(&self) -> bool {
        // A shaper that changes nothing has always run out; pulses may come all the same.
        let pulses = matches!(self.motion, Motion::Following) & (self.quiet_ticks <= Self::PAUSE_TICKS);
        self.shaping.is_settled(self.quiet_ticks) & !self.lags & !pulses
    }

    fn is_at_rest(&self) -> bool {
        matches!(self.motion, Motion::Hold | Motion::Following) && self.is_settled()
    }

    /// What the machine does; and where it holds, whether it is in position, which is known here without a
    /// question that a move would be asked, too. What begins a motion, a fault or the end of a drive says at
    /// once that it is not.
    #[inline]
    fn activity<const FOLLOWS: bool>(&mut self) -> Activity {
        match &self.motion {
            _ if self.latch.fault().is_some() => Activity::Fault,
            Motion::Planned(plan) => plan.activity(),
            Motion::Homing(_) => Activity::Homing,
            Motion::Stop(_) | Motion::Braking(_) => Activity::Stopping,
            Motion::Hold | Motion::Following => {
                let settled =
                    if FOLLOWS { self.is_settled() } else { self.shaping.is_settled(self.quiet_ticks) };
                let wrong = self.conditions.flags.contains(Flags::ENCODER_OFF);
                self.lines = self.lines.with(Lines::IN_POSITION, settled & !wrong & self.outputs.enable);
                match self.motion {
                    _ if settled => Activity::Rest,
                    Motion::Following if FOLLOWS => Activity::Following,
                    _ => Activity::Settling,
                }
            }
        }
    }

    #[inline(always)]
    fn offer_sample(&mut self, encoder: Option<Nanometres>, flags: Flags, activity: Activity) -> bool {
        let stream = &mut self.stream;
        if stream.decimation == 0 {
            return false;
        }
        if stream.ticks_to_next > 0 {
            stream.ticks_to_next -= 1;
            return false;
        }
        stream.ticks_to_next = stream.decimation - 1;
        let sample = Sample {
            sequence: self.stream.sequence,
            tick: self.tick,
            command: self.command,
            setpoint: self.setpoint,
            encoder,
            flags,
            activity,
        };
        self.stream.sequence = self.stream.sequence.wrapping_add(1);
        let queued = offer(&mut self.links.samples, sample).is_ok();
        if !queued {
            self.links.status.counters().add(Event::SampleLost);
        }
        queued
    }
}

/// Queues `value`, or gives it back when the queue is full.
///
/// heapless reduces its index modulo a length that it keeps at run time, which the compiler guards with a
/// panic for zero. No queue has that length; saying so here takes the panic out of the interrupt.
#[inline]
fn offer<T>(queue: &mut Producer<'_, T>, value: T) -> Result<(), T> {
    // The capacity is the length less one.
    if queue.capacity() == usize::MAX { Err(value) } else { queue.enqueue(value) }
}
