//! Damaged recordings of every format through `identify`: read, or refused in a sentence that names the file.

use crate::support;

use std::f64::consts::TAU;
use std::path::Path;

use support::{accepted, stillbeam};

/// A small generator (splitmix64).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % limit.max(1) as u64) as usize
    }
}

/// What happens to files: cut off, bytes changed anywhere or in the head, a stretch wiped, a stretch twice.
fn damaged(whole: &[u8], kind: usize, numbers: &mut Numbers) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let at = numbers.below(bytes.len());
    let end = (at + 1 + numbers.below(200)).min(bytes.len());
    match kind % 5 {
        0 => bytes.truncate(at),
        1 => (0..5).for_each(|_| {
            let at = numbers.below(bytes.len());
            bytes[at] = numbers.below(256) as u8;
        }),
        2 => bytes[at..end].fill(0),
        3 => {
            let again = bytes[at..end].to_vec();
            bytes.splice(at..at, again);
        }
        _ => (0..2).for_each(|_| {
            let at = numbers.below(bytes.len().min(300));
            bytes[at] = numbers.below(256) as u8;
        }),
    }
    bytes
}

/// A decay of 4 s at 100 Hz as one-channel WAV of 16 bits.
fn wav(values: &[f64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|y| ((y * 3e4) as i16).to_le_bytes()).collect();
    let mut file = b"RIFF".to_vec();
    file.extend((36 + data.len() as u32).to_le_bytes());
    file.extend(b"WAVEfmt ");
    file.extend(16_u32.to_le_bytes());
    file.extend([1_u16, 1].into_iter().flat_map(u16::to_le_bytes));
    file.extend([100_u32, 200].into_iter().flat_map(u32::to_le_bytes));
    file.extend([2_u16, 16].into_iter().flat_map(u16::to_le_bytes));
    file.extend(b"data");
    file.extend((data.len() as u32).to_le_bytes());
    file.extend(data);
    file
}

/// One sound recording of every format: name and arguments.
fn sound(folder: &Path) -> Vec<(String, Vec<&'static str>)> {
    let path = |name: &str| folder.join(name).display().to_string();
    let time_s: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
    let decay: Vec<f64> = time_s.iter().map(|t| (-0.8 * t).exp() * (TAU * 6.9 * t).cos()).collect();
    let rows = |name: &str, scale: f64| {
        let rows = time_s.iter().zip(&decay).map(|(t, y)| format!("{t:.2},{:.6}\n", scale * y));
        format!("{name}\n{}", rows.collect::<String>())
    };
    std::fs::write(path("decay.csv"), rows("time_s,tip_deflection_m", 1.0)).unwrap();
    let klipper = time_s.iter().zip(&decay).map(|(t, y)| format!("{t:.6},0.5,{:.6},9800\n", 1e3 * y));
    let klipper = format!("#time,accel_x,accel_y,accel_z\n{}", klipper.collect::<String>());
    std::fs::write(path("klipper.csv"), klipper).unwrap();
    std::fs::write(path("decay.wav"), wav(&decay)).unwrap();
    accepted(&["convert", &path("decay.csv"), &path("text.uff")]);
    accepted(&["convert", &path("decay.csv"), &path("binary.uff"), "--to", "uff58b"]);
    let mut files: Vec<(String, Vec<&'static str>)> =
        ["decay.csv", "decay.wav", "text.uff", "binary.uff"].map(|name| (path(name), Vec::new())).into();
    files.push((path("klipper.csv"), vec!["--output", "acceleration_y_mm_s2"]));
    for name in ["conventional_v6.mat", "conventional_v7.mat"] {
        let file = format!("{}/../recording/tests/files/{name}", env!("CARGO_MANIFEST_DIR"));
        files.push((file, vec!["--output", "tip_deflection_m"]));
    }
    files
}

#[test]
fn damaged_recordings_are_read_or_refused_by_name_and_never_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbers = Numbers(5);
    let mut refused = 0;
    for (file, arguments) in sound(folder.path()) {
        let whole = std::fs::read(&file).unwrap();
        let name = Path::new(&file).file_name().unwrap().to_str().unwrap();
        let harmed = folder.path().join(format!("harmed_{name}")).display().to_string();
        for kind in 0..10 {
            std::fs::write(&harmed, damaged(&whole, kind, &mut numbers)).unwrap();
            let run = stillbeam(&[&["identify", harmed.as_str()], arguments.as_slice()].concat());
            assert!(matches!(run.code, 0 | 2), "{name} {kind}: {} {}", run.code, run.messages);
            assert!(!run.messages.contains("panicked"), "{name} {kind}: {}", run.messages);
            if run.code == 2 {
                refused += 1;
                assert!(run.messages.contains(&format!("harmed_{name}")), "{name} {kind}: {}", run.messages);
                assert!(run.messages.len() < 2000 && run.out.is_empty(), "{name} {kind}: {}", run.messages);
            }
        }
    }
    assert!(refused > 10, "{refused}");
}
