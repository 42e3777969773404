//! What acts on a moving mass, described as a straight line through where the mass is now.
//!
//! `F(t + τ, x + dx, v + dv) = force_n + rate_n_per_s τ - stiffness_n_per_m dx - damping_ns_per_m dv`

use core::ops::AddAssign;

/// A force and its slopes at one instant, one position and one velocity, and how far that straight line reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// Force on the mass now, `N`.
    pub force_n: f64,
    /// How the force changes with time alone, `N/s`, until the period ends.
    pub rate_n_per_s: f64,
    /// `-dF/dx`, `N/m`.
    pub stiffness_n_per_m: f64,
    /// `-dF/dv`, `N s/m`.
    pub damping_ns_per_m: f64,
    /// The line holds exactly while the position stays within this of where it is now, `m`. 0 is always safe:
    /// the law is then asked for at every sub-step.
    pub reach_m: f64,
    /// The same for the velocity, `m/s`.
    pub reach_m_per_s: f64,
}

impl Default for Law {
    /// No force, anywhere.
    fn default() -> Self {
        Self {
            force_n: 0.0,
            rate_n_per_s: 0.0,
            stiffness_n_per_m: 0.0,
            damping_ns_per_m: 0.0,
            reach_m: f64::INFINITY,
            reach_m_per_s: f64::INFINITY,
        }
    }
}

impl AddAssign for Law {
    /// Both forces together; holds where both do.
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.force_n += other.force_n;
        self.rate_n_per_s += other.rate_n_per_s;
        self.stiffness_n_per_m += other.stiffness_n_per_m;
        self.damping_ns_per_m += other.damping_ns_per_m;
        self.reach_m = self.reach_m.min(other.reach_m);
        self.reach_m_per_s = self.reach_m_per_s.min(other.reach_m_per_s);
    }
}

/// As what an environment's force is reported in [`AxisTruth`](super::AxisTruth).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A human: counted in `hand_force_n`.
    Hand,
    /// An obstacle: counted in `wall_force_n`.
    Wall,
}

/// Something that pushes on one moving mass.
///
/// Where the law is linear its slopes must repeat bit by bit, because a change of slope is what tells the axis
/// that something happened (contact, release) whose instant must be located.
pub trait Environment: core::fmt::Debug + Send {
    /// As what its force is reported.
    fn role(&self) -> Role;

    /// Mass that moves rigidly with the device, `kg`, constant.
    fn added_mass_kg(&self) -> f64 {
        0.0
    }

    /// Called once at the start of every held period, before any [`law`](Self::law) of that period.
    fn begin_period(&mut self, start_s: f64, period_s: f64) {
        let _ = (start_s, period_s);
    }

    /// The law `elapsed_s` after the start of the period, at `position_m` (`m`) moving at `velocity_m_per_s`
    /// (`m/s`). The inertia of [`added_mass_kg`](Self::added_mass_kg) is not in it.
    fn law(&self, elapsed_s: f64, position_m: f64, velocity_m_per_s: f64) -> Law;
}
