//! Energy tank: a passivity layer below any bilateral control law (Franken, Stramigioli, Misra, Secchi and Macchelli,
//! *IEEE T-RO* 27(4), 2011).
//!
//! Each side has a tank. The energy of the device comes from the tank, and each side sends a share of its tank to the
//! other:
//!
//! ```text
//! H += received - F[k-1] (x[k] - x[k-1])       to send: SHARE H      F = F_in - d v,   |F_in| <= H / (|v| h),   0 if H <= 0
//! d = D_PARAM (1 - H / LEVEL), 0 to D_PARAM
//! ```
//!
//! `v = (x[k] - x[k-1]) / h`. Below `LEVEL`, the damping `d` fills the tank from the operator's motion. Enable it on
//! one side only; the other side is filled over the link (`LEVEL 0`). The force is limited by the velocity of the last
//! tick, so the tank can be overdrawn by the energy of one tick; the force is then 0 until the tank is positive again.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FEED_FORCE, types::FAR_ENERGY],
//!     "all TANK_MOD PORT_FORCE_IN FEED_FORCE\nall MOD_ENG MOD_ON TANK_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! // Empty tank: no force.
//! assert_eq!(bench.tick(&[0.0, 1.0, 0.0], "DES_FORCE"), Some(0.0));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::energy_ledger::Ledger;
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, ParameterSet, Parameters, Unit, Vector,
    math, types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Share of the tank's energy sent to the peer per tick.
        share: f32 = real("SHARE", Unit::One, 0.0..=1.0, 0.01),
        rate_hz: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Energy below which the operator's motion fills the tank; 0: never.
        level_j: f32 = per_axis("LEVEL", Unit::Energy, 0.0..=100.0, 0.0),
        /// Damping that fills the tank, when the tank is empty.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e4, 5.0),
        /// Capacity of the tank; excess energy is discarded.
        energy_limit_j: f32 = per_axis("ENERGY_LIMIT", Unit::Energy, 0.0..=100.0, 1.0),
        /// `D_PARAM / LEVEL`; 0 for `LEVEL 0`.
        damping_per_j: f32,
    }
    /// State of one axis.
    pub struct AxisState { tank: Ledger, previous: f32, force: f32 }
    /// Ports.
    pub ports Ports {
        position: Input,
        wanted: Input,
        far_energy: Input<Vector<u32>>,
        force: Output,
        line_energy: Output<Vector<u32>>,
        energy: Output,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct EnergyTank;

impl Module for EnergyTank {
    const NAME: &'static str = "TANK_MOD";
    const SUMMARY: &'static str = "Energy tank: limits the force to the available energy.";
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        settings.visit(visit);
        gains.visit(visit);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.rate_hz = 1.0 / device.sample_period_s();
    }

    fn prepare_axis(_: &Settings, gains: &mut Gains, _: &DeviceDescriptor) {
        let per_j = gains.damping / gains.level_j.max(1e-6);
        gains.damping_per_j = if gains.level_j > 0.0 { per_j } else { 0.0 };
    }

    fn ports(_: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let wanted = types::DES_FORCE.instance(2);
        Ports {
            position: declare.input("POSITION", types::POSITION),
            wanted: declare.default_signal(wanted).input("FORCE_IN", types::DES_FORCE),
            far_energy: declare.input("FAR_ENERGY", types::FAR_ENERGY),
            force: declare.output("DES_FORCE", types::DES_FORCE),
            line_energy: declare.output("LINE_ENERGY", types::LINE_ENERGY),
            energy: declare.output("PORT_ENERGY", types::PORT_ENERGY),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, far_energy, .. } = context.ports();
        context.begin_axes((position, far_energy), |_, (x, far_energy)| AxisState {
            tank: Ledger::new(far_energy),
            previous: x,
            force: 0.0,
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, wanted, far_energy, force, line_energy, energy } = context.ports();
        let Settings { share, rate_hz } = context.settings();
        let (inputs, outputs) = ((position, wanted, far_energy), (force, line_energy, energy));
        context.map_axes(inputs, outputs, |gains, axis, (x, wanted, far_energy)| {
            let step = x - axis.previous;
            axis.previous = x;
            axis.tank.receive(far_energy, gains.energy_limit_j);
            axis.tank.add(-axis.force * step, gains.energy_limit_j);
            let to_send_j = share * axis.tank.balance_j().max(0.0);
            axis.tank.send(to_send_j);
            axis.tank.add(-to_send_j, gains.energy_limit_j);
            let level_j = axis.tank.balance_j();
            let filling = (gains.damping_per_j * (gains.level_j - level_j)).min(gains.damping).max(0.0);
            axis.force = allowed(wanted, step.abs(), level_j) - filling * step * rate_hz;
            (axis.force, axis.tank.sent(), level_j)
        });
    }
}

/// Limits the force to the energy of the tank, for a next step as long as the last one.
#[inline(always)]
fn allowed(force: f32, step: f32, level_j: f32) -> f32 {
    if level_j <= 0.0 {
        0.0
    } else if force.abs() * step <= level_j {
        force
    } else {
        math::limit(force, level_j / step)
    }
}
