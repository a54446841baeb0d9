//! `stillbeam-nulls`: how often `stillbeam diagnose` says that something is missing where nothing is.

use std::path::PathBuf;
use std::process::ExitCode;

use stillbeam_concealed::nulls::ask::{Nulls, Said, ask_all};
use stillbeam_concealed::nulls::page::page;

const USAGE: &str =
    "usage: stillbeam-nulls [--tool PROGRAM] [--cases N] [--case N,...] [--seed S] [--wrong SHARE,...]
                       [--out FOLDER] [--limit SECONDS] [--jobs N] [--page FILE.md] [--least-right SHARE]

  --tool PROGRAM      the stillbeam program to test (the one beside this program)
  --cases N           how many cases of each kind (60)
  --case N,...        only the cases of these numbers
  --seed S            seed of the cases (1)
  --wrong SHARE,...   parameters of the model are wrong by up to this share, one kind of cases for each (0.03,0.3)
  --out FOLDER        where cases and answers go (target/nulls)
  --limit SECONDS     processor time that the tool has per case (120)
  --jobs N            cases at a time (1)
  --page FILE.md      write the results page
  --least-right SHARE fail when a smaller share of the answers is right";

fn main() -> ExitCode {
    match bench() {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("stillbeam-nulls: {message}");
            ExitCode::FAILURE
        }
    }
}

fn bench() -> Result<(), String> {
    let beside = std::env::current_exe()
        .map(|program| program.with_file_name(format!("stillbeam{}", std::env::consts::EXE_SUFFIX)));
    let mut nulls = Nulls {
        tool: beside.unwrap_or_default(),
        out: PathBuf::from("target/nulls"),
        seed: 1,
        cases: (0..60).collect(),
        wrong: 0.0,
        limit_s: 120.0,
        jobs: 1,
    };
    let (mut file, mut least_right, mut shares) = (None::<PathBuf>, 0.0, vec![0.03, 0.3]);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value\n{USAGE}"));
        match word.as_str() {
            "--tool" => nulls.tool = PathBuf::from(value()?),
            "--out" => nulls.out = PathBuf::from(value()?),
            "--cases" => nulls.cases = (0..number(&value()?)?).collect(),
            "--case" => nulls.cases = list(&value()?)?,
            "--seed" => nulls.seed = number(&value()?)?,
            "--wrong" => shares = list(&value()?)?,
            "--limit" => nulls.limit_s = number(&value()?)?,
            "--jobs" => nulls.jobs = number(&value()?)?,
            "--page" => file = Some(PathBuf::from(value()?)),
            "--least-right" => least_right = number(&value()?)?,
            "--help" => {
                println!("{USAGE}");
                return Ok(());
            }
            _ => return Err(format!("unknown option {word}\n{USAGE}")),
        }
    }
    nulls.tool = nulls.tool.canonicalize().map_err(|error| format!("--tool: {error}\n{USAGE}"))?;
    let mut text = format!("# Machines of which nothing is left out\n\n{ABOUT}\n\nSeed {}.\n\n", nulls.seed);
    let (mut right, mut total) = (0, 0);
    let out = nulls.out.clone();
    for wrong in shares {
        nulls.wrong = wrong;
        nulls.out = out.join(format!("wrong_{wrong}"));
        let heard = ask_all(&nulls, &|line| eprintln!("{line}"));
        right += heard.iter().filter(|one| Said::is_right(one.said)).count();
        total += nulls.cases.len();
        let about = format!("Parameters wrong by up to {} %", 100.0 * wrong);
        text = format!("{text}{}\n", page(&about, &heard));
    }
    match file {
        Some(file) => std::fs::write(&file, text).map_err(|error| format!("{}: {error}", file.display()))?,
        None => print!("{text}"),
    }
    if (right as f64) < least_right * total as f64 {
        return Err(format!("{right} of {total} right; a share of {least_right} was asked for"));
    }
    Ok(())
}

/// Before the tables.
const ABOUT: &str = "Made by `stillbeam-nulls` (`cargo xtask nulls`), an independent simulator. Every true beam has five modes, the model \
     one or two; true bodies in a row have up to two more than modelled. Inputs were measured with noise and in steps, \
     are smooth, straight or held between samples; sensors have white noise, a third of them steps. Whoever says \
     anything but \"nothing is missing\", or a further mode where the truth has one, is wrong.";

fn list<T: std::str::FromStr>(text: &str) -> Result<Vec<T>, String> {
    text.split(',').map(number).collect()
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{text}: not a number of that kind\n{USAGE}"))
}
