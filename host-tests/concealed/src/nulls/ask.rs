//! Asks the tool about cases in which nothing is missing, and says what it said.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::draw::{NullCase, draw};
use super::recording;
use crate::patience::{Ended, wait};
use crate::score::answer::Answer;

/// What to ask.
#[derive(Debug, Clone)]
pub struct Nulls {
    /// The `stillbeam` program.
    pub tool: PathBuf,
    /// Folder for the cases.
    pub out: PathBuf,
    /// Seed.
    pub seed: u64,
    /// Numbers of the cases.
    pub cases: Vec<usize>,
    /// Parameters of the model are wrong by up to this share.
    pub wrong: f64,
    /// Processor seconds that the tool has per case.
    pub limit_s: f64,
    /// Cases at a time.
    pub jobs: usize,
}

/// What a tool says of a machine of which nothing is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Said {
    /// Nothing is missing: parameters were wrong at most.
    Adequate,
    /// A mode that the model does not have, and the truth has.
    TrueMode,
    /// Something is missing.
    Missing,
    /// A law that is not there.
    FalseName,
    /// Nothing in time, or nothing at all.
    NoAnswer,
}

impl Said {
    /// All, the right ones first.
    pub const ALL: [Self; 5] =
        [Self::Adequate, Self::TrueMode, Self::Missing, Self::FalseName, Self::NoAnswer];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Adequate => "nothing missing",
            Self::TrueMode => "a true further mode",
            Self::Missing => "something missing",
            Self::FalseName => "a false name",
            Self::NoAnswer => "no answer",
        }
    }

    /// Whether it is right.
    pub fn is_right(self) -> bool {
        matches!(self, Self::Adequate | Self::TrueMode)
    }
}

/// One case and its answer.
#[derive(Debug, Clone)]
pub struct Heard {
    /// Number of the case.
    pub number: usize,
    /// What drives it, its rate, what is between samples, and how many modes more it has.
    pub machine: String,
    /// What drives it, in words.
    pub drive: &'static str,
    /// Samples per second.
    pub rate_hz: f64,
    /// What was said.
    pub said: Said,
    /// Its verdict and names.
    pub details: String,
    /// Processor seconds.
    pub seconds: f64,
}

/// Asks about all cases; `progress` gets a line per case. Cases that could not be made or written are left
/// out.
pub fn ask_all(nulls: &Nulls, progress: &(dyn Fn(&str) + Sync)) -> Vec<Heard> {
    let next = AtomicUsize::new(0);
    let heard = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..nulls.jobs.max(1) {
            scope.spawn(|| {
                while let Some(&number) = nulls.cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let Some(one) = draw(nulls.seed, number, nulls.wrong).and_then(|case| ask(nulls, &case))
                    else {
                        progress(&format!("{number}: could not be made"));
                        continue;
                    };
                    progress(&format!(
                        "{number}  {}: {} ({}) in {:.1} s",
                        one.machine,
                        one.said.words(),
                        one.details,
                        one.seconds
                    ));
                    if let Ok(mut heard) = heard.lock() {
                        heard.push(one);
                    }
                }
            });
        }
    });
    let mut heard: Vec<Heard> = heard.into_inner().unwrap_or_default();
    heard.sort_by_key(|one| one.number);
    heard
}

fn ask(nulls: &Nulls, case: &NullCase) -> Option<Heard> {
    let folder = nulls.out.join(format!("{:04}", case.number));
    write(case, &folder)?;
    let of = |wanted: bool| {
        let chosen = case.runs.iter().filter(move |run| run.held_out == wanted);
        chosen.map(|run| format!("{}.csv", run.name))
    };
    let mut command = Command::new(&nulls.tool);
    command.arg("diagnose").arg("model.toml").args(of(false)).arg("--held-out").args(of(true));
    command.args(["--json", "answer.json", "--processor-limit"]).arg(format!("{:.1}", 0.6 * nulls.limit_s));
    let messages = fs::File::create(folder.join("messages.txt")).ok()?;
    let child = command
        .current_dir(&folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(messages)
        .spawn()
        .ok()?;
    let finished = wait(child, nulls.limit_s).ok()?;
    let answer = match finished.how {
        Ended::Well => {
            fs::read_to_string(folder.join("answer.json")).ok().and_then(|text| Answer::read(&text))
        }
        _ => None,
    };
    let (said, details) = judge(case, answer.as_ref());
    let machine = format!(
        "{}, {} Hz, {}, {} more modes",
        case.drive.words(),
        case.rate_hz,
        case.between.words(),
        case.more_modes
    );
    let (drive, rate_hz, seconds) = (case.drive.words(), case.rate_hz, finished.seconds);
    Some(Heard { number: case.number, machine, drive, rate_hz, said, details, seconds })
}

fn write(case: &NullCase, folder: &Path) -> Option<()> {
    let _nothing_there = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).ok()?;
    fs::write(folder.join("model.toml"), &case.model).ok()?;
    for run in &case.runs {
        let file = folder.join(&run.name).with_extension("csv");
        fs::write(file, recording::text(case.rate_hz, &run.columns)).ok()?;
    }
    Some(())
}

/// A further mode is no false name where the truth has one; all else that is named is.
fn judge(case: &NullCase, answer: Option<&Answer>) -> (Said, String) {
    let Some(answer) = answer else { return (Said::NoAnswer, String::new()) };
    let names: Vec<String> =
        answer.effects.iter().map(|effect| format!("{} at {}", effect.id, effect.location)).collect();
    let details = format!("{} {}", answer.verdict, names.join(" + ")).trim_end().to_owned();
    let is_mode = |id: &str| case.more_modes > 0 && id == "extra_mode";
    let said = match answer.verdict.as_str() {
        _ if answer.effects.iter().any(|effect| !is_mode(&effect.id)) => Said::FalseName,
        _ if !answer.effects.is_empty() => Said::TrueMode,
        "adequate" => Said::Adequate,
        _ => Said::Missing,
    };
    (said, details)
}
