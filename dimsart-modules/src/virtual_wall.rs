//! Virtual wall: a one-sided spring and damper at a set position.
//!
//! `F = -s max(0, K p + B p')` with the penetration `p = s (x - x_w) > 0`. `s = +1` for `ABOVE`, a wall that blocks
//! motion to larger positions; `s = -1` for `BELOW`. The wall pushes and never pulls. `p'` is a backward difference.

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, choice, types, words};

choice! {
    /// Side of the free space on which the wall is.
    pub enum Side { Above = "ABOVE", Below = "BELOW" }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Block motion to positions above or below WALL_POSITION.
        side: Side = choice("SIDE"),
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Position of the wall.
        wall_position: f32 = per_axis("WALL_POSITION", Unit::Position, -1e3..=1e3, 0.0),
        /// Stiffness of the wall.
        stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
        /// Damping inside the wall.
        damping: f32 = per_axis("B_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
        /// `B / h`.
        damping_per_tick: f32,
    }
    /// State of one axis.
    pub struct AxisState { previous: f32 }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct VirtualWall;

impl Module for VirtualWall {
    const NAME: &'static str = "VWALL_MOD";
    const SUMMARY: &'static str = "Virtual wall: one-sided spring and damper.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare_axis(_: &Settings, gains: &mut Gains, device: &DeviceDescriptor) {
        gains.damping_per_tick = gains.damping / device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        context.begin_axes([context.ports().position], |_, [x]| AxisState { previous: x });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, force } = context.ports();
        let outwards = if context.settings().side == Side::Above { 1.0 } else { -1.0 };
        context.map_axes([position], [force], |gains, axis, [x]| {
            let previous = axis.previous;
            axis.previous = x;
            let depth = outwards * (x - gains.wall_position);
            let push = gains.stiffness * depth + gains.damping_per_tick * outwards * (x - previous);
            [if depth > 0.0 { -outwards * push.max(0.0) } else { 0.0 }]
        });
    }
}
