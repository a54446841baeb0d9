//! The tick: TIM2's update interrupt at the top priority, and the door through which it wakes the rest.
//!
//! The tick itself never takes a lock. Waking an async task does, so the tick only marks a second, low-priority
//! interrupt as pending, and that one wakes the task.

use core::cell::UnsafeCell;
use core::task::Poll;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_sync::waitqueue::AtomicWaker;

use super::outputs;
use crate::control::Controller;

/// Belongs to the tick interrupt from [`start`] on, to the main thread before.
struct ControllerCell(UnsafeCell<Option<Controller<'static>>>);

// SAFETY: the cell is only reached through `start`, before the interrupt is unmasked, and through the interrupt, after.
// Neither can preempt the other, and an interrupt does not preempt itself.
unsafe impl Sync for ControllerCell {}

static CONTROLLER: ControllerCell = ControllerCell(UnsafeCell::new(None));
static SAMPLES_WAITING: AtomicWaker = AtomicWaker::new();

/// An interrupt line whose peripheral is not used.
const DOORBELL: interrupt::Interrupt = interrupt::Interrupt::CAN2_SCE;

/// Gives the controller to the interrupt and starts ticking every `clocks_per_tick` timer clocks. Call once.
pub fn start(controller: Controller<'static>, clocks_per_tick: u32) {
    // SAFETY: see `ControllerCell`: the interrupt is still masked.
    unsafe { *CONTROLLER.0.get() = Some(controller) };
    DOORBELL.set_priority(Priority::P15);
    interrupt::Interrupt::TIM2.set_priority(Priority::P0);
    // SAFETY: both handlers are defined below and what they use has been set up above.
    unsafe {
        DOORBELL.enable();
        interrupt::Interrupt::TIM2.enable();
    }
    pac::TIM2.psc().write_value(0);
    pac::TIM2.arr().write_value(clocks_per_tick - 1);
    // The reload takes effect at the next update, so that a change of rate does not cut a tick short.
    pac::TIM2.cr1().modify(|control| control.set_arpe(true));
    pac::TIM2.dier().modify(|enable| enable.set_uie(true));
    pac::TIM2.cr1().modify(|control| control.set_cen(true));
    // Loads the reload register now; emulators arm their timer on this write.
    pac::TIM2.egr().write(|event| event.set_ug(true));
}

/// Turns TIM2's clock on. Call once, with the other clocks.
pub fn configure() {
    pac::RCC.apb1enr().modify(|clocks| clocks.set_tim2en(true));
}

/// Changes the rate from the next tick on.
pub fn set_clocks_per_tick(clocks_per_tick: u32) {
    pac::TIM2.arr().write_value(clocks_per_tick - 1);
}

/// Waits until the tick has queued samples. May return early; `ready` decides.
pub async fn samples_waiting(ready: impl Fn() -> bool) {
    core::future::poll_fn(|context| {
        SAMPLES_WAITING.register(context.waker());
        if ready() { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
}

#[interrupt]
fn TIM2() {
    pac::TIM2.sr().write(|flags| flags.0 = !1);
    // SAFETY: see `ControllerCell`: from `start` on only this interrupt reaches it.
    let controller = unsafe { &mut *CONTROLLER.0.get() };
    if let Some(controller) = controller {
        let output = controller.tick();
        outputs::set_analog(output.analog);
        if output.sample_queued {
            cortex_m::peripheral::NVIC::pend(DOORBELL);
        }
    }
}

#[interrupt]
fn CAN2_SCE() {
    SAMPLES_WAITING.wake();
}
