//! Models given as matrices or transfer functions do what the matrices do.

use crate::support;

use stillbeam_plant::{Model, SimulateOptions, simulate_with};
use stillbeam_recording::Recording;

use support::systems::{Draw, OUTPUTS, System, random};
use support::{peak, ticks, worst};

const HEAD: &str = "schema = 1\nkind = \"state_space\"\n";
const RATE_HZ: f64 = 500.0;

fn model(text: &str) -> Model {
    Model::from_toml("system.toml", text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// What a model makes of an input.
fn simulated(model: &Model, input: &[f64]) -> Vec<Vec<f64>> {
    let driven = Recording::new("driven", ticks(input.len(), RATE_HZ)).with_column("force_N", input.to_vec());
    let run = simulate_with(model, &driven, &SimulateOptions::default()).unwrap();
    let samples = |column: &String| run.column(column).unwrap().to_vec();
    model.output_columns().iter().map(samples).collect()
}

fn noise(draw: &mut Draw) -> Vec<f64> {
    (0..2000).map(|_| draw.between(-1.0, 1.0)).collect()
}

fn assert_same(found: &[Vec<f64>], expected: &[Vec<f64>], share: f64, what: &str) {
    assert_eq!(found.len(), expected.len());
    for (number, (found, expected)) in found.iter().zip(expected).enumerate() {
        let off = worst(found, expected) / peak(expected);
        assert!(off < share, "{what}: output {number} is off by {off:e}");
    }
}

fn input_table(held: bool) -> String {
    format!("[input]\ncolumn = \"force_N\"\nhold = \"{}\"\n", if held { "zero" } else { "first" })
}

#[test]
fn random_systems_in_random_states_do_the_same_as_their_matrices() {
    for seed in 0..60 {
        let draw = &mut Draw::new(seed);
        let (is_free, held) = (seed % 3 == 0, seed % 2 == 0);
        let system = random(draw, is_free);
        let input = noise(draw);
        let gain = if seed % 5 < 2 { 1.0 } else { -2.5 };
        let gained: Vec<f64> = input.iter().map(|u| gain * u).collect();
        let text =
            [HEAD, &system.toml(), &input_table(held), &format!("gain = {gain:?}\n"), OUTPUTS].concat();
        let expected = system.run(1.0 / RATE_HZ, &gained, held);
        assert_same(&simulated(&model(&text), &input), &expected, 1e-9, &format!("seed {seed}"));
    }
}

#[test]
fn what_is_written_as_a_modal_file_reads_back_unchanged() {
    for seed in 0..20 {
        let system = random(&mut Draw::new(seed), seed % 2 == 0);
        let text = [HEAD, &system.toml(), &input_table(true), OUTPUTS, "driving_point = false\n"].concat();
        let model = model(&text);
        let written = model.to_toml().unwrap();
        assert!(written.contains("kind = \"modal\""));
        assert_eq!(Model::from_toml("modal.toml", &written).unwrap(), model, "{written}");
    }
}

#[test]
fn a_mat_file_beside_the_model_gives_the_same_under_any_names() {
    let folder = tempfile::tempdir().unwrap();
    let system = random(&mut Draw::new(7), true);
    let inline = model(&[HEAD, &system.toml(), &input_table(true), OUTPUTS].concat());
    for (names, variables) in [
        (["A", "B", "C", "D"], ""),
        (["Ad", "Bd", "Cd", "Dd"], "variables = { A = \"Ad\", B = \"Bd\", C = \"Cd\", D = \"Dd\" }\n"),
    ] {
        std::fs::write(folder.path().join("plant.mat"), system.mat(names)).unwrap();
        let file = "file = \"plant.mat\"\n";
        let text = [HEAD, file, variables, &input_table(true), OUTPUTS].concat();
        let path = folder.path().join("model.toml");
        std::fs::write(&path, text).unwrap();
        assert_eq!(Model::read(&path).unwrap(), inline);
    }
}

#[test]
fn sampled_matrices_do_between_samples_what_the_continuous_ones_do() {
    for seed in 0..20 {
        let draw = &mut Draw::new(100 + seed);
        let system = random(draw, seed % 3 == 0);
        let input = noise(draw);
        // Sampled four times as seldom as the recording, whose input is held as long.
        let step_s = 4.0 / RATE_HZ;
        let input: Vec<f64> = (0..input.len()).map(|k| input[k / 4 * 4]).collect();
        let sample = format!("sample_s = {step_s:?}\n[input]\ncolumn = \"force_N\"\n");
        let text = [HEAD, &system.sampled(step_s).toml(), &sample, OUTPUTS].concat();
        let expected = system.run(1.0 / RATE_HZ, &input, true);
        assert_same(&simulated(&model(&text), &input), &expected, 1e-8, &format!("seed {seed}"));
    }
}

#[test]
fn a_transfer_function_does_the_same_as_its_matrices() {
    // A mode, a lag and a free body of one denominator each; the second output has a zero.
    let function = r#"
        numerator = [[2.0], [3.0, 1.0], [1.0, 0.0, 0.0]]
        denominator = [[1.0, 0.4, 400.0], [0.5, 1.0], [1.0, 0.4, 400.0]]
    "#;
    let system = System {
        a: nalgebra::dmatrix![0.0, 1.0, 0.0; -400.0, -0.4, 0.0; 0.0, 0.0, -2.0],
        b: nalgebra::dvector![0.0, 1.0, 1.0],
        c: nalgebra::dmatrix![2.0, 0.0, 0.0; 0.0, 0.0, -10.0; -400.0, -0.4, 0.0],
        d: nalgebra::dvector![0.0, 6.0, 1.0],
    };
    let input = noise(&mut Draw::new(3));
    for held in [true, false] {
        let by_function = model(&[HEAD, function, &input_table(held), OUTPUTS].concat());
        let expected = system.run(1.0 / RATE_HZ, &input, held);
        assert_same(&simulated(&by_function, &input), &expected, 1e-11, "against the closed form");
        let by_matrices = model(&[HEAD, &system.toml(), &input_table(held), OUTPUTS].concat());
        assert_same(&simulated(&by_matrices, &input), &expected, 1e-11, "matrices");
    }
}

#[test]
fn a_polynomial_that_another_program_rounded_has_modes_in_phase() {
    // Two modes as scipy writes them, a leading coefficient of rounding included.
    let function = "
        numerator = [
            -3.2303049124493555e-12,
            2.020201577888656,
            2.7539389874364133,
            30285.768141835928]
        denominator = [
            1.0,
            2.5936988948073663,
            27385.05116769578,
            18267.52898366298,
            18585093.493829224]
    ";
    let Model::Modal(model) = model(&[HEAD, function, "[[output]]\ncolumn = \"y_m\"\n"].concat()) else {
        panic!("modal")
    };
    assert_eq!(model.modes.len(), 2);
    assert!(model.beside.is_empty(), "{:?}", model.beside);
}

#[test]
fn one_input_and_some_outputs_of_many_are_chosen_by_number() {
    let system = random(&mut Draw::new(11), false);
    let input = noise(&mut Draw::new(12));
    let expected = system.run(1.0 / RATE_HZ, &input, true);
    let inputs = system.toml().replace("B = [[", "B = [[9.0, ").replace("D = [[", "D = [[1.0, ");
    let inputs = inputs
        .lines()
        .map(|line| match line.get(..1) {
            Some("B" | "D") => line.replace("], [", "], [0.5, "),
            _ => line.to_owned(),
        })
        .collect::<Vec<_>>()
        .join("\n");
    let choice = "\ninput_number = 2\n";
    let output = "[[output]]\ncolumn = \"a_m_s2\"\nquantity = \"acceleration\"\nnumber = 3\n";
    let found = simulated(&model(&[HEAD, &inputs, choice, &input_table(true), output].concat()), &input);
    assert_same(&found, &expected[2..], 1e-9, "third output of the second input");
}

#[test]
fn modes_that_decouple_and_poles_nobody_sees_are_left_out() {
    // Two equal modes, of which the input moves one combination; a growing state that nothing shows.
    let text = r#"
        A = [[0, 1, 0, 0, 0], [-100, -0.2, 0, 0, 0], [0, 0, 0, 1, 0], [0, 0, -100, -0.2, 0], [0, 0, 0, 0, 3]]
        B = [0, 1, 0, 2, 0]
        C = [[1, 0, 1, 0, 0]]
        [input]
        column = "force_N"
        [[output]]
        column = "y_m"
    "#;
    let Model::Modal(model) = model(&[HEAD, text].concat()) else { panic!("modal") };
    assert_eq!(model.modes.len(), 1);
    let mode = &model.modes[0];
    assert!((mode.participation[0] - 3.0).abs() < 1e-10, "{mode:?}");
    assert!((mode.frequency_hz - 10.0 / std::f64::consts::TAU).abs() < 1e-12 && model.beside.is_empty());
}

/// What is said of a system with a position output.
fn refusal(system: &str, rest: &str) -> String {
    let output = if rest.contains("[[output]]") { "" } else { "[[output]]\ncolumn = \"y_m\"\n" };
    let text = [HEAD, system, "\n[input]\ncolumn = \"force_N\"\n", rest, output].concat();
    Model::from_toml("system.toml", &text).unwrap_err().to_string()
}

#[test]
fn every_refusal_says_what_where_and_what_to_do() {
    let modes = "B = [0, 1]\nC = [1, 0]\n";
    let fine = "A = [[0, 1], [-100, -1]]\n";
    let both = &[fine, modes].concat();
    let two = &[fine, "B = [[0, 1], [1, 0]]\nC = [1, 0]\n"].concat();
    for (system, rest, said) in [
        ("", "", &["`kind`", "one way", "`numerator`"][..]),
        (&[both, "numerator = [1]\ndenominator = [1, 1]"].concat(), "", &["system.toml:3: `A`", "one way"]),
        (&["A = [[0, 1], [-100]]\n", modes].concat(), "", &["`A`", "different lengths"]),
        (&["A = \"a\"\n", modes].concat(), "", &["`A`", "a string", "rows of numbers"]),
        (&["A = [[0, 1], [-100, nan]]\n", modes].concat(), "", &["`A`", "not finite"]),
        (&["A = [[0, 1, 2], [-100, -1, 2]]\n", modes].concat(), "", &["`A`", "2 x 3", "square"]),
        (&[fine, "B = [0, 1, 2]\nC = [1, 0]"].concat(), "", &["`B`", "1 x 3", "2 x inputs"]),
        (&[fine, "B = [0, 1]\nC = [1, 0, 0]"].concat(), "", &["system.toml:5: `C`", "1 x 3", "outputs x 2"]),
        (&[both, "D = [[0, 0]]"].concat(), "", &["`D`", "1 x 2", "1 x 1"]),
        (&[fine, "C = [1, 0]"].concat(), "", &["`B`", "there is none"]),
        (two, "", &["`B`", "2 columns", "input_number"]),
        (
            &[two, "input_number = 3\n"].concat(),
            "",
            &["system.toml:6: `input_number`", "no number 3", "1 to 2"],
        ),
        (
            &[fine, "B = [0, 1]\nC = [[1, 0], [0, 1]]\n"].concat(),
            "",
            &["`output`", "1 [[output]]", "2 outputs", "`number`"],
        ),
        (both, "[[output]]\ncolumn = \"y_m\"\nnumber = 0\n", &["`output.1.number`", "no number 0"]),
        (&["A = [[0, 1], [-100, 1]]\n", modes].concat(), "", &["`A`", "0.5", "grows", "lumped"]),
        (&["A = [[0, 1], [-100, -20]]\n", modes].concat(), "", &["2 poles", "-10.0", "move one"]),
        (
            "A = [[0, 1, 0], [0, 0, 1], [0, 0, 0]]\nB = [0, 0, 1]\nC = [1, 0, 0]\n",
            "",
            &["3 poles at zero", "integrator"],
        ),
        (&[fine, "B = [0, 0]\nC = [1, 0]\n"].concat(), "", &["no output shows", "`B`"]),
        (&[both, "sample_s = 0\n"].concat(), "", &["`sample_s`", "greater than zero"]),
        ("A = -0.5\nB = 1\nC = 1\nsample_s = 0.1\n", "", &["`A`", "z = -0.5", "sample_s"]),
        ("A = [[0, 1], [0, 0.5]]\nB = [0, 1]\nC = [1, 0]\nsample_s = 0.1\n", "", &["z = 0", "delay_s"]),
        ("numerator = [1]\n", "", &["`denominator`", "there is none"]),
        ("numerator = [1]\ndenominator = [0]\n", "", &["`denominator`", "empty or zero"]),
        ("numerator = [0]\ndenominator = [1, 1]\n", "", &["`numerator`", "empty or zero"]),
        ("numerator = [1, 0, 0]\ndenominator = [1, 1]\n", "", &["`numerator`", "degree 2", "denominator 1"]),
        ("numerator = [1]\ndenominator = [[1, 1], [1, 2]]\n", "", &["2 denominators for 1 numerators"]),
        ("numerator = [5]\ndenominator = [2]\n", "", &["no output shows"]),
        ("file = \"none.mat\"\n", "", &["`file`", "none.mat"]),
        (&[both, "colour = 1\n"].concat(), "", &["colour", "sample_s"]),
    ] {
        let found = refusal(system, rest);
        for part in said {
            assert!(found.contains(part), "{system}: no {part:?} in {found:?}");
        }
        assert!(found.starts_with("system.toml"), "{found}");
    }
    let text = [HEAD, both, "[input]\ncolumn = \"setpoint_m\"\n[[output]]\ncolumn = \"y_m\"\n"].concat();
    let found = Model::from_toml("system.toml", &text).unwrap_err().to_string();
    assert!(found.contains("`input.column`") && found.contains("motion of the base"), "{found}");
}

#[test]
fn a_mat_file_without_what_is_looked_for_is_refused_with_what_it_holds() {
    let folder = tempfile::tempdir().unwrap();
    let system = random(&mut Draw::new(7), true);
    let path = folder.path().join("model.toml");
    std::fs::write(folder.path().join("plant.mat"), system.mat(["Ad", "B", "C", "D"])).unwrap();
    let refusal = |keys: &str| {
        let text = [HEAD, "file = \"plant.mat\"\n", keys, &input_table(true), OUTPUTS].concat();
        std::fs::write(&path, text).unwrap();
        Model::read(&path).unwrap_err().to_string()
    };
    let found = refusal("");
    for part in ["model.toml:3: `file`", "no variable \"A\"", "Ad, B, C, D", "variables = { A = \"name\" }"] {
        assert!(found.contains(part), "{found}");
    }
    let found = refusal("variables = { A = \"Ad\", D = \"E\" }\n");
    assert!(found.contains("`variables.D`") && found.contains("\"E\""), "{found}");
    let found = refusal("variables = { E = \"Ad\" }\n");
    assert!(found.contains("`variables`") && found.contains("A, B, C or D"), "{found}");
}

/// A cart on a guide with friction, a load on a spring beside it: as matrices with one output of the cart,
/// and lumped.
fn cart(output: &str, c: [f64; 4], d: f64, friction: bool) -> [Model; 2] {
    let law = |place: &str| {
        let law =
            format!("id = \"coulomb_friction\"\nlocation = \"{place}\"\nparameters = {{ force = 1.5 }}\n");
        if friction { format!("[[physics]]\n{law}") } else { String::new() }
    };
    let output = format!("[[output]]\n{output}\n");
    let given = format!(
        "A = [[0, 1, 0, 0], [-200, -1.7, 200, 0.2], [0, 0, 0, 1], [800, 0.8, -800, -0.8]]\nB = [0, 0.5, 0, 0]\n\
         C = [{c:?}]\nD = {d:?}\n{}gain = 2.0\n{output}driving_point = true\n",
        input_table(true)
    );
    let lumped = format!(
        "schema = 1\nkind = \"lumped\"\nbody = [{{ name = \"cart\", mass = 2.0 }}, {{ name = \"load\", mass = 0.5 }}]\n\
         spring = [{{ between = [\"cart\", \"load\"], stiffness = 400.0 }}]\n\
         damper = [{{ between = [\"cart\", \"load\"], damping = 0.4 }}, {{ between = [\"cart\", \"ground\"], damping = 3.0 }}]\n\
         {}body = \"cart\"\ngain = 2.0\n{output}body = \"cart\"\n",
        input_table(true)
    );
    [model(&[HEAD, &given, &law("driving_point")].concat()), model(&[lumped, law("cart")].concat())]
}

#[test]
fn friction_at_the_driving_point_is_friction_at_the_body_that_the_force_pushes() {
    let mut draw = Draw::new(5);
    let steps: Vec<f64> = (0..200).map(|_| draw.between(-5.0, 5.0)).collect();
    let input: Vec<f64> = (0..2000).map(|k| steps[k / 10]).collect();
    let rows = [
        ("column = \"y_m\"", [1.0, 0.0, 0.0, 0.0], 0.0),
        ("column = \"v_m_s\"\nquantity = \"velocity\"", [0.0, 1.0, 0.0, 0.0], 0.0),
    ];
    for (output, c, d) in rows {
        let [given, lumped] = cart(output, c, d, true);
        let expected = simulated(&lumped, &input);
        assert_same(&simulated(&given, &input), &expected, 1e-6, output);
        let [without, _] = cart(output, c, d, false);
        let shows = worst(&simulated(&without, &input)[0], &expected[0]) / peak(&expected[0]);
        assert!(shows > 0.1, "{output}: the friction changes {shows:e}");
    }
    // Modes alone: their accelerations say where the point is, and feel the friction at once.
    let held = "[[0, 1, 0, 0], [-900, -0.6, 0, 0], [0, 0, 0, 1], [0, 0, -9000, -1]]\nB = [0, 1, 0, 1]\n";
    let friction = "[[physics]]\nid = \"coulomb_friction\"\nlocation = \"driving_point\"\nparameters = { force = 1.5 }\n";
    let of = |rows: &str, outputs: &str| {
        let text = [HEAD, "A = ", held, rows, &input_table(true), outputs, friction].concat();
        simulated(&model(&text), &input)
    };
    let position = "[[output]]\ncolumn = \"y_m\"\n";
    let acceleration = "[[output]]\ncolumn = \"a_m_s2\"\nquantity = \"acceleration\"\n";
    let rows = "C = [[1, 0, 1, 0], [-900, -0.6, -9000, -1]]\nD = [[0], [2]]\n";
    let mark = "driving_point = true\n";
    let by_position = of(rows, &[position, mark, acceleration].concat());
    let by_acceleration = of(rows, &[position, acceleration, mark].concat());
    assert_same(&by_acceleration, &by_position, 1e-9, "marked by its acceleration");
}

#[test]
fn a_driving_point_whose_motion_its_output_does_not_tell_is_refused() {
    let sliding = "A = [[0, 1], [0, -2]]\nB = [0, 1]\n";
    let head = [HEAD, sliding, "C = [[0, -2]]\nD = 1\n", &input_table(true)].concat();
    let output = "[[output]]\ncolumn = \"a_m_s2\"\nquantity = \"acceleration\"\ndriving_point = true\n";
    let found = Model::from_toml("system.toml", &[head.as_str(), output].concat()).unwrap_err().to_string();
    for part in ["`output.driving_point`", "`a_m_s2`", "position or velocity"] {
        assert!(found.contains(part), "{found}");
    }
}

#[test]
fn the_example_of_the_documentation_has_the_modes_that_it_says() {
    let page = include_str!("../../../docs/models.md");
    let (_, rest) = page.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let Model::Modal(model) = model(text) else { panic!("modal") };
    let found: Vec<String> = model.modes.iter().map(|mode| format!("{:.3} Hz", mode.frequency_hz)).collect();
    assert!(page.contains(&format!("prints its modes, {}", found.join(" and "))), "{found:?}");
    assert_eq!(model.driving_point.as_deref(), Some("tip_m"));
}
