//! Phases of a press.

/// Phases of a run, each from the end of the previous one, `s`.
#[derive(Debug, Clone, PartialEq)]
pub struct Phases {
    /// Duration of a leg of the free path: out, across and back.
    pub path_leg_s: f64,
    /// Start of the push.
    pub contact_start_s: f64,
    /// The contact has settled.
    pub settled_s: f64,
    /// Release.
    pub release_s: f64,
    /// End of the run.
    pub end_s: f64,
}
