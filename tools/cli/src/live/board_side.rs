//! The side of the board: one thread owns the conversation and is the only one that talks to the board.
//!
//! In each turn it takes the telemetry that has come, serves a stop, watches whether somebody still controls
//! what moves, does one order, and 30 times a second gives all pages a frame. Nothing of it waits for a page.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use stillbeam_firmware::telemetry::{Activity, Sample};
use tokio::sync::mpsc;

use super::desk::{Desk, Letter};
use super::frame::{DriveWords, Frame};
use super::kept::lost_between;
use super::orders::{Doer, Order};
use super::picture::Picture;
use super::response::Sweep;
use super::settings::LiveSettings;
use crate::board::{BoardError, Session};

/// How long to wait for telemetry in one turn.
const TURN: Duration = Duration::from_millis(5);

/// Between two frames.
const FRAME_EVERY: Duration = Duration::from_nanos(1_000_000_000 / 30);

/// Between two looks at what the drive lacks and which fault there is.
const STATUS_EVERY: Duration = Duration::from_millis(250);

/// The conversation and what has come of it.
pub struct BoardSide {
    session: Session,
    desk: Arc<Desk>,
    letters: mpsc::Receiver<Letter>,
    picture: Picture,
    is_virtual: bool,
    /// Stops after which the drive was switched off.
    stops_served: u32,
    /// Whether a page has moved the axis, and whether that was seen.
    own_motion: OwnMotion,
    /// Whether a page has let the drive run.
    has_enabled: bool,
    last: Option<Sample>,
    lost: u64,
    words: DriveWords,
    status_due: Instant,
    frame_due: Instant,
    frames: u64,
}

/// A motion that a page has asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OwnMotion {
    None,
    Asked,
    Seen,
}

impl OwnMotion {
    fn after(self, activity: Activity) -> Self {
        match (self, activity) {
            (Self::None, _) | (Self::Seen, Activity::Rest | Activity::Fault) => Self::None,
            (Self::Asked, Activity::Rest) => Self::Asked,
            (Self::Asked | Self::Seen, _) => Self::Seen,
        }
    }
}

