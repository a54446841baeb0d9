//! The bench: makes cases, seals them, asks the tool, opens the seals, scores. Two at a time, resumable.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use thiserror::Error;

use crate::case::files::{MODEL, recording, write_case};
use crate::case::maker::{MakeError, make};
use crate::case::{Concealment, Role, Truth};
use crate::patience::{Ended, Finished, wait};
use crate::score::answer::Answer;
use crate::score::judge::{Score, held_out, mark, parameters};
use crate::seal::{SealError, open, seal};
use crate::truth::excitation::Shape;

/// Processor seconds for a free run of the extended model.
const SIMULATION_LIMIT_S: f64 = 20.0;
/// The tool's answer in a case's folder.
pub(crate) const ANSWER: &str = "answer.json";
/// The tool's extended model.
pub(crate) const EXTENDED: &str = "extended.toml";

/// What to run.
#[derive(Debug, Clone)]
pub struct Bench {
    /// The `stillbeam` program.
    pub tool: PathBuf,
    /// Folder for cases, seals and scores.
    pub out: PathBuf,
    /// Seed of the cases.
    pub seed: u64,
    /// How many cases, from number 0.
    pub cases: usize,
    /// Cases at a time; each runs the tool on one thread.
    pub jobs: usize,
    /// Processor seconds that the tool has per case.
    pub limit_s: f64,
    /// Keep scores that are there.
    pub resume: bool,
    /// After so many minutes no case is begun; scores that are there are still collected. 0: none is begun at
    /// all.
    pub minutes: Option<f64>,
    /// Only the cases of these kinds are run.
    pub kinds: Vec<Concealment>,
    /// Only the cases of these numbers, where any are named.
    pub numbers: Option<Vec<usize>>,
}

