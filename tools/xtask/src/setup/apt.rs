//! Installing packages on a Debian machine, as root or with a sudo that asks nothing.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::apt_sources::{self, Offer, Source};
use crate::failure::Failure;
use crate::run::{output, run, run_with_input, say};

const BACKPORTS_FILE: &str = "/etc/apt/sources.list.d/stillbeam-backports.sources";

/// Checks that packages can be installed here at all.
pub fn check() -> Result<(), Failure> {
    let refuse = |why: &str| Err(Failure::Command { command: "apt-get".to_owned(), how: why.to_owned() });
    if output(Command::new("apt-get").arg("--version")).is_none() {
        return refuse("this machine has no apt");
    }
    if !is_root() && output(Command::new("sudo").args(["-n", "true"])).is_none() {
        return refuse("neither root nor a sudo without password");
    }
    Ok(())
}

/// Fetches the lists of packages.
pub fn update() -> Result<(), Failure> {
    run(privileged("apt-get").args(["update", "-qq"]))
}

/// Installs `packages`, preferring `suite` where one is named. Never removes a package. Lists
/// that are missing or name versions that are gone are the usual reason to fail, so they are
/// fetched for a second try.
pub fn install(packages: &[&str], suite: Option<&str>) -> Result<(), Failure> {
    check()?;
    let attempt = || {
        let mut command = privileged("apt-get");
        command.args(["install", "-y", "-qq", "--no-install-recommends", "--no-remove"]);
        if let Some(suite) = suite {
            command.args(["-t", suite]);
        }
        run(command.args(packages))
    };
    if attempt().is_ok() {
        return Ok(());
    }
    say("once more with fresh package lists");
    update()?;
    attempt()
}

/// The versions of a package that the known lists offer.
pub fn offers(package: &str) -> Vec<Offer> {
    output(Command::new("apt-cache").args(["madison", package]))
        .map(|text| apt_sources::parse_madison(&text))
        .unwrap_or_default()
}

/// Adds the backports suite of the machine's release and returns its name.
pub fn enable_backports() -> Result<String, Failure> {
    let fail =
        |path: &str, reason: &str| Failure::File { path: PathBuf::from(path), reason: reason.to_owned() };
    let release = std::fs::read_to_string("/etc/os-release")
        .map_err(|error| fail("/etc/os-release", &error.to_string()))?;
    if apt_sources::os_release(&release, "ID") != Some("debian") {
        return Err(fail("/etc/os-release", "not Debian, so it has no backports suite"));
    }
    let codename = apt_sources::os_release(&release, "VERSION_CODENAME")
        .ok_or_else(|| fail("/etc/os-release", "it names no release"))?;
    let text = apt_sources::backports(&machine_sources(), codename)
        .ok_or_else(|| fail("/etc/apt", "no source of the release itself was found"))?;
    say(format!("writing {BACKPORTS_FILE}"));
    run_with_input(privileged("tee").arg(BACKPORTS_FILE), &text)?;
    Ok(format!("{codename}-backports"))
}

/// Every source the machine has configured.
fn machine_sources() -> Vec<Source> {
    let mut files: Vec<PathBuf> = std::fs::read_dir("/etc/apt/sources.list.d")
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .collect();
    files.push(PathBuf::from("/etc/apt/sources.list"));
    files.sort();
    files.iter().flat_map(|file| sources_of(file)).collect()
}

fn sources_of(file: &Path) -> Vec<Source> {
    let parse = match file.extension().and_then(|extension| extension.to_str()) {
        Some("sources") => apt_sources::parse_deb822,
        Some("list") => apt_sources::parse_one_line,
        _ => return Vec::new(),
    };
    std::fs::read_to_string(file).map_or_else(|_| Vec::new(), |text| parse(&text))
}

fn is_root() -> bool {
    output(Command::new("id").arg("-u")).is_some_and(|id| id.trim() == "0")
}

fn privileged(program: &str) -> Command {
    let mut command = if is_root() {
        Command::new("env")
    } else {
        let mut sudo = Command::new("sudo");
        sudo.args(["-n", "env"]);
        sudo
    };
    command
        .args(["DEBIAN_FRONTEND=noninteractive", program])
        // Standard output is for what a chore makes.
        .stdout(std::io::stderr());
    command
}
