//! Passivity observer and controller of one port (Hannaford and Ryu, *IEEE T-RA* 18(1), 2002).
//!
//! The observer integrates the energy `E` that enters the port; if the port has generated energy, the controller
//! dissipates it with a variable damper as soon as the port moves:
//!
//! ```text
//! IMPEDANCE   E += -F[k-1] (x[k] - x[k-1])         α = min(-E / (h v²), DAMPER) if E < 0     F = F_in - α v
//! ADMITTANCE  E += -F[k] (x_d[k] - x_d[k-1])       β = min(-E / (h F²), 1/DAMPER) if E < 0     x_d += Δx_in - h β F
//! ```
//!
//! A force is held until the next tick, so the energy delivered to the device is the held force times the following
//! displacement; using the force of the same tick would give the energy leak of the hold the wrong sign (Stramigioli
//! and others, *IEEE T-RO* 21(4), 2005). A deficit left by the damper or force limit stays in `E` and is dissipated
//! later.
//!
//! The damper acts one tick late. To avoid oscillation, keep a series damper below `m/h` for a moving mass `m`, and a
//! parallel damper above `h K` for a coupling stiffness `K`. `E` is limited to `ENERGY_LIMIT`; otherwise energy
//! absorbed an hour ago would cover a port that is active now.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! // A spring that pulls harder on the way back, 1 N instead of 0: the port generated 1 mJ.
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FEED_FORCE],
//!     "all PASSIVITY_MOD PORT_FORCE_IN FEED_FORCE\nall MOD_ENG MOD_ON PASSIVITY_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! bench.tick(&[0.0, 1.0], "DES_FORCE");
//! let force_n = bench.tick(&[1e-3, 0.0], "DES_FORCE");
//! assert_eq!(force_n, Some(-1.0)); // dissipates 1 mJ over the next millimetre
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::damper::{Causality, Damper, damping};
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Parameters, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings { causality: Causality, period_s: f32, rate_hz: f32 }
    /// State of one axis.
    pub struct AxisState {
        energy: CompensatedSum,
        /// Position of the last tick; for `ADMITTANCE`, of the input.
        previous: f32,
        /// Force held since the last tick.
        force: f32,
        desired: CompensatedSum,
        /// Step of the desired position in this tick.
        step: f32,
    }
    /// Ports.
    pub ports Ports { position: Input, wanted: Input, out: Output, force: Input, energy: Output }
}

impl AxisState {
    /// Adds the energy that entered. Returns the balance, `J`; negative for a deficit.
    fn observe(&mut self, energy_in_j: f32, limit_j: f32) -> f32 {
        self.energy.add_clamped(energy_in_j, limit_j);
        self.energy.value()
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct PassivityController;

impl Module for PassivityController {
    const NAME: &'static str = "PASSIVITY_MOD";
    const SUMMARY: &'static str =
        "Passivity observer and controller: dissipates energy that a port generated.";
    type Settings = Settings;
    type Gains = Damper;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Damper, visit: &mut Parameters<'_>) {
        settings.causality.parameter(visit);
        gains.parameters(visit, "Maximum stored energy credited to the port.");
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
        settings.rate_hz = 1.0 / settings.period_s;
    }

    fn prepare_axis(settings: &Settings, gains: &mut Damper, _: &DeviceDescriptor) {
        gains.prepare(settings.causality);
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let position = declare.input("POSITION", types::POSITION);
        if settings.causality == Causality::Impedance {
            let wanted = types::DES_FORCE.instance(2);
            return Ports {
                position,
                wanted: declare.default_signal(wanted).input("FORCE_IN", types::DES_FORCE),
                out: declare.output("DES_FORCE", types::DES_FORCE),
                energy: declare.output("PORT_ENERGY", types::PORT_ENERGY),
                ..Ports::default()
            };
        }
        let wanted = types::DES_POSITION.instance(2);
        Ports {
            position,
            wanted: declare.default_signal(wanted).input("POSITION_IN", types::DES_POSITION),
            out: declare.output("DES_POSITION", types::DES_POSITION),
            force: declare.late().input("DES_FORCE", types::DES_FORCE),
            energy: declare.late().output("PORT_ENERGY", types::PORT_ENERGY),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, wanted, out, .. } = context.ports();
        let is_impedance = context.settings().causality == Causality::Impedance;
        let takes_over = context.takes_over();
        context.begin_axes([position, wanted, out.last()], |_, [x, wanted, last]| {
            if is_impedance {
                return AxisState { previous: x, ..AxisState::default() };
            }
            let desired = CompensatedSum::new(if takes_over { last } else { x });
            AxisState { previous: wanted, desired, ..AxisState::default() }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, wanted, out, energy, .. } = context.ports();
        let Settings { causality, period_s, rate_hz } = context.settings();
        if causality == Causality::Admittance {
            context.map_axes([wanted], [out], |gains, axis, [wanted]| {
                let mobility = damping(-axis.energy.value(), axis.force, period_s, gains.cap);
                axis.step = wanted - axis.previous - period_s * mobility * axis.force;
                axis.previous = wanted;
                [axis.desired.add(axis.step)]
            });
            return;
        }
        context.map_axes([position, wanted], [out, energy], |gains, axis, [x, wanted]| {
            let step = x - axis.previous;
            axis.previous = x;
            let energy_j = axis.observe(-axis.force * step, gains.energy_limit_j);
            let velocity = step * rate_hz;
            let damper = damping(-energy_j, velocity, period_s, gains.cap);
            axis.force = math::limit(wanted - damper * velocity, gains.limit);
            [axis.force, energy_j]
        });
    }

    #[inline(always)]
    fn compute_late(context: &Context<'_, Self>) {
        let Ports { force, energy, .. } = context.ports();
        context.map_axes([force], [energy], |gains, axis, [force]| {
            axis.force = force;
            [axis.observe(-force * axis.step, gains.energy_limit_j)]
        });
    }
}
