//! Wave port with impedance causality: velocity in, force out.
//!
//! `F = a in - b v`, `out = a v - in`, `a = sqrt(2 b)`; `F` is the force on the local device. Use it for a device that
//! measures velocity and needs no controller between the device and the line: the classical master of Niemeyer and
//! Slotine (1991).

use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, math, types, words};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Wave impedance b.
        impedance: f32 = real("B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0),
        /// `sqrt(2 b)`.
        a: f32,
    }
    /// Ports.
    pub ports Ports {
        waves_in: Input = input("WAVES_IN", types::CH2_WAVES),
        velocity: Input = input("VELOCITY", types::VELOCITY),
        waves_out: Output = output("WAVES_OUT", types::CH1_WAVES),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct WaveImpedance;

impl Module for WaveImpedance {
    const NAME: &'static str = "WIMPEDANCE_MOD";
    const SUMMARY: &'static str = "Wave port with velocity input and force output.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn prepare(settings: &mut Settings, _: &DeviceDescriptor) {
        settings.a = math::sqrt(2.0 * settings.impedance);
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { waves_in, velocity, waves_out, force } = context.ports();
        let Settings { impedance: b, a } = context.settings();
        context.map_axes([waves_in, velocity], [waves_out, force], |(), (), [wave, velocity]| {
            [a * velocity - wave, a * wave - b * velocity]
        });
    }
}
