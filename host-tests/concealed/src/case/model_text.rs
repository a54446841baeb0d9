//! The nominal model as a model file, written from the format's documentation.

use std::f64::consts::TAU;
use std::fmt::Write;

use super::Channel;
use super::maker::{REFERENCE, input_column};
use crate::truth::plant::{BeamMachine, PositionLoop, RENEWAL_S, SlideMachine};
use crate::truth::run::Kind;

/// A model file, `schema = 1`.
pub fn model_text(kind: &Kind, channels: &[Channel]) -> String {
    let mut text = String::from("# The model that the lab has of its machine.\nschema = 1\n");
    match kind {
        Kind::Beam(beam) => beam_text(&mut text, beam),
        Kind::Slide(slide) => slide_text(&mut text, slide),
    }
    let body = match kind {
        Kind::Slide(slide) => {
            slide.bodies.first().map(|(name, _)| format!("body = \"{name}\"\ngain = 1.0\n"))
        }
        Kind::Beam(_) => None,
    };
    // Writing into a string cannot fail.
    if let Some(column) = input_column(kind) {
        let _ = write!(text, "\n[input]\ncolumn = \"{column}\"\n{}", body.unwrap_or_default());
    }
    if let Kind::Slide(SlideMachine { position_loop: Some(PositionLoop { kp, kv }), .. }) = kind {
        let _ = write!(
            text,
            "\n[controller]\nkind = \"cascade_pd\"\nkp = {kp:?}\nkv = {kv:?}\nsample_s = {RENEWAL_S:?}\nreference_column = \"{REFERENCE}\"\n"
        );
    }
    for channel in channels {
        let _ = write!(text, "\n[[output]]\ncolumn = \"{}\"\n", channel.column);
        if let Kind::Slide(slide) = kind
            && let Some((name, _)) = slide.bodies.get(channel.output)
        {
            let _ = write!(text, "body = \"{name}\"\nquantity = \"position\"\n");
        }
    }
    text
}

fn beam_text(text: &mut String, beam: &BeamMachine) {
    let strip = &beam.strip;
    let length = strip.length_m;
    let table = |ends: [f64; 2]| format!("[[0.0, {:?}], [{length:?}, {:?}]]", ends[0], ends[1]);
    let ratios: Vec<String> = beam.damping_ratio.iter().map(|ratio| format!("{ratio:?}")).collect();
    let _ = write!(
        text,
        "kind = \"beam_on_base\"\n\n[beam]\nlength_m = {length:?}\ndensity_kg_m3 = {:?}\nyoung_Pa = {:?}\nwidth_m = {}\n\
         thickness_m = {}\nmodes = {}\ndamping_ratio = [{}]\n\n[base]\nmass_kg = {:?}\nviscous_N_s_m = {:?}\n",
        strip.density_kg_m3,
        strip.young_pa,
        table(strip.width_m),
        table(strip.thickness_m),
        ratios.len(),
        ratios.join(", "),
        beam.base_mass_kg,
        beam.base_viscous,
    );
    if let Some(servo) = beam.servo {
        // The file gives the frequency at which the response has fallen by 3 dB.
        let middle = 1.0 - 2.0 * servo.damping_ratio * servo.damping_ratio;
        let ratio = (middle + (middle * middle + 1.0).sqrt()).sqrt();
        let _ = write!(
            text,
            "\n[drive]\nbandwidth_hz = {:?}\ndamping_ratio = {:?}\n",
            ratio * servo.omega_rad_s / TAU,
            servo.damping_ratio
        );
    }
}

fn slide_text(text: &mut String, slide: &SlideMachine) {
    text.push_str("kind = \"lumped\"\n");
    for (name, mass) in &slide.bodies {
        let _ = write!(text, "\n[[body]]\nname = \"{name}\"\nmass = {mass:?}\n");
    }
    let mut connect = |between: [&str; 2], [stiffness, damping]: [f64; 2]| {
        let between = format!("between = [\"{}\", \"{}\"]", between[0], between[1]);
        let _ = write!(text, "\n[[spring]]\n{between}\nstiffness = {stiffness:?}\n");
        let _ = write!(text, "\n[[damper]]\n{between}\ndamping = {damping:?}\n");
    };
    if let Some((first, _)) = slide.bodies.first() {
        connect([first, "ground"], [slide.ground_stiffness, slide.ground_damping]);
        if let Some((second, _)) = slide.bodies.get(1) {
            connect([first, second], slide.coupling);
        }
    }
}
