#![allow(missing_docs)]
use stillbeam_identify::*;
use stillbeam_recording::*;
fn main() {
    for name in ["belt_A_1", "belt_A_2", "belt_A_test", "belt_B_1", "belt_B_2", "belt_b_1", "calibration_A_1"]
    {
        let path = format!("/work/shared/data/klipper_raw_belt_printer/adxl345-{name}.csv");
        let r = read_recording(path.as_ref(), &ReadOptions::default()).unwrap().recording;
        for col in ["acceleration_y_mm_s2", "acceleration_x_mm_s2"] {
            let t0 = std::time::Instant::now();
            let v = identify_free_decay(&r, &FreeDecayOptions::new(col));
            print!("{name} {col}: ");
            match v {
                Ok(v) => {
                    let all: f64 = v
                        .modes
                        .iter()
                        .map(|m| m.amplitude.value.powi(2) / m.frequency_hz.value / m.damping_ratio.value)
                        .sum();
                    for m in &v.modes {
                        print!(
                            "{:.1}/{:.4}±{:.4} ({:.0}%) ",
                            m.frequency_hz.value,
                            m.damping_ratio.value,
                            m.damping_ratio.stderr,
                            100.0 * m.amplitude.value.powi(2)
                                / m.frequency_hz.value
                                / m.damping_ratio.value
                                / all
                        );
                    }
                    print!("{:?} rms {:.0} {:?}", v.window_s, v.residual_rms, v.noise);
                }
                Err(e) => print!("{e}"),
            }
            println!(" {:?}", t0.elapsed());
        }
    }
    let r = read_recording(
        "/work/shared/data/cantilever_downey/beam_impulse_ringdown.csv".as_ref(),
        &ReadOptions::default(),
    )
    .unwrap()
    .recording;
    let t0 = std::time::Instant::now();
    let v = identify_free_decay(&r, &FreeDecayOptions::new("acceleration_g")).unwrap();
    println!(" {:?}", t0.elapsed());
    for m in &v.modes {
        println!(
            "{:.3}/{:.5}±{:.5} {:.5}",
            m.frequency_hz.value, m.damping_ratio.value, m.damping_ratio.stderr, m.amplitude.value
        );
    }
    let p = v.fit.measured.iter().map(|y| y * y).sum::<f64>() / v.fit.measured.len() as f64;
    println!("share {}", 1.0 - v.residual_rms.powi(2) / p);
    for w in &v.warnings {
        println!("{}", w.message);
    }
    for w in &v.rejected {
        println!("{:?}", w);
    }
}
