//! Wave port of the other causality: velocity in, force out.
//!
//! `F = a in - b v`, `out = a v - in`, `a = sqrt(2 b)`; `F` is the force on the local device.
//! For a device that measures velocity and needs no controller between it and the line; the
//! classical master of Niemeyer and Slotine (1991).

use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, Parameters, Unit, math, types, words,
};

words! {
    /// Of all axes.
    pub struct Settings {
        impedance: f32,
        /// `sqrt(2 b)`.
        a: f32,
    }
    /// Signals.
    pub struct Ports { waves_in: Input, velocity: Input, waves_out: Output, force: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct WaveImpedance;

impl Module for WaveImpedance {
    const NAME: &'static str = "WIMPEDANCE_MOD";
    const SUMMARY: &'static str = "Wave port with velocity in and force out.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, _: &mut (), visit: &mut Parameters<'_>) {
        let impedance = &mut settings.impedance;
        visit.real(impedance, "B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0, "Wave impedance b.");
    }

    fn prepare(settings: &mut Settings, _: &DeviceDescriptor) {
        settings.a = math::sqrt(2.0 * settings.impedance);
    }

    fn ports(_: &Settings, declare: &mut Declare<'_>) -> Ports {
        Ports {
            waves_in: declare.input("WAVES_IN", types::CH2_WAVES),
            velocity: declare.input("VELOCITY", types::VELOCITY),
            waves_out: declare.output("WAVES_OUT", types::CH1_WAVES),
            force: declare.output("DES_FORCE", types::DES_FORCE),
        }
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
