//! Waiting for the tool: a limit of processor time, so that a busy computer changes no mark.

use std::fs;
use std::io;
use std::process::Child;
use std::thread;
use std::time::{Duration, Instant};

/// How often a running tool is looked at.
const LOOK: Duration = Duration::from_millis(40);
/// Clock ticks per second in `/proc`: 100 on every Linux that Rust's host targets run on.
const TICKS_PER_S: f64 = 100.0;
/// A tool that gets less than this share of a processor is ended as well: it may be waiting for something.
/// Small, because a bench that steps back behind other work gets a hundredth and less, and that must change
/// no mark.
const LEAST_SHARE: f64 = 0.002;

/// How a program ended.
pub(crate) enum Ended {
    /// With exit status 0.
    Well,
    /// With another, or by a signal.
    Badly(String),
    /// Its time was over, and it was ended.
    Late,
}

/// A program that has ended.
pub(crate) struct Finished {
    /// How.
    pub(crate) how: Ended,
    /// Processor seconds that it took; wall-clock seconds where the system does not tell.
    pub(crate) seconds: f64,
}

/// Waits for a child of ours, and ends it when its time is over.
pub(crate) fn wait(mut child: Child, limit_s: f64) -> io::Result<Finished> {
    let begun = Instant::now();
    let mut seconds = 0.0;
    loop {
        // Once it has been waited for, the system forgets what it took.
        let wall_s = begun.elapsed().as_secs_f64();
        seconds = processor_seconds(child.id()).unwrap_or(wall_s).max(seconds);
        if let Some(status) = child.try_wait()? {
            let how = match status.code() {
                Some(0) => Ended::Well,
                Some(code) => Ended::Badly(format!("exit {code}")),
                None => Ended::Badly("ended by a signal".to_owned()),
            };
            return Ok(Finished { how, seconds });
        }
        if seconds > limit_s || wall_s > limit_s / LEAST_SHARE {
            child.kill()?;
            child.wait()?;
            return Ok(Finished { how: Ended::Late, seconds });
        }
        thread::sleep(LOOK);
    }
}

/// Processor time of a program that runs or has not been waited for yet; `None` where the system does not
/// tell.
fn processor_seconds(id: u32) -> Option<f64> {
    let text = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
    // After the name, which is in brackets and may hold anything, user and system time are the 12th and 13th.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS_PER_S)
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    fn shell(script: &str) -> Child {
        Command::new("sh").args(["-c", script]).spawn().unwrap()
    }

    #[test]
    fn a_busy_program_is_ended_and_a_quick_one_is_not() {
        let late = wait(shell("while :; do :; done"), 0.2).unwrap();
        assert!(matches!(late.how, Ended::Late) && late.seconds >= 0.2);
        assert!(matches!(wait(shell("exit 0"), 5.0).unwrap().how, Ended::Well));
        let failed = wait(shell("exit 3"), 5.0).unwrap();
        assert!(matches!(failed.how, Ended::Badly(how) if how == "exit 3"));
    }
}
