//! What a diagnosis may be told.

/// Settings of a diagnosis; the defaults are what `stillbeam diagnose` uses.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// Probability of a false alarm of each residual test, above 0 and below 1.
    pub significance: f64,
    /// What has less than this share (0 to 1) of the noise's power in every recording is neither a sign that
    /// something is missing nor named: of enough samples every model is wrong.
    pub least_excess_share: f64,
    /// A term must be this many of its standard errors away from zero on the training recordings.
    pub training_gate: f64,
    /// A term must improve the held-out recordings by this many of the improvement's standard errors, which
    /// is half as many as its effect there has. A term fitted to noise has on average less than nothing to
    /// show.
    pub held_out_gate: f64,
    /// Two models are told apart when one predicts all recordings better by this many of the difference's
    /// standard errors.
    pub separation: f64,
    /// The most terms that are put together.
    pub most_terms: usize,
    /// Laws left out of the catalogue, by id: for controls that leave the truth out.
    pub without: Vec<String>,
    /// The largest amplitude that the machine may be given, in the unit of the model's input, for proposals
    /// of a next run; three times the largest recorded one when nothing is said.
    pub most_amplitude: Option<f64>,
    /// What the machine can do, for the same proposals; `None` where that is not known. Of a force it is
    /// asked of the mass that the model says is pushed, and of nothing where the model has no masses.
    pub limits: Option<MachineLimits>,
    /// Seconds after which no further search is begun: for laws, for others in their place, for laws that
    /// would do as well. Fits under way end where they are a fiftieth of that later (a fifth of a second, if
    /// that is more); judging and locating take somewhat longer. A search that was ended says so in the caps
    /// and comes to no verdict more certain than the whole would have. `None`: no end.
    pub time_limit_s: Option<f64>,
    /// The same in processor seconds of the whole process, so that a busy computer changes no answer; by the
    /// clock where the system does not tell them. `None`: no end.
    pub processor_limit_s: Option<f64>,
}

/// What a machine can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineLimits {
    /// Room on either side of where a run begins, metres.
    pub half_travel_m: f64,
    /// Greatest speed, m/s.
    pub velocity_m_s: f64,
    /// Greatest acceleration, m/s².
    pub acceleration_m_s2: f64,
    /// Greatest jerk, m/s³.
    pub jerk_m_s3: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            significance: 1e-3,
            least_excess_share: 0.05,
            training_gate: 4.0,
            held_out_gate: 2.5,
            separation: 4.0,
            most_terms: 4,
            without: Vec::new(),
            most_amplitude: None,
            limits: None,
            time_limit_s: None,
            processor_limit_s: None,
        }
    }
}
