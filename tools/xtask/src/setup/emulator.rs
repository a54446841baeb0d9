//! An emulator that is new enough.

use std::process::Command;

use super::{apt, apt_sources, version};
use crate::failure::Failure;
use crate::run::{output, say};

const PROGRAM: &str = "qemu-system-arm";
/// Older ones have no transmit interrupts in their USART.
const OLDEST: (u32, u32) = (10, 0);

/// Finds the emulator, installing it where there is none or an old one.
pub fn emulator() -> Result<(), Failure> {
    if installed() {
        return Ok(());
    }
    say(format!("installing {PROGRAM} {}.{} or newer", OLDEST.0, OLDEST.1));
    install().map_err(|failure| missing(&failure.to_string()))?;
    if installed() { Ok(()) } else { Err(missing("the package is installed, but the program is too old")) }
}

fn missing(why: &str) -> Failure {
    Failure::Missing {
        what: "an emulator of the board",
        why: why.to_owned(),
        remedy: "install QEMU 10 or newer for ARM system emulation (`qemu-system-arm`; on Debian 12 from \
                 bookworm-backports) so that it is found first on the search path",
    }
}

fn installed() -> bool {
    output(Command::new(PROGRAM).arg("--version"))
        .and_then(|text| version::after(&text, "version "))
        .is_some_and(|found| found >= OLDEST)
}

fn install() -> Result<(), Failure> {
    apt::check()?;
    let mut offers = apt::offers(PROGRAM);
    if offers.is_empty() {
        apt::update()?;
        offers = apt::offers(PROGRAM);
    }
    if let Some(suite) = new_enough(&offers) {
        return apt::install(&[PROGRAM], suite);
    }
    say("the distribution's release has an older one: enabling its backports suite");
    let suite = apt::enable_backports()?;
    apt::update()?;
    apt::install(&[PROGRAM], Some(&suite))
}

/// The suite to name when a new enough version is on offer; inside, `None` where apt takes it anyway.
fn new_enough(offers: &[apt_sources::Offer]) -> Option<Option<&str>> {
    let offer = offers
        .iter()
        .find(|offer| version::of_package(&offer.version).is_some_and(|found| found >= OLDEST))?;
    Some(Some(offer.suite.as_str()).filter(|suite| suite.ends_with("-backports")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use apt_sources::Offer;

    fn offer(version: &str, suite: &str) -> Offer {
        Offer { version: version.to_owned(), suite: suite.to_owned() }
    }

    #[test]
    fn the_release_is_preferred_as_apt_does_and_backports_are_named() {
        assert_eq!(new_enough(&[]), None);
        let old = offer("1:7.2+dfsg-7+deb12u15", "bookworm");
        assert_eq!(new_enough(std::slice::from_ref(&old)), None);
        let backport = offer("1:10.0.2+ds-2+deb13u1~bpo12+1", "bookworm-backports");
        assert_eq!(new_enough(&[backport, old]), Some(Some("bookworm-backports")));
        assert_eq!(new_enough(&[offer("1:10.0.2+ds-2+deb13u1", "trixie")]), Some(None));
    }
}
