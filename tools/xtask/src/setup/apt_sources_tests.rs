use super::*;

const DEB822: &str = "\
Types: deb
# a snapshot's address used to be here
URIs: http://mirror.example/debian
Suites: bookworm bookworm-updates
Components: main
Signed-By: /usr/share/keyrings/archive.gpg

Types: deb
URIs: http://mirror.example/debian-security
Suites: bookworm-security
Components: main
Signed-By: /usr/share/keyrings/archive.gpg
";

#[test]
fn backports_come_from_where_the_release_comes_from() {
    let sources = parse_deb822(DEB822);
    assert_eq!(sources.len(), 2);
    let text = backports(&sources, "bookworm").expect("the release is there");
    let written = parse_deb822(&text);
    assert_eq!(
        written,
        [Source {
            uris: "http://mirror.example/debian".to_owned(),
            suites: vec!["bookworm-backports".to_owned()],
            components: vec!["main".to_owned()],
            signed_by: Some("/usr/share/keyrings/archive.gpg".to_owned()),
        }]
    );
    assert_eq!(backports(&sources, "trixie"), None);
}

#[test]
fn one_line_sources_are_read_with_and_without_options() {
    let text = "\
# deb http://commented.example/debian bookworm main
deb-src http://mirror.example/debian bookworm main
deb http://plain.example/debian bookworm main contrib # trailing
deb [arch=amd64 signed-by=/etc/a.gpg,/etc/b.gpg] http://keyed.example/debian bookworm main
debris http://mirror.example/debian bookworm main
deb
deb [unclosed http://mirror.example/debian bookworm main
";
    let sources = parse_one_line(text);
    let uris: Vec<_> = sources.iter().map(|source| source.uris.as_str()).collect();
    assert_eq!(uris, ["http://plain.example/debian", "http://keyed.example/debian"]);
    assert_eq!(sources[0].components, ["main", "contrib"]);
    assert_eq!(sources[0].signed_by, None);
    assert_eq!(sources[1].signed_by.as_deref(), Some("/etc/a.gpg /etc/b.gpg"));
    let text = backports(&sources, "bookworm").expect("the release is there");
    assert!(!text.contains("Signed-By"), "{text}");
}

#[test]
fn embedded_keys_survive_and_switched_off_sources_do_not_count() {
    let text = "\
Types: deb deb-src
URIs: http://mirror.example/debian
Suites: bookworm
Components: main
Signed-By:
 -----BEGIN PGP PUBLIC KEY BLOCK-----
 .
 abc
 -----END PGP PUBLIC KEY BLOCK-----

Enabled: no
Types: deb
URIs: http://off.example/debian
Suites: bookworm
Components: main

Types: deb-src
URIs: http://source.example/debian
Suites: bookworm
Components: main
";
    let sources = parse_deb822(text);
    assert_eq!(sources.len(), 1);
    let written = backports(&sources, "bookworm").expect("the release is there");
    assert_eq!(parse_deb822(&written)[0].signed_by, sources[0].signed_by);
    assert!(written.contains("\n abc\n"), "{written}");
}

#[test]
fn text_that_is_not_a_source_yields_none() {
    for text in ["", "\n\n", "Types", ": :\n", " leading continuation", "Types: deb\n"] {
        assert_eq!(parse_deb822(text), [], "{text:?}");
        assert_eq!(parse_one_line(text), [], "{text:?}");
    }
}

#[test]
fn the_release_is_named_by_the_system() {
    let text = "PRETTY_NAME=\"Debian GNU/Linux 12 (bookworm)\"\nVERSION_CODENAME=bookworm\nID=debian\n";
    assert_eq!(os_release(text, "VERSION_CODENAME"), Some("bookworm"));
    assert_eq!(os_release(text, "PRETTY_NAME"), Some("Debian GNU/Linux 12 (bookworm)"));
    assert_eq!(os_release(text, "NAME"), None);
}

#[test]
fn offers_carry_version_and_suite() {
    let text = "\
 emulator | 1:10.0.2+ds-2~bpo12+1 | http://mirror.example/debian bookworm-backports/main amd64 Packages
 emulator | 1:7.2+dfsg-7 | http://mirror.example/debian bookworm/main amd64 Packages
 emulator | 1:7.2+dfsg-7 | http://mirror.example/debian bookworm/main Sources
nonsense
";
    let offers = parse_madison(text);
    let pairs: Vec<_> = offers.iter().map(|offer| (offer.version.as_str(), offer.suite.as_str())).collect();
    assert_eq!(pairs, [("1:10.0.2+ds-2~bpo12+1", "bookworm-backports"), ("1:7.2+dfsg-7", "bookworm")]);
}
