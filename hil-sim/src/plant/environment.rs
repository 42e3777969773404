//! What acts on a moving mass, described as a straight line through where the mass is now.
//!
//! `F(t + τ, x + dx, v + dv) = force_n + rate_n_per_s τ - stiffness_n_per_m dx - damping_ns_per_m dv`

use core::ops::AddAssign;

/// A force and its slopes at one instant, one position and one velocity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Law {
    /// Force on the mass now, `N`.
    pub force_n: f64,
    /// How the force changes with time alone, `N/s`.
    pub rate_n_per_s: f64,
    /// `-dF/dx`, `N/m`.
    pub stiffness_n_per_m: f64,
    /// `-dF/dv`, `N s/m`.
    pub damping_ns_per_m: f64,
}

impl AddAssign for Law {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.force_n += other.force_n;
        self.rate_n_per_s += other.rate_n_per_s;
        self.stiffness_n_per_m += other.stiffness_n_per_m;
        self.damping_ns_per_m += other.damping_ns_per_m;
    }
}

/// As what an environment's force is reported in [`AxisTruth`](super::AxisTruth).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A human: counted in `hand_force_n`.
    Hand,
    /// An obstacle: counted in `wall_force_n`.
    Wall,
    /// Part of the mechanics: in no sum.
    Mechanism,
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
