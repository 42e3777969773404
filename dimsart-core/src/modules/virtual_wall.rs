//! Virtual wall: a one-sided spring and damper at a set position.
//!
//! `F = -s max(0, K p + B p')` with the penetration `p = s (x - x_w) > 0`; `s = +1` for a wall that
//! stops motion to larger positions, `-1` for `BELOW`. Pushes, never pulls. `p'` by backward difference.

use crate::{Choice, Data, DeviceDescriptor, Input, Module, Output, Parameters, PerAxis, Ports, Unit, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct VirtualWall {
    wall_position: PerAxis,
    stiffness: PerAxis,
    damping: PerAxis,
    side: Side,
    position: Input,
    force: Output,
    axes: [Axis; crate::limits::MAX_DOF],
    is_fresh: bool,
}

#[derive(Debug, Default)]
struct Axis {
    wall_position: f32,
    stiffness: f32,
    /// `B / h`.
    damping_per_tick: f32,
    previous: f32,
}

/// Where the wall is, seen from free space.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Side {
    #[default]
    Above,
    Below,
}

impl Choice for Side {
    const VALUES: &'static [Self] = &[Self::Above, Self::Below];
    const NAMES: &'static [&'static str] = &["ABOVE", "BELOW"];
}

impl Module for VirtualWall {
    const NAME: &'static str = "VWALL_MOD";
    const SUMMARY: &'static str = "One-sided virtual wall: spring and damper that only push.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let Self { wall_position, stiffness, damping, side, .. } = self;
        visit.per_axis(wall_position, "WALL_POSITION", Unit::Position, -1e3..=1e3, 0.0, "Where it begins.");
        visit.per_axis(stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Stiffness.");
        visit.per_axis(damping, "B_PARAM", Unit::Damping, 0.0..=1e4, 0.0, "Damping inside the wall.");
        visit.choice(side, "SIDE", "Whether it stops motion to larger or to smaller positions.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        let laws = self.wall_position.iter().zip(&self.stiffness).zip(&self.damping);
        for (axis, ((wall_position, stiffness), damping)) in self.axes.iter_mut().zip(laws) {
            axis.wall_position = *wall_position;
            axis.stiffness = *stiffness;
            axis.damping_per_tick = damping / device.sample_period_s();
        }
    }

    fn compute(&mut self, data: &Data<'_>) {
        let outwards = if self.side == Side::Above { 1.0 } else { -1.0 };
        let is_fresh = core::mem::take(&mut self.is_fresh);
        data.map_axes(&mut self.axes, [self.position], [self.force], |axis, [x]| {
            let previous = if is_fresh { x } else { axis.previous };
            axis.previous = x;
            let depth = outwards * (x - axis.wall_position);
            let push = axis.stiffness * depth + axis.damping_per_tick * outwards * (x - previous);
            [if depth > 0.0 { -outwards * push.max(0.0) } else { 0.0 }]
        });
    }

    fn reset(&mut self) {
        self.is_fresh = true;
    }
}
