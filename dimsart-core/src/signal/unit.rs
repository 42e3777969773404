//! Physical units of signals and parameters, SI throughout.
//!
//! A generalised coordinate is a length on a linear axis and an angle on a rotary one, so the same
//! control law serves both: `Unit::Position` reads `m` or `rad`, `Unit::Force` reads `N` or `N·m`.
//!
//! The tip of an arm moves in metres whatever the kind of its joints, so its signals have Cartesian units,
//! `Unit::Metre`, ... A law for both kinds of joints accepts them too: see [`Unit::takes`].

/// Kind of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisKind {
    /// Moves in metres, driven by newtons.
    #[default]
    Linear,
    /// Turns in radians, driven by newton metres.
    Rotary,
}

macro_rules! units {
    ($($unit:ident $linear:literal $rotary:literal $doc:literal;)*) => {
        /// Unit of a signal or a parameter. On the wire it is the index in this list: add new units at the
        /// end.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        pub enum Unit {
            $(#[doc = $doc] $unit,)*
        }

        impl Unit {
            /// All units, in wire order.
            pub const ALL: &[Self] = &[$(Self::$unit),*];

            /// Returns the symbol on an axis of `kind`; empty if dimensionless.
            #[must_use]
            pub const fn symbol(self, kind: AxisKind) -> &'static str {
                match (self, kind) {
                    $((Self::$unit, AxisKind::Linear) => $linear, (Self::$unit, AxisKind::Rotary) => $rotary,)*
                }
            }
        }
    };
}

// Symbols on a linear axis and on a rotary axis.
units! {
    Any "any" "any" "Any unit: for ports of generic modules, such as an integrator.";
    One "" "" "Dimensionless.";
    Position "m" "rad" "`m` or `rad`.";
    Velocity "m/s" "rad/s" "`m/s` or `rad/s`.";
    Force "N" "N·m" "`N` or `N·m`.";
    Stiffness "N/m" "N·m/rad" "`N/m` or `N·m/rad`.";
    Damping "N·s/m" "N·m·s/rad" "`N·s/m` or `N·m·s/rad`; also the wave impedance.";
    IntegralGain "N/(m·s)" "N·m/(rad·s)" "`N/(m·s)` or `N·m/(rad·s)`: integral gain.";
    Wave "sqrt(W)" "sqrt(W)" "Wave variable, `sqrt(W)` on every axis.";
    Energy "J" "J" "`J`.";
    Second "s" "s" "`s`.";
    Hertz "Hz" "Hz" "`Hz`.";
    Tick "ticks" "ticks" "Whole ticks of the sample period.";
    Ampere "A" "A" "`A`.";
    Volt "V" "V" "`V`.";
    Celsius "°C" "°C" "`°C`.";
    Acceleration "m/s²" "rad/s²" "`m/s²` or `rad/s²`.";
    Jerk "m/s³" "rad/s³" "`m/s³` or `rad/s³`.";
    Inertia "kg" "kg·m²" "`kg` or `kg·m²`.";
    Metre "m" "m" "`m`: a Cartesian coordinate or a length.";
    MetrePerSecond "m/s" "m/s" "`m/s`: a Cartesian velocity.";
    MetrePerSecondSquared "m/s²" "m/s²" "`m/s²`: a Cartesian acceleration.";
    Newton "N" "N" "`N`: a Cartesian force.";
    Kilogram "kg" "kg" "`kg`.";
    Radian "rad" "rad" "`rad`, on linear and rotary axes.";
}

impl Unit {
    /// Returns whether the unit differs between linear and rotary axes.
    #[must_use]
    pub const fn depends_on_axis(self) -> bool {
        matches!(
            self,
            Self::Position
                | Self::Velocity
                | Self::Acceleration
                | Self::Jerk
                | Self::Force
                | Self::Stiffness
                | Self::Damping
                | Self::IntegralGain
                | Self::Inertia
        )
    }

    /// Returns the unit of the time integral (this unit times `s`), if this list has it.
    #[must_use]
    pub const fn integral(self) -> Option<Self> {
        match self {
            Self::Any => Some(Self::Any),
            Self::One => Some(Self::Second),
            Self::Hertz => Some(Self::One),
            Self::Velocity => Some(Self::Position),
            Self::Acceleration => Some(Self::Velocity),
            Self::Jerk => Some(Self::Acceleration),
            Self::MetrePerSecond => Some(Self::Metre),
            Self::MetrePerSecondSquared => Some(Self::MetrePerSecond),
            Self::Damping => Some(Self::Inertia),
            Self::Stiffness => Some(Self::Damping),
            Self::IntegralGain => Some(Self::Stiffness),
            _ => None,
        }
    }

    /// Returns the unit of the time derivative (this unit divided by `s`), if this list has it.
    #[must_use]
    pub const fn derivative(self) -> Option<Self> {
        match self {
            Self::Any => Some(Self::Any),
            Self::One => Some(Self::Hertz),
            Self::Second => Some(Self::One),
            Self::Position => Some(Self::Velocity),
            Self::Velocity => Some(Self::Acceleration),
            Self::Acceleration => Some(Self::Jerk),
            Self::Metre => Some(Self::MetrePerSecond),
            Self::MetrePerSecond => Some(Self::MetrePerSecondSquared),
            Self::Inertia => Some(Self::Damping),
            Self::Stiffness => Some(Self::IntegralGain),
            Self::Damping => Some(Self::Stiffness),
            _ => None,
        }
    }

    /// Returns the maximum magnitude of a signal of this unit, far beyond any joint's values. A module that
    /// writes more has failed.
    #[must_use]
    pub const fn max_magnitude(self) -> f32 {
        match self {
            Self::Position | Self::Velocity | Self::Force | Self::Wave => 1e9,
            Self::Metre | Self::MetrePerSecond | Self::Newton => 1e9,
            Self::Ampere | Self::Volt | Self::Celsius => 1e9,
            Self::Stiffness | Self::Damping | Self::Inertia | Self::IntegralGain | Self::Energy => 1e12,
            Self::Acceleration | Self::Jerk | Self::MetrePerSecondSquared => 1e12,
            Self::Kilogram | Self::Radian => 1e9,
            Self::Any | Self::One | Self::Second | Self::Hertz | Self::Tick => f32::MAX,
        }
    }

    /// Returns the Cartesian unit of the same quantity; none for a quantity without an axis.
    #[must_use]
    pub const fn cartesian(self) -> Option<Self> {
        match self {
            Self::Position => Some(Self::Metre),
            Self::Velocity => Some(Self::MetrePerSecond),
            Self::Acceleration => Some(Self::MetrePerSecondSquared),
            Self::Force => Some(Self::Newton),
            _ => None,
        }
    }

    /// Returns whether a port of this unit accepts a signal of unit `found`: a unit that [fits](Self::matches),
    /// or its Cartesian equivalent. Then all coordinates of the module must be Cartesian.
    #[must_use]
    pub fn accepts(self, found: Self) -> bool {
        self.matches(found) || self.cartesian() == Some(found)
    }

    /// Returns whether a signal of this unit can be bound to a port of unit `other`.
    #[must_use]
    pub fn matches(self, other: Self) -> bool {
        self == other || self == Self::Any || other == Self::Any
    }
}
