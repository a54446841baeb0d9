//! The words of a person, and what a project adds to them.
//!
//! The values of a project become the defaults of the options that they are for, so that `--help` shows them
//! and everything that is typed wins. The parser itself lets options exclude only each other's words, not
//! defaults: a default whose option excludes one that was typed is taken away again here.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::builder::OsStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command};

use super::error::ProjectError;
use super::find::Project;
use super::offers::{COMMANDS, Offer, Offers};
use crate::shell_word::shell_word;

/// The flag that leaves a project out.
pub const WITHOUT: &str = "no-project";

/// What was asked for.
#[derive(Debug)]
pub struct Understood {
    /// By the words and the project.
    pub matches: ArgMatches,
    /// What to say before the work: the project and what was taken of it, and what it does not have yet.
    pub told: Vec<String>,
}

/// Why nothing was understood.
#[derive(Debug)]
pub enum Misunderstood {
    /// The words, or a request for help; and what the project does not have yet.
    Words(clap::Error, Vec<String>),
    /// The project.
    Project(ProjectError),
}

impl From<ProjectError> for Misunderstood {
    fn from(error: ProjectError) -> Self {
        Self::Project(error)
    }
}

/// Reads the words of a command line, the first of them the program's name, in the project around a working
/// directory.
///
/// # Errors
/// [`Misunderstood`].
pub fn understand(
    command: &Command,
    words: &[OsString],
    working_directory: &Path,
) -> Result<Understood, Misunderstood> {
    let said: Vec<&str> = words.iter().skip(1).filter_map(|word| word.to_str()).collect();
    let name = said.iter().find(|word| !word.starts_with('-')).copied().unwrap_or_default();
    let wants_help = said.iter().any(|word| ["--help", "-h"].contains(word));
    let goes_without = said.iter().any(|word| word.strip_prefix("--") == Some(WITHOUT));
    let project = match Project::around(working_directory) {
        _ if goes_without || !COMMANDS.contains(&name) => None,
        Err(_) if wants_help => None,
        found => found?,
    };
    match project {
        Some(project) => within(&project, command, name, words),
        None => match command.clone().try_get_matches_from(words) {
            Ok(matches) => Ok(Understood { matches, told: Vec::new() }),
            Err(error) => Err(Misunderstood::Words(error, Vec::new())),
        },
    }
}

fn within(
    project: &Project,
    command: &Command,
    name: &str,
    words: &[OsString],
) -> Result<Understood, Misunderstood> {
    let mut offers = project.offers(name)?;
    loop {
        let fitted = with_defaults(command.clone(), name, &offers.values);
        let matches =
            fitted.try_get_matches_from(words).map_err(|error| explain(error, project, &offers, words))?;
        let parts = (command.find_subcommand(name), matches.subcommand_matches(name));
        let (Some(described), Some(found)) = parts else {
            return Ok(Understood { matches, told: Vec::new() });
        };
        let typed = typed_ids(found);
        let count = |offers: &Offers| offers.values.iter().map(|offer| offer.values.len()).sum::<usize>();
        let before = count(&offers);
        leave_out_typed_files(&mut offers.values, described, found, &typed);
        offers.values.retain(|offer| typed.contains(offer.id) || !is_excluded(described, offer, &typed));
        if count(&offers) == before {
            let taken: Vec<&Offer> = offers.values.iter().filter(|offer| !typed.contains(offer.id)).collect();
            make_places(&taken)?;
            let missing = offers.missing.iter().filter(|missing| !typed.contains(missing.id));
            let told = taken_line(project, described, &taken).into_iter();
            let told = told.chain(missing.map(|missing| missing.remedy.clone())).collect();
            return Ok(Understood { matches, told });
        }
    }
}

/// The command with these values as its defaults. Its arguments stay in their order, which tells those apart
/// that have no names.
fn with_defaults(command: Command, name: &str, offers: &[Offer]) -> Command {
    let fitted = |argument: Arg| match offers.iter().find(|offer| argument.get_id() == offer.id) {
        Some(offer) => {
            let values: Vec<OsStr> = offer.values.iter().cloned().map(OsStr::from).collect();
            argument.required(false).default_values(values)
        }
        None => argument,
    };
    command.mut_subcommand(name, |subcommand| subcommand.mut_args(fitted))
}

/// The options that were typed.
fn typed_ids(matches: &ArgMatches) -> BTreeSet<String> {
    let is_typed = |id: &&str| matches.value_source(id) == Some(ValueSource::CommandLine);
    matches.ids().map(clap::Id::as_str).filter(is_typed).map(str::to_owned).collect()
}

