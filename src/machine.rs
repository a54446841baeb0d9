//! The memory and the queues that tie console and tick together.

use heapless::spsc::{Consumer, Queue};

use crate::console::{self, Console, Identity};
use crate::control::{Controller, Links, Request};
use crate::fault::{EventLog, EventRecord, MAX_EVENTS};
use crate::motion::{MotionMemory, PieceMemory};
use crate::real_time::Asked;
use crate::settings::Settings;
use crate::shaper::{Cascade, ShaperTable};
use crate::telemetry::{Sample, Status};

/// Samples of history that one table may use. Two histories, one live and one for the next table, take 54 KiB
/// each: one of the board's main memory, one of its core-coupled memory. At 4 kHz a table may last 3.45 s in
/// total.
pub const HISTORY_SAMPLES: usize = 13_824;

/// The memory of one table. Apart from [`Machine`], because a board may keep its two histories in different
/// memories.
pub type History = [i32; HISTORY_SAMPLES];

/// The clock of the board's tick timer, in hertz. A tick takes a whole number of its periods.
pub const TIMER_CLOCK_HZ: u32 = 84_000_000;

/// The core runs at twice that clock.
pub const CORE_CYCLES_PER_TIMER_CLOCK: u32 = 2;

/// Samples that wait for the serial port: 64 ms at 4 kHz when every tick is streamed.
const SAMPLE_QUEUE: usize = 256;

/// A place of a queue stays empty.
const EVENT_QUEUE: usize = MAX_EVENTS + 1;

/// Requests that wait for the interrupt, which takes one per tick.
const REQUEST_QUEUE: usize = 4;

/// All memory of a machine but its two histories. The board keeps one in a `static`, tests make as many as
/// they like.
pub struct Machine<'m> {
    requests: Queue<Request<'m>, REQUEST_QUEUE>,
    retired: Queue<MotionMemory<'m>, 3>,
    plans: [PieceMemory; 2],
    samples: Queue<Sample, SAMPLE_QUEUE>,
    events: Queue<EventRecord, EVENT_QUEUE>,
    status: Status,
    asked: Asked,
}

/// The three parties that share a machine.
pub struct Parts<'m> {
    /// Belongs to the interrupt.
    pub controller: Controller<'m>,
    /// Belongs to whoever reads the serial port.
    pub console: Console<'m>,
    /// Belongs to whoever writes the serial port.
    pub samples: Consumer<'m, Sample>,
    /// For whoever receives bytes.
    pub asked: &'m Asked,
}

impl<'m> Machine<'m> {
    /// Memory for one machine, without its histories.
    pub const fn new() -> Self {
        Self {
            requests: Queue::new(),
            retired: Queue::new(),
            plans: [PieceMemory::new(), PieceMemory::new()],
            samples: Queue::new(),
            events: Queue::new(),
            status: Status::new(),
            asked: Asked::new(),
        }
    }

    /// Divides the machine, with default settings, no shaper and everything at rest at zero.
    pub fn split(&'m mut self, identity: Identity, histories: [&'m mut History; 2]) -> Parts<'m> {
        let settings = Settings::default();
        let [live, spare] = histories;
        let (request_sender, request_receiver) = self.requests.split();
        let (retired_sender, retired_receiver) = self.retired.split();
        let (sample_sender, samples) = self.samples.split();
        let (event_sender, events) = self.events.split();
        let (status, asked) = (&self.status, &self.asked);
        let links = Links {
            requests: request_receiver,
            retired: retired_sender,
            samples: sample_sender,
            events: event_sender,
            status,
            asked,
        };
        let identity_table = ShaperTable::identity(settings.tick_rate());
        let cascade = Cascade::identity(live);
        let controller = Controller::new(links, cascade, settings.setup(settings.tick_rate(), 1.0));
        let links = console::Links {
            requests: request_sender,
            retired: retired_receiver,
            events: EventLog::new(events),
            status,
            asked,
        };
        let [arriving, plan] = &mut self.plans;
        let memory = console::Memory { spare_history: spare, plans: [arriving, plan] };
        let console = Console::new(identity, settings, identity_table, memory, links);
        Parts { controller, console, samples, asked }
    }
}

impl Default for Machine<'_> {
    fn default() -> Self {
        Self::new()
    }
}
