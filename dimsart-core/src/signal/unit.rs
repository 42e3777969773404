//! Physical units of signals and parameters, SI throughout.
//!
//! A generalised coordinate is a length on a linear axis and an angle on a rotary one, so the same
//! control law serves both: `Unit::Position` reads `m` or `rad`, `Unit::Force` reads `N` or `N·m`.
//!
//! The tip of an arm moves in metres whatever its joints do: its signals have the units of their own, `Unit::Metre`, ...,
//! and a law that serves both kinds of joints serves them, too: see [`Unit::takes`].

/// What moves on an axis.
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
        /// Unit of a signal or a parameter. On the wire it is its place in this list, so a new one goes to the end.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        pub enum Unit {
            $(#[doc = $doc] $unit,)*
        }

        impl Unit {
            /// Every one, in the order of the wire.
            pub const ALL: &[Self] = &[$(Self::$unit),*];

            /// The unit as text on an axis of `kind`; empty for a pure number.
            #[must_use]
            pub const fn symbol(self, kind: AxisKind) -> &'static str {
                match (self, kind) {
                    $((Self::$unit, AxisKind::Linear) => $linear, (Self::$unit, AxisKind::Rotary) => $rotary,)*
                }
            }
        }
    };
}

// On an axis that slides, and on one that turns.
units! {
    Any "any" "any" "Fits every unit: the port of a module that does not care, such as an integrator.";
    One "" "" "A pure number.";
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
    Metre "m" "m" "`m`: a Cartesian coordinate, or a length.";
    MetrePerSecond "m/s" "m/s" "`m/s`: its velocity.";
    MetrePerSecondSquared "m/s²" "m/s²" "`m/s²`: its acceleration.";
    Newton "N" "N" "`N`: the force along it.";
    Kilogram "kg" "kg" "`kg`.";
    Radian "rad" "rad" "`rad`, whatever moves on an axis.";
}

impl Unit {
    /// Whether it is another one on a rotary axis than on a linear one.
    #[must_use]
    pub const fn is_of_axis(self) -> bool {
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

    /// The unit of an integral over time, this one times `s`; none when it has no name here.
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

    /// The unit of a derivative by time, this one over `s`; none when it has no name here.
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

    /// Largest magnitude that a signal of this unit can have: far beyond what any joint does, far below what `f32`
    /// cannot count with any more. A module that writes more has failed.
    #[must_use]
    pub const fn largest(self) -> f32 {
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

    /// The unit of the same quantity in Cartesian coordinates; none for a quantity that has no axis.
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

    /// Whether a port that expects this unit takes a signal of unit `found`: one that [fits](Self::fits), or the same
    /// quantity in Cartesian coordinates. Then all coordinates of its module have to be Cartesian.
    #[must_use]
    pub fn takes(self, found: Self) -> bool {
        self.fits(found) || self.cartesian() == Some(found)
    }

    /// Whether a signal of this unit may be bound where `other` is expected.
    #[must_use]
    pub fn fits(self, other: Self) -> bool {
        self == other || self == Self::Any || other == Self::Any
    }
}