impl BoardSide {
    /// Takes a conversation whose telemetry is off and switches it on.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn new(
        mut session: Session,
        desk: Arc<Desk>,
        letters: mpsc::Receiver<Letter>,
        is_virtual: bool,
    ) -> Result<Self, BoardError> {
        desk.note_settings(LiveSettings::read(&mut session, 1)?);
        session.keep_alive()?;
        session.start_stream(desk.facts.decimation)?;
        let now = Instant::now();
        Ok(Self {
            picture: Picture::new(desk.facts.tick_hz / f64::from(desk.facts.decimation)),
            stops_served: desk.stops.pulls(),
            session,
            desk,
            letters,
            is_virtual,
            own_motion: OwnMotion::None,
            has_enabled: false,
            last: None,
            lost: 0,
            words: DriveWords::default(),
            status_due: now,
            frame_due: now,
            frames: 0,
        })
    }

    /// Serves until it is told to close, and leaves the machine still and, where a page has enabled the
    /// drive, off.
    ///
    /// # Errors
    /// The line or the board failed.
    pub fn run(mut self, closing: &AtomicBool) -> Result<(), BoardError> {
        let served = self.turns(closing);
        if self.has_enabled || self.own_motion != OwnMotion::None {
            let disabled = self.session.disable_drive();
            // What failed first says more.
            served?;
            disabled?;
        } else {
            served?;
        }
        self.session.command("stream off")?;
        Ok(())
    }

    fn turns(&mut self, closing: &AtomicBool) -> Result<(), BoardError> {
        while !closing.load(Ordering::SeqCst) {
            self.turn()?;
        }
        Ok(())
    }

    fn turn(&mut self) -> Result<(), BoardError> {
        let samples = self.session.samples_within(TURN)?;
        self.take(&samples);
        self.serve_stop()?;
        self.watch_control();
        if let Ok(letter) = self.letters.try_recv() {
            self.answer(letter)?;
        }
        let now = Instant::now();
        if now >= self.status_due {
            self.status_due = now + STATUS_EVERY;
            self.words = DriveWords::of(&self.session.command("status")?);
        }
        if now >= self.frame_due {
            // After a pause frames come at their rate again, not all at once.
            self.frame_due = (self.frame_due + FRAME_EVERY).max(now);
            self.publish(now);
        }
        Ok(())
    }

    fn take(&mut self, samples: &[Sample]) {
        for sample in samples {
            if let Some(last) = self.last {
                self.lost += u64::from(lost_between(last.sequence, sample.sequence));
            }
            self.own_motion = self.own_motion.after(sample.activity);
            self.last = Some(*sample);
            self.desk.note_tick(sample.tick);
        }
        self.picture.extend(samples);
        let (damaged, faults) = (self.session.take_damaged_frames(), self.session.take_faults());
        let mut kept = self.desk.kept();
        kept.extend(samples);
        kept.note(damaged, &faults);
    }

    /// The byte that stops has gone out already, in the middle of whatever was waited for. What is left is to
    /// brake the setpoint itself and to switch the drive off.
    fn serve_stop(&mut self) -> Result<(), BoardError> {
        let pulls = self.desk.stops.pulls();
        if pulls == self.stops_served {
            return Ok(());
        }
        self.stops_served = pulls;
        self.status_due = Instant::now();
        match self.session.command("disable") {
            // There is nothing to switch off where a fault has done it.
            Ok(_) | Err(BoardError::Refused { .. }) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Stops what a page has moved when nobody controls it any more.
    fn watch_control(&mut self) {
        let holder = self.desk.control().holder(Instant::now());
        if self.own_motion != OwnMotion::None && holder.is_none() {
            self.own_motion = OwnMotion::None;
            self.desk.stops.pull();
        }
    }

    fn answer(&mut self, letter: Letter) -> Result<(), BoardError> {
        let Letter { order, stops_before, answer } = letter;
        let (session, stops) = (&mut self.session, &self.desk.stops);
        let mut doer = Doer { session, stops, stops_before, is_virtual: self.is_virtual };
        let done = doer.perform(&order);
        // What failed half way may have been done all the same.
        self.has_enabled |= order == Order::Enable;
        if order.is_motion() {
            self.own_motion = OwnMotion::Asked;
        }
        if done.is_ok()
            && let Order::Sweep { from_hz, to_hz, seconds, .. } = order
        {
            let first_tick = self.last.map_or(0, |sample| sample.tick);
            self.desk.note_sweep(Sweep { first_tick, from_hz, to_hz, seconds });
        }
        // The page may have gone.
        let _told = answer.send(done);
        self.status_due = Instant::now();
        if matches!(order, Order::Move { .. } | Order::Apply { .. } | Order::Bypass) {
            let version = self.desk.settings().version.wrapping_add(1);
            self.desk.note_settings(LiveSettings::read(&mut self.session, version)?);
        }
        Ok(())
    }

    fn publish(&mut self, now: Instant) {
        self.frames += 1;
        let (is_controlled, pages) = {
            let mut control = self.desk.control();
            (control.holder(now).is_some(), control.open())
        };
        let frame = Frame {
            number: self.frames,
            tick: self.last.map_or(0, |sample| sample.tick),
            command_nm: self.last.map_or(0, |sample| sample.command.0),
            setpoint_nm: self.last.map_or(0, |sample| sample.setpoint.0),
            encoder_nm: self.last.and_then(|sample| sample.encoder).map(|encoder| encoder.0),
            state: self.last.map_or("unknown", |sample| sample.activity.name()),
            drive: &self.words,
            lost_samples: self.lost,
            kept_samples: self.desk.kept().len(),
            is_controlled,
            pages,
            stops: self.desk.stops.pulls(),
            settings: self.desk.settings().version,
            spans: self.picture.take(),
        };
        self.desk.publish(frame.to_json());
    }
}
