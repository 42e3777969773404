//! PID controller with anti-windup and filtered derivative.
//!
//! `F = sat(K e + I + D v)`: `I` integrates `K_I e` and is bled by `(sat(F) - F) h / T_t`
//! (back-calculation, Åström & Hägglund, *Advanced PID Control*, section 3.5), so that it stops
//! winding while the force limit holds; `v` is the slope of the error through a first-order low-pass
//! `v += (slope - v) h / (h + T_f)`.

use crate::{Data, DeviceDescriptor, Input, Module, Output, Parameters, PerAxis, Ports, Unit, math, types};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct Pid {
    stiffness: PerAxis,
    integral_gain: PerAxis,
    damping: PerAxis,
    force_limit: PerAxis,
    tracking_time_s: f32,
    filter_time_s: f32,
    position: Input,
    desired_position: Input,
    force: Output,
    axes: [Axis; crate::limits::MAX_DOF],
    is_fresh: bool,
    tracking: f32,
    smoothing: f32,
}

#[derive(Debug, Default)]
struct Axis {
    stiffness: f32,
    /// `K_I h`.
    integral_gain_per_tick: f32,
    /// `D / h`.
    damping_per_tick: f32,
    limit: f32,
    integral: f32,
    previous_error: f32,
    filtered_change: f32,
}

impl Module for Pid {
    const NAME: &'static str = "PIDCTRL_MOD";
    const SUMMARY: &'static str = "PID controller on position with anti-windup and filtered derivative.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let Self { stiffness, integral_gain, damping, force_limit, tracking_time_s, filter_time_s, .. } =
            self;
        visit.per_axis(stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Proportional gain.");
        visit.per_axis(integral_gain, "I_PARAM", Unit::IntegralGain, 0.0..=1e7, 0.0, "Integral gain.");
        visit.per_axis(damping, "D_PARAM", Unit::Damping, 0.0..=1e4, 0.0, "Derivative gain.");
        visit.per_axis(force_limit, "LIMIT", Unit::Force, 0.0..=1e4, 1e4, "Largest force either way.");
        let summary = "Time in which the integral follows a saturated force (anti-windup).";
        visit.real(tracking_time_s, "TRACKING_TIME", Unit::Second, 1e-3..=100.0, 0.1, summary);
        let summary = "Time constant of the derivative's low-pass; 0 for none.";
        visit.real(filter_time_s, "FILTER_TIME", Unit::Second, 0.0..=10.0, 0.0, summary);
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.position, "POSITION", types::POSITION);
        ports.input(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
        ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
    }

    fn prepare(&mut self, device: &DeviceDescriptor) {
        let h = device.sample_period_s();
        self.tracking = (h / self.tracking_time_s).min(1.0);
        self.smoothing = h / (h + self.filter_time_s);
        let gains = self.stiffness.iter().zip(&self.integral_gain).zip(&self.damping).zip(&self.force_limit);
        for (axis, (((k, i), d), limit)) in self.axes.iter_mut().zip(gains) {
            axis.stiffness = *k;
            axis.integral_gain_per_tick = i * h;
            axis.damping_per_tick = d / h;
            axis.limit = *limit;
        }
    }

    fn compute(&mut self, data: &Data<'_>) {
        let inputs = [self.position, self.desired_position];
        if self.is_fresh {
            self.is_fresh = false;
            data.map_axes(&mut self.axes, inputs, [], |axis, [x, desired]| {
                axis.previous_error = desired - x;
                []
            });
        }
        let (tracking, smoothing) = (self.tracking, self.smoothing);
        data.map_axes(&mut self.axes, inputs, [self.force], |axis, [x, desired]| {
            let error = desired - x;
            let change = error - axis.previous_error;
            axis.previous_error = error;
            axis.filtered_change += smoothing * (change - axis.filtered_change);
            let integral = axis.integral + axis.integral_gain_per_tick * error;
            let wanted = axis.stiffness * error + integral + axis.damping_per_tick * axis.filtered_change;
            let force = math::limit(wanted, axis.limit);
            axis.integral = integral + tracking * (force - wanted);
            [force]
        });
    }

    fn reset(&mut self) {
        self.is_fresh = true;
        for axis in &mut self.axes {
            axis.integral = 0.0;
            axis.filtered_change = 0.0;
        }
    }
}
