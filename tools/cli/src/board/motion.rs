//! A motion with every streamed setpoint of it.

use std::time::Duration;

use stillbeam_firmware::telemetry::Sample;

use super::{BoardError, Session};

/// Real time that a motion may take longer than its ticks say, for slow emulators: a factor and a constant.
const SLOWEST: (f64, Duration) = (8.0, Duration::from_secs(10));

/// What [`Session::run_motion`] collected.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamedMotion {
    /// Ticks per second.
    pub tick_hz: f64,
    /// Ticks from one sample to the next.
    pub decimation: u32,
    /// The samples, the first ones before the motion's start.
    pub samples: Vec<Sample>,
    /// Samples that are missing before and between them; none in what [`Session::run_motion`] returns.
    pub gaps: Vec<Gap>,
    /// Frames that came damaged.
    pub damaged_frames: u64,
    /// Faults that came up meanwhile, in the board's words; none in what [`Session::run_motion`] returns.
    pub faults: Vec<String>,
    /// Index of the last sample before the command changes.
    pub start: usize,
    /// Ticks that the command changes for, as the board announced.
    pub command_ticks: u32,
    /// Ticks after which the setpoint does not change any more, as the board announced.
    pub settled_ticks: u32,
}

/// Samples that were lost: dropped by the board or damaged by the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// How many.
    pub lost: u32,
    /// The tick of the first sample after them.
    pub tick: u32,
}

impl StreamedMotion {
    /// Samples per second.
    pub fn rate_hz(&self) -> f64 {
        self.tick_hz / f64::from(self.decimation)
    }

    /// Setpoints in metres, from the last sample before the motion's start on.
    pub fn setpoints_m(&self) -> Vec<f64> {
        let samples = self.samples.iter().skip(self.start);
        samples.map(|sample| f64::from(sample.setpoint.0) * 1e-9).collect()
    }

    /// Where the encoder saw the machine, in metres, from the last sample before the motion's start on;
    /// `None` where the board has no encoder.
    pub fn encoder_m(&self) -> Option<Vec<f64>> {
        let samples = self.samples.iter().skip(self.start);
        samples.map(|sample| Some(f64::from(sample.encoder?.0) * 1e-9)).collect()
    }

    /// Commands in metres, before shaping, from the last sample before the motion's start on.
    pub fn commands_m(&self) -> Vec<f64> {
        let samples = self.samples.iter().skip(self.start);
        samples.map(|sample| f64::from(sample.command.0) * 1e-9).collect()
    }
}

