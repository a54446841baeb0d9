//! `stillbeam-prove`: the bench as a program; `cargo xtask prove` builds the tool and calls it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use stillbeam_concealed::case::Concealment;
use stillbeam_concealed::picture::picture;
use stillbeam_concealed::real::real;
use stillbeam_concealed::run::{Bench, run};
use stillbeam_concealed::score::judge::Mark;
use stillbeam_concealed::score::page::{Making, every_case, page};
use stillbeam_concealed::score::tables::Tally;
use stillbeam_concealed::seal::digest;

const USAGE: &str =
    "usage: stillbeam-prove [--tool PROGRAM] [--cases N] [--seed S] [--out FOLDER] [--limit SECONDS]
                       [--jobs N] [--resume] [--page FILE.md] [--kind KIND,...] [--case N,...]
                       [--least-right N] [--most-wrong N]
       stillbeam-prove --picture CASE FILE.svg [--tool PROGRAM] [--out FOLDER]
       stillbeam-prove --real DATA [--tool PROGRAM] [--out FOLDER] [--page FILE.md]

  --tool PROGRAM    the stillbeam program to test (the one beside this program)
  --cases N         how many cases (300)
  --seed S          seed of the cases (1)
  --out FOLDER      where cases, seals, answers and scores go (target/prove)
  --limit SECONDS   processor time that the tool has per case, one thread (126)
  --jobs N          cases at a time (2)
  --kind KIND,...   only the cases of these kinds (visible, absorbed, buried, masked, null, decoy, outside); no page then
  --case N,...      only the cases of these numbers; no page then
  --resume          keep the scores that are there
  --page FILE.md    write the results page, and every case to FILE.csv beside it
  --least-right N   fail when fewer answers are right
  --minutes M       begin no case after so many minutes, and make the page of those that were scored; 0: of what is there
  --peers FILE      a section to put at the end of the page (host-tests/peers/run_diagnosis)
  --picture CASE FILE.svg   draw a case that has been run: before, located, named, after
  --real DATA       diagnose published recordings of real machines instead of concealed cases
  --only NAME       of them only this one (emps, silverbox, cantilever, cantilever_hum, leadscrew, antibacklash, wormgear)
  --most-wrong N    fail when more answers name what is not there";

fn main() -> ExitCode {
    match bench() {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("stillbeam-prove: {message}");
            ExitCode::FAILURE
        }
    }
}

fn bench() -> Result<(), String> {
    let mut bench = Bench {
        tool: std::env::current_exe()
            .map(|program| program.with_file_name(format!("stillbeam{}", std::env::consts::EXE_SUFFIX)))
            .unwrap_or_default(),
        out: PathBuf::from("target/prove"),
        seed: 1,
        cases: 300,
        jobs: 2,
        limit_s: 126.0,
        resume: false,
        minutes: None,
        kinds: Concealment::ALL.to_vec(),
        numbers: None,
    };
    let (mut page_file, mut least_right, mut most_wrong) = (None::<PathBuf>, 0, usize::MAX);
    let (mut drawn, mut data, mut only) = (None, None, None::<String>);
    let mut peers = None::<PathBuf>;
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value\n{USAGE}"));
        match word.as_str() {
            "--tool" => bench.tool = PathBuf::from(value()?),
            "--out" => bench.out = PathBuf::from(value()?),
            "--cases" => bench.cases = number(&value()?)?,
            "--seed" => bench.seed = number(&value()?)?,
            "--jobs" => bench.jobs = number(&value()?)?,
            "--kind" => bench.kinds = value()?.split(',').map(kind).collect::<Result<_, _>>()?,
            "--case" => bench.numbers = Some(value()?.split(',').map(number).collect::<Result<_, _>>()?),
            "--limit" => bench.limit_s = number(&value()?)?,
            "--page" => page_file = Some(PathBuf::from(value()?)),
            "--least-right" => least_right = number(&value()?)?,
            "--most-wrong" => most_wrong = number(&value()?)?,
            "--real" => data = Some(PathBuf::from(value()?)),
            "--only" => only = Some(value()?),
            "--picture" => {
                let case: usize = number(&value()?)?;
                drawn = Some((case, PathBuf::from(value()?)));
            }
            "--help" => {
                println!("{USAGE}");
                return Ok(());
            }
            "--resume" => bench.resume = true,
            "--minutes" => bench.minutes = Some(number(&value()?)?),
            "--peers" => peers = Some(PathBuf::from(value()?)),
            _ => return Err(format!("unknown option {word}\n{USAGE}")),
        }
    }
    let is_whole = bench.kinds == Concealment::ALL && bench.numbers.is_none();
    if !is_whole && page_file.is_some() {
        return Err(format!("a page shows all cases: --page without --kind and --case\n{USAGE}"));
    }
    // The tool runs in the cases' folders.
    bench.tool = bench.tool.canonicalize().map_err(|error| format!("--tool: {error}\n{USAGE}"))?;
    if let Some((case, file)) = drawn {
        let folder = bench.out.join("cases").join(format!("{case:04}"));
        let svg = picture(&bench.tool, &folder, "check")
            .ok_or(format!("{}: no answer that names anything; run the bench first", folder.display()))?;
        return std::fs::write(&file, svg).map_err(|error| format!("{}: {error}", file.display()));
    }
    if let Some(data) = data {
        // The bench is two folders below the workspace's root.
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
        let text = real(&bench.tool, &data, &models, &bench.out.join("real"), only.as_deref(), bench.resume);
        return publish(page_file.as_deref(), &text.map_err(|error| error.to_string())?);
    }
    let program = std::fs::read(&bench.tool).map_err(|error| format!("{}: {error}", bench.tool.display()))?;
    let version = std::process::Command::new(&bench.tool).arg("--version").output();
    let version = version.map_err(|error| format!("{}: {error}", bench.tool.display()))?;
    let scores = run(&bench, &|line| eprintln!("{line}")).map_err(|error| error.to_string())?;
    let making = Making {
        seed: bench.seed,
        cases: bench.cases,
        limit_s: bench.limit_s,
        tool_version: String::from_utf8_lossy(&version.stdout).trim().to_owned(),
        tool_digest: digest(&program),
    };
    let table = page_file.as_deref().unwrap_or(Path::new("proof.md")).with_extension("csv");
    let name = table.file_name().unwrap_or_default().to_string_lossy();
    let mut text = page(&making, &scores, &name);
    if let Some(file) = peers {
        let section =
            std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        text = format!("{text}\n{section}");
    }
    if is_whole {
        publish(page_file.as_deref(), &text)?;
        if page_file.is_some() {
            publish(Some(&table), &every_case(&scores))?;
        }
    }
    let tally = Tally::of(&scores);
    let (right, wrong) = (tally.count(Mark::Right), tally.count(Mark::Wrong));
    eprintln!("{right} of {} right, {} tied, {wrong} wrong", tally.total(), tally.count(Mark::Tied));
    if right < least_right || wrong > most_wrong {
        return Err(format!(
            "{right} right and {wrong} wrong; at least {least_right} right and at most {most_wrong} wrong were asked for"
        ));
    }
    Ok(())
}

fn publish(file: Option<&Path>, text: &str) -> Result<(), String> {
    match file {
        Some(file) => std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display())),
        None => {
            print!("{text}");
            Ok(())
        }
    }
}

fn kind(word: &str) -> Result<Concealment, String> {
    let found = Concealment::ALL.into_iter().find(|kind| kind.word() == word);
    found.ok_or(format!("{word}: not a kind of concealment\n{USAGE}"))
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{text}: not a number of that kind\n{USAGE}"))
}
