//! `stillbeam data`: public recordings of real machines, from their homes and checked.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;

use crate::data::DataError;
use crate::data::catalogue::{Original, Set, set, sets};
use crate::data::download::{Arrival, Arrived, client, fetch};
use crate::data::sums::{SUMS, Sums};
use crate::error::CliError;
use crate::streams::{Streams, json_on_stdout};

/// List public recordings of real machines, or fetch one from its home, checked by its SHA-256.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam data list
  stillbeam data fetch klipper_raw_belt_printer --out recordings
  stillbeam data fetch emps --trust-first --out recordings")]
pub struct DataArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Names, sources, licences, and for how many files the SHA-256 of the original is known
    List {
        /// Everything as JSON, every file with its address, to FILE or to standard output (-)
        #[arg(long, value_name = "FILE")]
        json: Option<String>,
    },
    /// Fetch the originals of one set into a folder of its name
    Fetch {
        /// Its name, as `data list` says it
        name: String,
        /// Folder in which the set's folder is made
        #[arg(long, value_name = "FOLDER", default_value = ".")]
        out: PathBuf,
        /// Take files whose SHA-256 is not known as they come, and write it down for the next time
        #[arg(long)]
        trust_first: bool,
        /// Fetch BASE/NAME/FILE instead of the originals' homes: a copy of the files, checked all the same
        #[arg(long, value_name = "BASE")]
        from: Option<String>,
    },
}

impl DataArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        match &self.action {
            Action::List { json } => list(json.as_deref(), streams),
            Action::Fetch { name, out, trust_first, from } => {
                fetch_set(&set(name)?, &out.join(name), *trust_first, from.as_deref(), streams)
            }
        }
    }
}

fn list(json: Option<&str>, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let sets = sets()?;
    if let Some(file) = json {
        let of_file = |original: Original| json!({"file": original.file, "url": original.url, "sha256": original.sha256});
        let of_set = |set: &Set| {
            let files: Vec<_> = set.originals().into_iter().map(of_file).collect();
            json!({"name": set.name, "title": set.title, "cite": set.cite, "licence": set.licence, "holds": set.holds, "files": files})
        };
        let sets: Vec<_> = sets.iter().map(of_set).collect();
        streams.write_json(file, &json!({"schema_version": 1, "sets": sets}))?;
        if json_on_stdout(json) {
            return Ok(());
        }
    }
    for set in &sets {
        let originals = set.originals();
        let checked = originals.iter().filter(|original| original.sha256.is_some()).count();
        let known = match (checked, originals.len()) {
            (0, _) => "SHA-256 of the originals not known: fetch needs --trust-first".to_owned(),
            (checked, all) if checked == all => "SHA-256 of every original known".to_owned(),
            (checked, all) => format!("SHA-256 of {checked} of {all} originals known"),
        };
        writeln!(
            streams.out,
            "{}\n  {}\n  cite:    {}\n  licence: {}\n  holds:   {}\n  files:   {}; {known}\n",
            set.name,
            set.title,
            set.cite,
            set.licence,
            set.holds,
            originals.len(),
        )?;
    }
    Ok(streams.out.flush()?)
}

fn fetch_set(
    set: &Set,
    folder: &Path,
    trust_first: bool,
    from: Option<&str>,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    fs::create_dir_all(folder)
        .map_err(|source| DataError::Disk { file: folder.display().to_string(), source })?;
    let mut sums = Sums::read(folder)?;
    let client = client();
    streams.say(&format!("{}: {}", set.name, set.title));
    streams.say(&format!("licence: {}; cite {}", set.licence, set.cite));
    let originals = set.originals();
    for (number, mut original) in originals.iter().cloned().enumerate() {
        if let Some(base) = from {
            original.url = format!("{}/{}/{}", base.trim_end_matches('/'), set.name, original.file);
        }
        // The list is above what was written down here.
        let expected = original.sha256.clone().or_else(|| sums.of(&original.file).map(str::to_owned));
        if expected.is_none() && !trust_first {
            return Err(DataError::NotKnown { file: original.file, url: original.url }.into());
        }
        let Arrived { arrival, sha256 } = fetch(&client, &original, expected.as_deref(), folder)?;
        let how = match arrival {
            Arrival::WasThere => "was there".to_owned(),
            Arrival::Fetched(bytes) => format!("{bytes} bytes fetched"),
        };
        let right = if expected.is_some() { "right" } else { "not known before, written down" };
        streams.say(&format!(
            "[{}/{}] {}: {how}, SHA-256 {sha256} {right}",
            number + 1,
            originals.len(),
            original.file
        ));
        sums.add(folder, &original.file, &sha256)?;
    }
    streams.say(&format!("{}: {} files and {SUMS}", folder.display(), originals.len()));
    Ok(())
}
