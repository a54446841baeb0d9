//! Formats that are not read, told by their first bytes, and the way out of each.

/// What a file begins with, what it is, and what to do.
const KNOWN: [(&[u8], &str); 32] = [
    (b"\x1f\x8b", "gzip; unpack it first, with gunzip"),
    (
        b"\x28\xb5\x2f\xfd",
        "Zstandard, as Shake&Tune's .stdata is; unpack it with zstd -d, or take the CSV of the raw data",
    ),
    (b"BZh", "bzip2; unpack it first, with bunzip2"),
    (b"\xfd7zXZ\x00", "xz; unpack it first, with unxz"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive; unpack it first"),
    (b"Rar!", "a RAR archive; unpack it first"),
    (b"\x04\x22\x4d\x18", "LZ4; unpack it first, with lz4 -d"),
    (
        b"PK\x03\x04",
        "a ZIP archive or a spreadsheet (.xlsx, .ods, .npz); unpack it, or save the sheet as CSV",
    ),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Office file (.xls); save the sheet as CSV"),
    (b"PAR1", "Parquet; write CSV with pandas.read_parquet(name).to_csv(index=False)"),
    (b"ARROW1", "an Arrow file (Feather); write CSV with pandas.read_feather(name).to_csv(index=False)"),
    (b"FEA1", "an old Feather file; write CSV with pandas.read_feather(name).to_csv(index=False)"),
    (b"ORC", "an ORC file; write it as CSV"),
    (
        b"TDSm",
        "a TDMS file of LabVIEW; write CSV with nptdms.TdmsFile.read(name).as_dataframe(time_index=True).to_csv()",
    ),
    (b"TDSh", "the index of a TDMS file; take the .tdms file itself, as CSV"),
    (b"CDF\x01", "a NetCDF file; write CSV with xarray.open_dataset(name).to_dataframe().to_csv()"),
    (b"CDF\x02", "a NetCDF file; write CSV with xarray.open_dataset(name).to_dataframe().to_csv()"),
    (b"SQLite format 3\x00", "an SQLite database; export the table as CSV, with sqlite3 -header -csv"),
    (b"\x80\x02", "a pickle of Python; save the array with numpy.save or as CSV"),
    (b"\x80\x03", "a pickle of Python; save the array with numpy.save or as CSV"),
    (b"\x80\x04", "a pickle of Python; save the array with numpy.save or as CSV"),
    (b"\x80\x05", "a pickle of Python; save the array with numpy.save or as CSV"),
    (
        b"LOGG",
        "a log of CAN frames (BLF); make signals of them with the database of the bus, with asammdf or cantools, and write those as CSV",
    ),
    (b"MDF     ", "an MDF file (.mf4, .dat); export the channels as CSV"),
    (b"UnFinMF ", "an MDF file that was not closed (.mf4); export the channels as CSV"),
    (b"%PDF", "a PDF; take the data behind the picture, as CSV"),
    (b"\x89PNG", "a PNG picture; take the data behind it, as CSV"),
    (b"\xff\xd8\xff", "a JPEG picture; take the data behind it, as CSV"),
    (b"GIF8", "a GIF picture; take the data behind it, as CSV"),
    (b"%TDF", "a file of another program; export it as CSV"),
    (b"\x7fELF", "a program; give the recording"),
    (b"OggS", "audio that is not RIFF/WAVE; convert it to WAV"),
];

/// A log of frames as text. Which bytes of which frame are the signal stands in another file.
const CAN_LOG: &str = "a log of CAN frames (candump or Vector's ASC), whose bytes only a database of the bus makes signals of; write them as CSV, with cantools decode or asammdf";

/// What HDF5 files, and so MATLAB v7.3 files after their 512 bytes of text, begin with.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// What bytes look like that are none of the formats, and the way out; `None` when they may be one.
pub(crate) fn looks_like(bytes: &[u8]) -> Option<&'static str> {
    if bytes.get(512..520) == Some(HDF5) || bytes.starts_with(b"MATLAB 7.3") {
        return Some("an HDF5 file, which MATLAB writes with -v7.3; save it with -v7 instead");
    }
    if bytes.starts_with(HDF5) {
        return Some("an HDF5 file; save it with -v7 in MATLAB, or write the arrays as CSV");
    }
    if ["RF64", "RIFX", "fLaC", "FORM", "ID3"].iter().any(|start| bytes.starts_with(start.as_bytes())) {
        return Some("audio that is not RIFF/WAVE; convert it to WAV");
    }
    if let Some((_, what)) = KNOWN.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Some(what);
    }
    let start = bytes.get(..512).unwrap_or(bytes);
    let text = String::from_utf8_lossy(start).trim_start_matches('\u{feff}').trim_start().to_lowercase();
    if text.starts_with("<!doctype html") || text.starts_with("<html") {
        return Some(
            "a web page (HTML), perhaps a log-in or an error in the place of the file; download the file itself",
        );
    }
    if text.starts_with("<?xml") || text.starts_with("<svg") {
        return Some("XML; export the data as CSV");
    }
    if text.starts_with("{\\rtf") {
        return Some("a text document (RTF); save it as plain text");
    }
    if is_can_log(&text) {
        return Some(CAN_LOG);
    }
    if text.starts_with("version https://git-lfs") {
        return Some("a pointer of Git LFS in the place of the file; fetch it with git lfs pull");
    }
    None
}

/// Whether the first lines of a text, in small letters, are frames of a bus as candump or an ASC logger
/// writes them.
fn is_can_log(text: &str) -> bool {
    if text.starts_with("date ") && text.lines().take(5).any(|line| line.starts_with("base ")) {
        return true;
    }
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty()).peekable();
    let first = lines.next();
    first.is_some_and(is_frame) && lines.next().is_none_or(|next| is_frame(next) || lines.peek().is_none())
}

/// `(1436509052.249713) can0 123#11223344` or `can0  123   [8]  11 22 33 44 55 66 77 88`, with or without a
/// stamp.
fn is_frame(line: &str) -> bool {
    let hex = |text: &str, most: usize| {
        !text.is_empty() && text.len() <= most && text.bytes().all(|byte| byte.is_ascii_hexdigit())
    };
    let mut words = line.split_whitespace().skip_while(|word| word.starts_with('('));
    let Some(_bus) = words.next().filter(|bus| bus.contains("can") || bus.contains("slc")) else {
        return false;
    };
    let Some(word) = words.next() else { return false };
    match word.split_once('#') {
        Some((id, bytes)) => {
            hex(id, 8) && bytes.bytes().all(|byte| byte.is_ascii_hexdigit() || byte == b'#' || byte == b'r')
        }
        None => {
            hex(word, 8)
                && words.next().is_some_and(|length| length.starts_with('[') && length.ends_with(']'))
        }
    }
}
