//! Reading how a Debian machine gets its packages, to ask the same place for a further suite.
//!
//! Both forms are read: deb822 (`*.sources`) and one-line (`*.list`); see sources.list(5).

/// A source of packages, reduced to what a further suite of it needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Addresses, as written.
    pub uris: String,
    /// Suites, such as `bookworm`.
    pub suites: Vec<String>,
    /// Components, such as `main`.
    pub components: Vec<String>,
    /// Key file, or an embedded key with its continuation lines.
    pub signed_by: Option<String>,
}

/// Sources of binary packages in a deb822 file.
pub fn parse_deb822(text: &str) -> Vec<Source> {
    let mut stanzas = vec![Vec::<(String, String)>::new()];
    for line in text.lines() {
        if line.starts_with('#') {
            continue;
        }
        if line.trim().is_empty() {
            stanzas.push(Vec::new());
            continue;
        }
        let Some(fields) = stanzas.last_mut() else {
            continue;
        };
        if line.starts_with([' ', '\t']) {
            if let Some((_, value)) = fields.last_mut() {
                value.push('\n');
                value.push_str(line);
            }
        } else if let Some((name, value)) = line.split_once(':') {
            fields.push((name.trim().to_ascii_lowercase(), value.trim().to_owned()));
        }
    }
    stanzas.iter().filter_map(|fields| stanza(fields)).collect()
}

fn stanza(fields: &[(String, String)]) -> Option<Source> {
    let field =
        |wanted: &str| fields.iter().find(|(name, _)| name == wanted).map(|(_, value)| value.as_str());
    let enabled = field("enabled").is_none_or(|value| !value.eq_ignore_ascii_case("no"));
    let binary = field("types")?.split_whitespace().any(|kind| kind == "deb");
    (enabled && binary).then_some(())?;
    Some(Source {
        uris: field("uris")?.to_owned(),
        suites: words(field("suites")?),
        components: words(field("components").unwrap_or_default()),
        signed_by: field("signed-by").map(str::to_owned),
    })
}

/// Sources of binary packages in a one-line file: `deb [options] uri suite component...`.
pub fn parse_one_line(text: &str) -> Vec<Source> {
    text.lines().filter_map(one_line).collect()
}

fn one_line(line: &str) -> Option<Source> {
    let line = line.split('#').next()?.trim();
    let rest = line.strip_prefix("deb")?;
    if !rest.starts_with([' ', '\t']) {
        return None;
    }
    let rest = rest.trim_start();
    let (options, rest) = match rest.strip_prefix('[') {
        Some(inside) => inside.split_once(']')?,
        None => ("", rest),
    };
    let signed_by = options
        .split_whitespace()
        .find_map(|option| option.strip_prefix("signed-by="))
        .map(|keys| keys.replace(',', " "));
    let mut parts = rest.split_whitespace().map(str::to_owned);
    Some(Source { uris: parts.next()?, suites: vec![parts.next()?], components: parts.collect(), signed_by })
}

/// A deb822 file with the backports suite of the release `codename`, from wherever the machine
/// gets the release itself; `None` where it does not say.
pub fn backports(sources: &[Source], codename: &str) -> Option<String> {
    let release = sources.iter().find(|source| {
        source.suites.iter().any(|suite| suite == codename)
            && source.components.iter().any(|component| component == "main")
    })?;
    let signed_by = release.signed_by.as_ref().map_or(String::new(), |keys| format!("Signed-By: {keys}\n"));
    Some(format!(
        "# Written by stillbeam's `cargo xtask setup` for a recent emulator. Safe to delete.\n\
         Types: deb\nURIs: {}\nSuites: {codename}-backports\nComponents: main\n{signed_by}",
        release.uris
    ))
}

/// The value of `name` in an os-release file.
pub fn os_release<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix('='))
        .map(|value| value.trim_matches('"'))
}

/// A version of a package that some suite offers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Offer {
    /// Debian version, epoch included.
    pub version: String,
    /// Suite, such as `bookworm-backports`.
    pub suite: String,
}

/// Reads `apt-cache madison`: `name | version | uri suite/component architecture Packages`.
pub fn parse_madison(text: &str) -> Vec<Offer> {
    text.lines()
        .filter_map(|line| {
            let mut columns = line.split('|').map(str::trim);
            let version = columns.nth(1)?.to_owned();
            let mut place = columns.next()?.split_whitespace().skip(1);
            let (suite, _component) = place.next()?.rsplit_once('/')?;
            // `Sources` lines offer source packages.
            (place.last()? == "Packages").then(|| Offer { version, suite: suite.to_owned() })
        })
        .collect()
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

#[cfg(test)]
#[path = "apt_sources_tests.rs"]
mod tests;
