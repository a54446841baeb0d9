//! The tick: TIM2's update interrupt, before everything but a serial byte, and the door through which it
//! wakes the rest.
//!
//! The tick itself never takes a lock. Waking an async task does, so the tick only marks a second,
//! low-priority interrupt as pending, and that one wakes the task. It also asks, twenty times a second,
//! whether tick and console both moved, and feeds the watchdog if so. It comes before the executor, whose
//! interrupt is pending without a pause while a task has work and yields.
//!
//! TIM9 counts TIM2's updates in hardware. Where it is ahead of the interrupt, ticks were missed. TIM9 has no
//! model in the emulator and stands still there, which counts as "not known".

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::{Context, Poll};

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::{Mms, Sms, Ts};
use embassy_sync::waitqueue::AtomicWaker;

use super::{digital_inputs, emergency_stop, encoder, outputs, pulse_input, step_pulses, watchdog};
use crate::control::{Controller, Inputs};
use crate::machine::TIMER_CLOCK_HZ;
use crate::telemetry::Status;
use crate::watchdog::{HEARTBEATS_PER_S, Progress, Supervisor};

/// What belongs to the tick interrupt from [`start`] on, to the main thread before.
struct TickState {
    controller: Controller<'static>,
    /// TIM9, as it was in the last tick.
    counted: u16,
    /// The next tick was due before the last one ended.
    late: bool,
    ticks_to_heartbeat: u32,
}

/// Filled by [`start`] before it unmasks the interrupt, so that no tick has to ask whether it is.
struct TickCell(UnsafeCell<MaybeUninit<TickState>>);

// SAFETY: the cell is only reached through `start`, before the interrupt is unmasked, and through the
// interrupt, after. Neither can preempt the other, and an interrupt does not preempt itself.
unsafe impl Sync for TickCell {}

/// Belongs to the doorbell's interrupt.
struct SupervisorCell(UnsafeCell<Supervisor>);

// SAFETY: only the doorbell's handler reaches it, and an interrupt does not preempt itself.
unsafe impl Sync for SupervisorCell {}

static STATE: TickCell = TickCell(UnsafeCell::new(MaybeUninit::uninit()));
static SUPERVISOR: SupervisorCell = SupervisorCell(UnsafeCell::new(Supervisor::new()));
static TASK: AtomicWaker = AtomicWaker::new();
/// A heartbeat is due: the console is to make a round.
static HEARTBEAT: AtomicBool = AtomicBool::new(false);
/// A heartbeat is due: the doorbell is to look whether the watchdog may be fed.
static LOOK_DUE: AtomicBool = AtomicBool::new(false);
/// What the tick publishes; null before [`start`].
static STATUS: super::Shared<Status> = super::Shared::new();
/// Rounds of the console's task so far.
static CONSOLE_ROUNDS: AtomicU32 = AtomicU32::new(0);
/// Ticks from one heartbeat to the next.
static HEARTBEAT_TICKS: AtomicU32 = AtomicU32::new(1);

/// An interrupt line whose peripheral is not used.
const DOORBELL: interrupt::Interrupt = interrupt::Interrupt::CAN2_SCE;

/// Gives the controller to the interrupt and starts ticking every `clocks_per_tick` timer clocks. Call once.
pub fn start(controller: Controller<'static>, clocks_per_tick: u32) {
    set_clocks_per_tick(clocks_per_tick);
    STATUS.set(controller.status());
    let state = TickState { controller, counted: 0, late: false, ticks_to_heartbeat: 1 };
    // SAFETY: see `TickCell`: the interrupt is still masked.
    unsafe { (*STATE.0.get()).write(state) };
    DOORBELL.set_priority(Priority::P13);
    interrupt::Interrupt::TIM2.set_priority(Priority::P1);
    // SAFETY: both handlers are defined below and what they use has been set up above.
    unsafe {
        DOORBELL.enable();
        interrupt::Interrupt::TIM2.enable();
    }
    pac::TIM2.psc().write_value(0);
    // The reload takes effect at the next update, so that a change of rate does not cut a tick short.
    pac::TIM2.cr1().modify(|control| control.set_arpe(true));
    pac::TIM2.dier().modify(|enable| enable.set_uie(true));
    pac::TIM2.cr1().modify(|control| control.set_cen(true));
    // Loads the reload register now; emulators arm their timer on this write.
    pac::TIM2.egr().write(|event| event.set_ug(true));
    outputs::latch_by_tick();
}