/// The bench could not be run.
#[derive(Debug, Error)]
pub enum BenchError {
    /// A case could not be drawn.
    #[error(transparent)]
    Make(#[from] MakeError),
    /// A seal could not be opened.
    #[error(transparent)]
    Seal(#[from] SealError),
    /// A file could not be read or written, or the tool not started.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: String,
        /// Why.
        source: io::Error,
    },
}

/// Runs the bench; `progress` gets a line per case, scores come back in the order of their numbers. Cases
/// that the time did not allow are left out.
///
/// # Errors
/// [`BenchError`], the first one met; scores written before stay for `resume`.
pub fn run(bench: &Bench, progress: &(dyn Fn(&str) + Sync)) -> Result<Vec<Score>, BenchError> {
    let (next, done, fresh_ones) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
    let is_asked_for = |number: &usize| bench.numbers.as_ref().is_none_or(|numbers| numbers.contains(number));
    let chosen: Vec<usize> = (0..bench.cases)
        .filter(|&number| bench.kinds.contains(&Concealment::of_case(number)))
        .filter(is_asked_for)
        .collect();
    let results: Mutex<Vec<Score>> = Mutex::new(Vec::new());
    let failure: Mutex<Option<BenchError>> = Mutex::new(None);
    let begun = Instant::now();
    let work = || {
        loop {
            let failed = failure.lock().is_ok_and(|failure| failure.is_some());
            let Some(&number) = chosen.get(next.fetch_add(1, Ordering::Relaxed)).filter(|_| !failed) else {
                break;
            };
            let late = bench.minutes.is_some_and(|minutes| begun.elapsed().as_secs_f64() >= 60.0 * minutes);
            match bench.one(number, late) {
                Ok(None) => {}
                Ok(Some((score, fresh))) => {
                    let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                    if fresh {
                        let fresh_ones = fresh_ones.fetch_add(1, Ordering::Relaxed) + 1;
                        let each_s = begun.elapsed().as_secs_f64() / fresh_ones as f64;
                        let left_s = each_s * (chosen.len() - done) as f64;
                        progress(&line(&score, done, chosen.len(), left_s));
                    }
                    if let Ok(mut results) = results.lock() {
                        results.push(score);
                    }
                }
                Err(error) => {
                    if let Ok(mut failure) = failure.lock() {
                        failure.get_or_insert(error);
                    }
                }
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..bench.jobs.max(1) {
            scope.spawn(work);
        }
    });
    if let Some(error) = failure.into_inner().unwrap_or(None) {
        return Err(error);
    }
    let mut scores = results.into_inner().unwrap_or_default();
    scores.sort_by_key(|score| score.number);
    Ok(scores)
}

fn line(score: &Score, done: usize, cases: usize, left_s: f64) -> String {
    let there: Vec<&str> = score.truth.iter().chain(&score.outside).map(String::as_str).collect();
    format!(
        "{done}/{cases}  case {} {}: {} | {} {} | {} in {:.0} s, {:.0} min left",
        score.number,
        score.concealment.word(),
        there.join(" + "),
        score.verdict,
        score.named.join(" + "),
        score.mark.words(),
        score.seconds,
        left_s / 60.0
    )
}

/// Share of a case's processor time after which the tool is to begin no further search; the rest is for
/// judging what it found.
const SEARCHING: f64 = 0.6;

impl Bench {
    /// One case's score, and whether it was worked out now; `None` where it is too late to begin.
    fn one(&self, number: usize, late: bool) -> Result<Option<(Score, bool)>, BenchError> {
        let name = format!("{number:04}");
        let score_file = self.out.join("scores").join(&name).with_extension("json");
        if self.resume
            && let Some(score) =
                fs::read_to_string(&score_file).ok().and_then(|text| serde_json::from_str(&text).ok())
        {
            return Ok(Some((score, false)));
        }
        if late {
            return Ok(None);
        }
        let folder = self.out.join("cases").join(&name);
        let sealed = self.out.join("sealed").join(&name).with_extension("json");
        // What another run left must not be taken for this one's.
        let _nothing_there = fs::remove_dir_all(&folder);
        let case = make(self.seed, number)?;
        write_case(&case, &folder).map_err(|source| file_error(&folder, source))?;
        let commitment = seal(&case, &sealed, &folder)?;
        let plans = case.truth.runs.clone();
        // From here on the truth is known from the seal only.
        drop(case);
        let asked = self.ask(&folder, &plans)?;
        let (truth, noise_free) = open(&sealed, &folder)?;
        let score = self.score(&truth, &noise_free, commitment, &asked, &folder)?;
        let text = serde_json::to_string_pretty(&score)
            .map_err(|error| file_error(&score_file, io::Error::other(error)))?;
        if let Some(parent) = score_file.parent() {
            fs::create_dir_all(parent).map_err(|source| file_error(parent, source))?;
        }
        fs::write(&score_file, text).map_err(|source| file_error(&score_file, source))?;
        Ok(Some((score, true)))
    }

    fn ask(&self, folder: &Path, plans: &[crate::case::RunPlan]) -> Result<Asked, BenchError> {
        let of = |role: Role| {
            plans.iter().filter(move |plan| plan.role == role).map(|plan| format!("{}.csv", plan.name))
        };
        let mut command = Command::new(&self.tool);
        command.arg("diagnose").arg(MODEL).args(of(Role::Train)).arg("--held-out").args(of(Role::HeldOut));
        command.args(["--json", ANSWER, "--extended-model", EXTENDED]);
        // As somebody with so much time would: no new search near its end, and an answer.
        command.arg("--processor-limit").arg(format!("{:.1}", SEARCHING * self.limit_s));
        let Finished { how, seconds } = self.run_tool(command, folder, self.limit_s)?;
        let answer = match &how {
            Ended::Well => fs::read_to_string(folder.join(ANSWER)).ok().and_then(|text| Answer::read(&text)),
            _ => None,
        };
        let why = match how {
            Ended::Well => "answer without the fields of schema version 1".to_owned(),
            Ended::Badly(how) => how,
            Ended::Late => format!("over {:.0} s", self.limit_s),
        };
        Ok(Asked { answer, why, seconds })
    }

    fn run_tool(&self, mut command: Command, folder: &Path, limit_s: f64) -> Result<Finished, BenchError> {
        let log =
            fs::File::create(folder.join("messages.txt")).map_err(|source| file_error(folder, source))?;
        let started = command
            .current_dir(folder)
            .env("RAYON_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn();
        let child = started.map_err(|source| file_error(&self.tool, source))?;
        wait(child, limit_s).map_err(|source| file_error(&self.tool, source))
    }

    fn score(
        &self,
        truth: &Truth,
        noise_free: &[(String, String)],
        commitment: String,
        asked: &Asked,
        folder: &Path,
    ) -> Result<Score, BenchError> {
        let answer = asked.answer.as_ref();
        let named = |laws: &[crate::truth::law::Physics]| {
            laws.iter().map(|law| format!("{} at {}", law.id, law.location)).collect::<Vec<_>>()
        };
        let mut errors = answer.map(|answer| held_out(truth, answer)).unwrap_or_default();
        // A free decay's own start is fitted, and no file says it.
        let driven = truth.runs.iter().all(|run| run.excitation.shape != Shape::Release);
        let named_any = answer.is_some_and(|answer| !answer.effects.is_empty());
        if driven && named_any && folder.join(EXTENDED).exists() {
            let names: Vec<&str> = truth.channels.iter().map(|channel| channel.column.as_str()).collect();
            let free_run = self.free_run_errors(folder, noise_free, &names)?;
            for (error, to_truth) in errors.iter_mut().zip(free_run) {
                error.extended_to_truth = to_truth;
            }
        }
        Ok(Score {
            number: truth.number,
            commitment,
            concealment: truth.concealment,
            machine: truth.machine.clone(),
            truth: named(&truth.physics),
            outside: named(&truth.outside),
            mark: mark(truth, answer),
            verdict: answer.map_or_else(|| asked.why.clone(), |answer| answer.verdict.clone()),
            named: answer
                .map(|answer| answer.effects.iter().map(|e| format!("{} at {}", e.id, e.location)).collect())
                .unwrap_or_default(),
            parameters: answer.map(|answer| parameters(truth, answer)).unwrap_or_default(),
            held_out: errors,
            left_over_noise: truth.measured.left_over_noise,
            seconds: asked.seconds,
        })
    }

    /// Root mean square between the extended model's free run and the noise-free truth, per column, means
    /// taken off; `None` where the model could not be run.
    fn free_run_errors(
        &self,
        folder: &Path,
        noise_free: &[(String, String)],
        columns: &[&str],
    ) -> Result<Vec<Option<f64>>, BenchError> {
        let mut squares = vec![Some((0.0, 0_usize)); columns.len()];
        for (name, truth) in noise_free {
            let out = format!("{name}_extended.csv");
            let mut command = Command::new(&self.tool);
            command.arg("simulate").arg(EXTENDED).arg("--input").arg(recording(Path::new(""), name));
            command.args(["--out", &out]);
            let ended = self.run_tool(command, folder, SIMULATION_LIMIT_S)?.how;
            let text = match ended {
                Ended::Well => fs::read_to_string(folder.join(&out)).unwrap_or_default(),
                _ => String::new(),
            };
            for (sum, column) in squares.iter_mut().zip(columns) {
                let pair = column_of(&text, column).zip(column_of(truth, column));
                *sum = sum.zip(pair).and_then(|((total, count), (run, truth))| {
                    (run.len() == truth.len()).then(|| {
                        let differ: Vec<f64> = run.iter().zip(&truth).map(|(a, b)| a - b).collect();
                        let mean = differ.iter().sum::<f64>() / differ.len().max(1) as f64;
                        let more: f64 = differ.iter().map(|d| (d - mean).powi(2)).sum();
                        (total + more, count + differ.len())
                    })
                });
            }
        }
        Ok(squares
            .into_iter()
            .map(|sum| sum.map(|(total, count)| (total / count.max(1) as f64).sqrt()))
            .collect())
    }
}

/// A column of CSV text as numbers; `None` if it is not there or a cell is no number.
pub(crate) fn column_of(text: &str, column: &str) -> Option<Vec<f64>> {
    let mut lines = text.lines();
    let index = lines.next()?.split(',').position(|name| name == column)?;
    lines.map(|line| line.split(',').nth(index)?.parse().ok()).collect()
}

struct Asked {
    answer: Option<Answer>,
    why: String,
    seconds: f64,
}

fn file_error(path: &Path, source: io::Error) -> BenchError {
    BenchError::File { path: path.display().to_string(), source }
}
