//! Versions as programs and packages print them.

/// The first `major.minor` after `before` in `text`: `version 10.0.2 (...)`, `rustc 1.96.0`.
pub fn after(text: &str, before: &str) -> Option<(u32, u32)> {
    let (_, rest) = text.split_once(before)?;
    parse(rest)
}

/// `major.minor` at the start of a Debian version, whose epoch is left out: `1:10.0.2+ds-2`.
pub fn of_package(version: &str) -> Option<(u32, u32)> {
    let upstream = version.split_once(':').map_or(version, |(_, rest)| rest);
    parse(upstream)
}

fn parse(text: &str) -> Option<(u32, u32)> {
    let number = text.split(|c: char| !c.is_ascii_digit() && c != '.').next()?;
    let mut parts = number.split('.').map(str::parse);
    Some((parts.next()?.ok()?, parts.next()?.ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_from_programs() {
        let qemu = "QEMU emulator version 10.0.2 (Debian 1:10.0.2+ds-2+deb13u1~bpo12+1)\n";
        assert_eq!(after(qemu, "version "), Some((10, 0)));
        let old = "QEMU emulator version 7.2.17 (Debian 1:7.2+dfsg-7+deb12u15)\n";
        assert_eq!(after(old, "version "), Some((7, 2)));
        let rustc = "rustc 1.96.0 (abc 2026-05-01) (built from a source tarball)\n";
        assert_eq!(after(rustc, "rustc "), Some((1, 96)));
        assert_eq!(after("nothing", "version "), None);
        assert_eq!(after("version ten", "version "), None);
    }

    #[test]
    fn versions_are_read_from_packages() {
        assert_eq!(of_package("1:10.0.2+ds-2+deb13u1~bpo12+1"), Some((10, 0)));
        assert_eq!(of_package("1:7.2+dfsg-7+deb12u18+b3"), Some((7, 2)));
        assert_eq!(of_package("10.1-1"), Some((10, 1)));
        assert_eq!(of_package("none"), None);
    }
}