/// Whether what was typed excludes an option, or lacks what gives it a meaning.
fn is_excluded(command: &Command, offer: &Offer, typed: &BTreeSet<String>) -> bool {
    let any_typed = |ids: &[&str]| ids.iter().any(|id| typed.contains(*id));
    if any_typed(offer.yields_to) || !(offer.needs.is_empty() || any_typed(offer.needs)) {
        return true;
    }
    let argument = |id: &str| command.get_arguments().find(|argument| argument.get_id() == id);
    let excludes = |one: &Arg, other: &Arg| {
        command.get_arg_conflicts_with(one).iter().any(|excluded| excluded.get_id() == other.get_id())
    };
    let Some(offered) = argument(offer.id) else { return false };
    let typed = typed.iter().filter_map(|id| argument(id));
    typed.into_iter().any(|typed| excludes(offered, typed) || excludes(typed, offered))
}

/// Takes the files away from the recordings that were typed for something else: one that is to be held out is
/// not trained on.
fn leave_out_typed_files(
    offers: &mut Vec<Offer>,
    command: &Command,
    found: &ArgMatches,
    typed: &BTreeSet<String>,
) {
    // What has no name may have come to the wrong place: whoever reads it says so.
    let named = command.get_arguments().filter(|argument| argument.get_long().is_some());
    let options = named.map(|argument| argument.get_id().as_str());
    let values = options.filter(|id| typed.contains(*id)).filter_map(|id| found.get_raw(id)).flatten();
    let files: Vec<PathBuf> = values.filter_map(|value| Path::new(value).canonicalize().ok()).collect();
    for offer in offers.iter_mut().filter(|offer| offer.id == "recordings") {
        let is_other = |path: &String| Path::new(path).canonicalize().map_or(true, |it| !files.contains(&it));
        offer.values.retain(is_other);
    }
    offers.retain(|offer| !offer.values.is_empty());
}

/// Folders for the files that are about to be written: an empty one gets lost where projects are copied.
fn make_places(taken: &[&Offer]) -> Result<(), ProjectError> {
    for path in taken.iter().filter(|offer| offer.is_written).flat_map(|offer| &offer.values) {
        let folder = Path::new(path).parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder).map_err(|error| ProjectError::system(folder, &error))?;
        }
    }
    Ok(())
}

/// More recordings than this are counted.
const LISTED: usize = 3;

/// Which project, and what was taken of it, as it would be typed.
fn taken_line(project: &Project, command: &Command, taken: &[&Offer]) -> Option<String> {
    if taken.is_empty() {
        return None;
    }
    let said = |argument: &Arg| {
        let offer = taken.iter().find(|offer| argument.get_id() == offer.id)?;
        Some(match (argument.get_long(), offer.values.as_slice()) {
            (Some(long), values) => {
                let each = values.iter().map(|value| format!("--{long} {}", shell_word(value)));
                each.collect::<Vec<_>>().join(" ")
            }
            (None, values) if values.len() > LISTED => {
                format!("{} files in {}", values.len(), project.folder.join(offer.key).display())
            }
            (None, values) => values.iter().map(|value| shell_word(value)).collect::<Vec<_>>().join(" "),
        })
    };
    let said: Vec<String> = command.get_arguments().filter_map(said).collect();
    let file = project.path().display().to_string();
    Some(format!("from {file}: {} (what you type wins; --{WITHOUT} goes without)", said.join(" ")))
}

/// What the parser found, where the project is to blame in the project's words.
fn explain(error: clap::Error, project: &Project, offers: &Offers, words: &[OsString]) -> Misunderstood {
    let told = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let is_typed = |value: &str| words.iter().any(|word| word.to_string_lossy().contains(value));
    let blamed = told(ContextKind::InvalidValue).filter(|value| !is_typed(value)).and_then(|value| {
        let offer = offers.values.iter().find(|offer| offer.values.iter().any(|it| it == value))?;
        Some((offer, value))
    });
    if let Some((offer, value)) = blamed {
        let problem = match (std::error::Error::source(&error), error.get(ContextKind::ValidValue)) {
            (Some(cause), _) => format!("{value}: {cause}"),
            (None, Some(ContextValue::Strings(possible))) => {
                format!("{value} is none of {}", possible.join(", "))
            }
            _ => format!("{value} is no value for it"),
        };
        let file = project.path().display().to_string();
        return ProjectError::Value { file, key: offer.key.to_owned(), problem }.into();
    }
    let missing = match error.kind() {
        ErrorKind::MissingRequiredArgument => {
            offers.missing.iter().map(|missing| missing.remedy.clone()).collect()
        }
        _ => Vec::new(),
    };
    Misunderstood::Words(error, missing)
}