/// Turns the clocks of both timers on and lets TIM9 count TIM2's updates. Call once, with the other clocks.
pub fn configure() {
    pac::RCC.apb1enr().modify(|clocks| clocks.set_tim2en(true));
    pac::RCC.apb2enr().modify(|clocks| clocks.set_tim9en(true));
    pac::TIM2.cr2().modify(|control| control.set_mms(Mms::UPDATE));
    let counter = pac::TIM9;
    counter.arr().write(|reload| reload.set_arr(u16::MAX));
    // TIM2 is TIM9's trigger 0 (RM0090, table of internal triggers).
    counter.smcr().modify(|slave| {
        slave.set_ts(Ts::ITR0);
        slave.set_sms(Sms::EXT_CLOCK_MODE);
    });
    counter.cr1().modify(|control| control.set_cen(true));
}

/// Changes the rate from the next tick on.
pub fn set_clocks_per_tick(clocks_per_tick: u32) {
    let heartbeat = TIMER_CLOCK_HZ / HEARTBEATS_PER_S / clocks_per_tick;
    HEARTBEAT_TICKS.store(heartbeat.max(1), Ordering::Relaxed);
    pac::TIM2.arr().write_value(clocks_per_tick - 1);
}

/// Wakes the console's task as soon as its priority allows. One store, so it is safe in any context.
#[inline]
pub fn ring() {
    cortex_m::peripheral::NVIC::pend(DOORBELL);
}

/// Lets [`ring`] wake the task of `context`: there is one.
pub fn wake_when_rung(context: &Context<'_>) {
    TASK.register(context.waker());
}

/// Waits until a heartbeat is due, or there is something to do by `ready`.
pub async fn heartbeat_or(ready: impl Fn() -> bool) {
    core::future::poll_fn(|context| {
        wake_when_rung(context);
        if HEARTBEAT.load(Ordering::Relaxed) || ready() { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
}

/// Says that the console's task has made another round.
pub fn console_made_round() {
    HEARTBEAT.store(false, Ordering::Relaxed);
    CONSOLE_ROUNDS.store(CONSOLE_ROUNDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// The number of the last tick.
pub fn ticks() -> u32 {
    STATUS.get().map_or(0, Status::tick)
}

impl TickState {
    #[inline]
    fn run(&mut self) {
        if self.controller.has_source() { self.run_following() } else { self.run_as::<false>() }
    }

    /// Apart, so that a tick without pulses has all registers to itself.
    #[cold]
    #[inline(never)]
    fn run_following(&mut self) {
        self.run_as::<true>();
    }

    /// A tick; see [`Controller::tick_asking`].
    #[inline(always)]
    fn run_as<const FOLLOWS: bool>(&mut self) {
        let counted = pac::TIM9.cnt().read().cnt();
        let inputs = Inputs {
            encoder_counter: encoder::counter(),
            source_counter: if FOLLOWS { pulse_input::counter() } else { 0 },
            emergency: emergency_stop::is_active(),
            contacts: digital_inputs::levels(),
            // One update is this tick's; none means that nobody counts.
            missed_ticks: counted.wrapping_sub(self.counted).saturating_sub(1),
            pulses_busy: false,
            late: self.late,
        };
        self.counted = counted;
        let output = self.controller.tick_asking::<FOLLOWS>(inputs, step_pulses::is_busy);
        outputs::set_lines(output.lines);
        outputs::set_analog(output.analog);
        if let Some(train) = self.controller.train() {
            step_pulses::make(train.steps, train.period, train.up);
        }
        self.ticks_to_heartbeat -= 1;
        let heartbeat = self.ticks_to_heartbeat == 0;
        if heartbeat {
            self.ticks_to_heartbeat = HEARTBEAT_TICKS.load(Ordering::Relaxed);
            HEARTBEAT.store(true, Ordering::Relaxed);
            LOOK_DUE.store(true, Ordering::Relaxed);
        }
        if heartbeat || output.sample_queued {
            ring();
        }
        self.late = pac::TIM2.sr().read().uif();
        // Counted from when the tick was due.
        self.controller.status().note_duration(pac::TIM2.cnt().read());
    }
}

#[interrupt]
fn TIM2() {
    pac::TIM2.sr().write(|flags| flags.0 = !1);
    // SAFETY: see `TickCell`: only `start` unmasks this interrupt, when it has filled the cell, and from then
    // on only the interrupt reaches it.
    unsafe { (*STATE.0.get()).assume_init_mut() }.run();
}

#[interrupt]
fn CAN2_SCE() {
    if LOOK_DUE.load(Ordering::Relaxed) {
        // The next heartbeat is many ticks away, so none gets lost here.
        LOOK_DUE.store(false, Ordering::Relaxed);
        // SAFETY: see `SupervisorCell`.
        let supervisor = unsafe { &mut *SUPERVISOR.0.get() };
        let console_rounds = CONSOLE_ROUNDS.load(Ordering::Relaxed);
        if supervisor.may_feed(Progress { ticks: ticks(), console_rounds }) {
            watchdog::feed();
        }
    }
    TASK.wake();
}