impl Session {
    /// The rate of the board's tick, in hertz.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn tick_hz(&mut self) -> Result<f64, BoardError> {
        let info = self.command("info")?;
        let text = info.line("tick_hz").unwrap_or_default();
        text.parse().map_err(|_| self.unexpected("info", text, "a line `tick_hz NUMBER`"))
    }

    /// Waits until nothing moves, at most `patience` on the link's clock, and returns the position in
    /// nanometres.
    ///
    /// # Errors
    /// As [`Session::command`], and [`BoardError::Timeout`].
    pub fn wait_for_rest(&mut self, patience: Duration) -> Result<i32, BoardError> {
        let deadline = self.clock() + patience;
        loop {
            let status = self.command("status")?;
            let on_its_way = matches!(status.line("drive"), Some("enabling" | "stopping"));
            if status.line("state") == Some("rest") && !on_its_way {
                let text = status.line("command_nm").unwrap_or_default();
                return text
                    .parse()
                    .map_err(|_| self.unexpected("status", text, "a line `command_nm NUMBER`"));
            }
            if self.clock() >= deadline {
                return Err(self.timeout("the motion".to_owned(), patience));
            }
            self.pause(Duration::from_millis(20));
        }
    }

    /// Runs `move ...` or `sweep ...` with telemetry of every `decimation`-th tick (1 or more) and returns
    /// all samples until `extra_s` seconds after the setpoint has come to rest. `progress` is told how much
    /// of the motion is done, from 0 to 1.
    ///
    /// # Errors
    /// As [`Session::command`]; [`BoardError::SamplesLost`] when a sequence number is missing,
    /// [`BoardError::Fault`] when a fault ended the motion.
    pub fn run_motion(
        &mut self,
        motion: &str,
        decimation: u32,
        extra_s: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<StreamedMotion, BoardError> {
        self.stream_motion(motion, decimation, (extra_s, false), progress)
    }

    /// The same, going on when samples are lost or a fault ends the motion: [`StreamedMotion::gaps`] and
    /// [`StreamedMotion::faults`] have them.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn record_motion(
        &mut self,
        motion: &str,
        decimation: u32,
        extra_s: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<StreamedMotion, BoardError> {
        self.stream_motion(motion, decimation, (extra_s, true), progress)
    }

    fn stream_motion(
        &mut self,
        motion: &str,
        decimation: u32,
        (extra_s, with_flaws): (f64, bool),
        progress: &mut dyn FnMut(f64),
    ) -> Result<StreamedMotion, BoardError> {
        let tick_hz = self.tick_hz()?;
        let rest_nm = self.wait_for_rest(Duration::from_secs(20))?;
        self.forget_samples();
        self.take_damaged_frames();
        self.take_faults();
        self.keep_alive()?;
        self.start_stream(decimation)?;
        let mut run = StreamedMotion {
            tick_hz,
            decimation,
            samples: Vec::new(),
            gaps: Vec::new(),
            damaged_frames: 0,
            faults: Vec::new(),
            start: 0,
            command_ticks: 0,
            settled_ticks: 0,
        };
        let collected = self.collect(&mut run, motion, rest_nm, (extra_s, with_flaws), progress);
        // Telemetry is switched off in any case, so that whoever comes next finds a quiet line.
        let stopped = self.command("stream off");
        collected?;
        stopped?;
        self.forget_samples();
        run.damaged_frames = self.take_damaged_frames();
        run.faults = self.take_faults();
        match run.faults.first().cloned() {
            Some(fault) if !with_flaws => {
                Err(BoardError::Fault { board: self.board().to_owned(), motion: motion.to_owned(), fault })
            }
            _ => Ok(run),
        }
    }

    /// Switches telemetry of every `decimation`-th tick on, in frames, or as text where the firmware has
    /// none.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn start_stream(&mut self, decimation: u32) -> Result<(), BoardError> {
        match self.command(&format!("stream on {decimation} frames")) {
            Err(BoardError::Refused { code, .. }) if code == "syntax" => {
                self.command(&format!("stream on {decimation}"))?;
            }
            answer => {
                answer?;
            }
        }
        Ok(())
    }

    fn collect(
        &mut self,
        run: &mut StreamedMotion,
        motion: &str,
        rest_nm: i32,
        (extra_s, with_flaws): (f64, bool),
        progress: &mut dyn FnMut(f64),
    ) -> Result<(), BoardError> {
        let (tick_hz, decimation) = (run.tick_hz, run.decimation);
        let reply = self.command_when_ready(motion)?;
        let ticks = |key| reply.field(key).and_then(|text| text.parse::<u32>().ok());
        let (Some(command_ticks), Some(settled_ticks)) = (ticks("ticks"), ticks("settled_ticks")) else {
            return Err(self.unexpected(motion, &reply.ok_line, "`ticks=N` and `settled_ticks=N`"));
        };
        (run.command_ticks, run.settled_ticks) = (command_ticks, settled_ticks);
        let after_start = u64::from(settled_ticks) + (extra_s.max(0.0) * tick_hz).ceil() as u64;
        let patience = Duration::from_secs_f64(SLOWEST.0 * after_start as f64 / tick_hz) + SLOWEST.1;
        let deadline = self.clock() + patience;
        let mut started = command_ticks == 0;
        loop {
            let Some(sample) = self.next_sample(deadline)? else {
                return Err(self.timeout(format!("`{motion}`"), patience));
            };
            let last = run.samples.last().map(|last| last.sequence);
            let lost = sample.sequence.wrapping_sub(last.map_or(0, |last| last.wrapping_add(1)));
            let tick = sample.tick;
            if lost > u32::MAX / 2 {
                // What came so far was left of an earlier stream.
                (run.start, started) = (0, command_ticks == 0);
                run.samples.clear();
                run.gaps.clear();
            } else if lost != 0 {
                run.gaps.push(Gap { lost, tick });
                // Whether the first samples are missing, or these are left of an earlier stream, shows later.
                if last.is_some() && !with_flaws {
                    return Err(self.samples_lost(run));
                }
            }
            started |= sample.command.0 != rest_nm;
            run.samples.push(sample);
            if !started {
                run.start = run.samples.len() - 1;
                continue;
            }
            // A little less than what has passed since the start, so that the end is not cut short.
            let first_tick = run.samples.get(run.start).map_or(sample.tick, |first| first.tick);
            let elapsed = u64::from(sample.tick.wrapping_sub(first_tick));
            progress((elapsed as f64 / after_start.max(1) as f64).min(1.0));
            if elapsed >= after_start + u64::from(decimation) {
                let flawed = !with_flaws && !run.gaps.is_empty();
                return if flawed { Err(self.samples_lost(run)) } else { Ok(()) };
            }
        }
    }

    /// What to say of the last gap.
    fn samples_lost(&self, run: &StreamedMotion) -> BoardError {
        let Gap { lost, tick } = run.gaps.last().copied().unwrap_or(Gap { lost: 0, tick: 0 });
        BoardError::SamplesLost { board: self.board().to_owned(), lost, tick }
    }
}
