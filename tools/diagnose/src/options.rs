//! What a diagnosis may be told.

/// Settings of a diagnosis; the defaults are what `stillbeam diagnose` uses.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// Probability of a false alarm of each residual test, above 0 and below 1.
    pub significance: f64,
    /// A term must be this many of its standard errors away from zero on the training recordings.
    pub training_gate: f64,
    /// A term must improve the held-out recordings by this many of the improvement's standard errors, which is half as many as
    /// its effect there has. A term fitted to noise has on average less than nothing to show.
    pub held_out_gate: f64,
    /// Two models are told apart when one predicts all recordings better by this many of the difference's standard errors.
    pub separation: f64,
    /// The most terms that are put together.
    pub most_terms: usize,
    /// Laws left out of the catalogue, by id: for controls that leave the truth out.
    pub without: Vec<String>,
    /// The largest amplitude that the machine may be given, in the unit of the model's input, for proposals of a next run;
    /// three times the largest recorded one when nothing is said.
    pub most_amplitude: Option<f64>,
    /// Seconds after which no further search is begun: for more laws, for others in their place, for laws that would do as well.
    /// What is under way is finished, so the whole takes somewhat longer. A search that was ended says so in the caps and
    /// comes to no verdict more certain than the whole would have. `None`: no end.
    pub time_limit_s: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            significance: 1e-3,
            training_gate: 4.0,
            held_out_gate: 2.5,
            separation: 4.0,
            most_terms: 4,
            without: Vec::new(),
            most_amplitude: None,
            time_limit_s: None,
        }
    }
}
