//! What the threads that serve pages and the one that owns the board share. None of it makes the board wait:
//! orders and frames are bounded, locks are held for moments, and stops pass by all of it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::extract::ws::Utf8Bytes;
use tokio::sync::{Semaphore, broadcast, mpsc, oneshot, watch};

use super::control::Control;
use super::kept::Kept;
use super::orders::Order;
use super::response::Sweep;
use super::secret::Secret;
use super::settings::LiveSettings;
use crate::board::StopLine;

/// Orders that wait for the board.
const MOST_ORDERS: usize = 8;

/// Frames that wait for a page: half a second. A page that is later misses some.
const MOST_FRAMES: usize = 16;

/// What the board does not change while it is looked at.
#[derive(Clone, Debug)]
pub struct BoardFacts {
    /// What messages call it.
    pub name: String,
    /// Ticks per second.
    pub tick_hz: f64,
    /// Ticks per sample.
    pub decimation: u32,
}

/// An order with the page that waits for the answer.
#[derive(Debug)]
pub struct Letter {
    /// What to do.
    pub order: Order,
    /// How many stops had been asked for when it was given. A later one cancels it.
    pub stops_before: u32,
    /// The board's answer, or why it was not done.
    pub answer: oneshot::Sender<Result<String, String>>,
}

/// What is shared.
#[derive(Debug)]
pub struct Desk {
    /// The word in the address.
    pub token: Secret,
    /// The port that is listened on.
    pub port: u16,
    /// Where recordings are saved.
    pub folder: PathBuf,
    /// The board.
    pub facts: BoardFacts,
    /// Pulled by whoever wants the machine stopped.
    pub stops: StopLine,
    /// The newest tick that has come from the board.
    tick: AtomicU32,
    has_ended: watch::Sender<bool>,
    /// One preview at a time, one recording that is written at a time.
    pub work: Arc<Semaphore>,
    orders: mpsc::Sender<Letter>,
    frames: broadcast::Sender<Utf8Bytes>,
    control: Mutex<Control>,
    kept: Mutex<Kept>,
    settings: Mutex<Arc<LiveSettings>>,
    sweep: Mutex<Option<Sweep>>,
}

impl Desk {
    /// A desk, and the end of it where orders come out.
    pub fn new(
        (token, port): (Secret, u16),
        folder: PathBuf,
        facts: BoardFacts,
        stops: StopLine,
    ) -> (Self, mpsc::Receiver<Letter>) {
        let (orders, letters) = mpsc::channel(MOST_ORDERS);
        let (frames, _) = broadcast::channel(MOST_FRAMES);
        let desk = Self {
            token,
            port,
            folder,
            facts,
            stops,
            tick: AtomicU32::new(0),
            has_ended: watch::Sender::new(false),
            work: Arc::new(Semaphore::new(1)),
            orders,
            frames,
            control: Mutex::default(),
            kept: Mutex::default(),
            settings: Mutex::default(),
            sweep: Mutex::default(),
        };
        (desk, letters)
    }

    /// Gives an order to the board and waits for what comes of it.
    ///
    /// # Errors
    /// Words for the page: the board refused, or too many orders wait.
    pub async fn order(&self, order: Order) -> Result<String, String> {
        let (answer, answered) = oneshot::channel();
        let letter = Letter { order, stops_before: self.stops.pulls(), answer };
        let sent = self.orders.try_send(letter);
        sent.map_err(|_| "the board has enough to do; wait for what was asked before".to_owned())?;
        answered.await.unwrap_or_else(|_| Err("stillbeam live has ended; start it again".to_owned()))
    }

    /// Gives a frame to all pages. Whoever is late misses it.
    pub fn publish(&self, frame: String) {
        // Nobody may be looking.
        let _pages = self.frames.send(Utf8Bytes::from(frame));
    }

    /// Frames from now on.
    pub fn frames(&self) -> broadcast::Receiver<Utf8Bytes> {
        self.frames.subscribe()
    }

    /// The pages.
    pub fn control(&self) -> MutexGuard<'_, Control> {
        // What is behind the lock is whole between any two of its calls.
        self.control.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The samples.
    pub fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the board was last read to be set to.
    pub fn settings(&self) -> Arc<LiveSettings> {
        Arc::clone(&self.settings.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Notes what the board is set to.
    pub fn note_settings(&self, settings: LiveSettings) {
        *self.settings.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(settings);
    }

    /// The sweep that a page has begun last.
    pub fn sweep(&self) -> Option<Sweep> {
        *self.sweep.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a sweep that has begun.
    pub fn note_sweep(&self, sweep: Sweep) {
        *self.sweep.lock().unwrap_or_else(PoisonError::into_inner) = Some(sweep);
    }

    /// Notes the newest tick.
    pub fn note_tick(&self, tick: u32) {
        self.tick.store(tick, Ordering::Relaxed);
    }

    /// The newest tick.
    pub fn tick(&self) -> u32 {
        self.tick.load(Ordering::Relaxed)
    }

    /// Ends the streams of all pages, and the server.
    pub fn end(&self) {
        self.has_ended.send_replace(true);
    }

    /// Waits for that.
    pub async fn ended(&self) {
        let mut ending = self.has_ended.subscribe();
        // The sender lives as long as this.
        let _ended = ending.wait_for(|ended| *ended).await;
    }
}
