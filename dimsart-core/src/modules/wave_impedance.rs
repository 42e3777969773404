//! Wave port of the other causality: velocity in, force out.
//!
//! `F = a in - b v`, `out = a v - in`, `a = sqrt(2 b)`; `F` is the force on the local device.
//! For a device that measures velocity and needs no controller between it and the line; the
//! classical master of Niemeyer and Slotine (1991).

use crate::{
    Data, DeviceDescriptor, Input, Module, Output, Parameters, Ports, Unit, limits::MAX_DOF, math, types,
};

/// See the [module docs](self).
#[derive(Debug, Default)]
pub struct WaveImpedance {
    impedance: f32,
    a: f32,
    waves_in: Input,
    velocity: Input,
    waves_out: Output,
    force: Output,
}

impl Module for WaveImpedance {
    const NAME: &'static str = "WIMPEDANCE_MOD";
    const SUMMARY: &'static str = "Wave port with velocity in and force out.";

    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        visit.real(&mut self.impedance, "B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0, "Wave impedance b.");
    }

    fn activate(&mut self, ports: &mut Ports<'_>) {
        ports.input(&mut self.waves_in, "WAVES_IN", types::CH2_WAVES);
        ports.input(&mut self.velocity, "VELOCITY", types::VELOCITY);
        ports.output(&mut self.waves_out, "WAVES_OUT", types::CH1_WAVES);
        ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
    }

    fn prepare(&mut self, _: &DeviceDescriptor) {
        self.a = math::sqrt(2.0 * self.impedance);
    }

    fn compute(&mut self, data: &Data<'_>) {
        let (a, b) = (self.a, self.impedance);
        let outputs = [self.waves_out, self.force];
        data.map_axes([(); MAX_DOF], [self.waves_in, self.velocity], outputs, |(), [wave, velocity]| {
            [a * velocity - wave, a * wave - b * velocity]
        });
    }
}
