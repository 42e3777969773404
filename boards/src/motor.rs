//! Open-loop torque control of a brushed motor.
//!
//! current = torque / torque constant; voltage = resistance · current, up to the supply
//!
//! Holds at standstill, without inductance. The back-EMF of a turning motor (`torque constant · speed`) is
//! not compensated: it acts as viscous friction of torque constant² / resistance, `N·m·s/rad`. Accurate
//! torque at speed needs a current controller.

use dimsart_core::{InputLimits, OutputLimits, SafeValue};

/// A motor, its supply and its encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Torque per current, `N·m/A`, at the shaft that the encoder measures.
    pub torque_constant_nm_per_a: f32,
    /// Resistance between the terminals (brushed), or of one phase to the star point (three-phase), `ohm`.
    pub resistance_ohm: f32,
    /// Maximum current command, `A`, either sign.
    pub max_current_a: f32,
    /// Supply voltage, `V`.
    pub supply_v: f32,
    /// Counts of the encoder per turn, all four edges counted.
    pub counts_per_turn: u16,
    /// Pole pairs; 1 for a brushed motor.
    pub pole_pairs: u8,
}

/// Rise time from zero to maximum torque.
pub(crate) const RISE_S: f32 = 0.01;

impl Motor {
    /// Returns the limits of torque commands, `N·m`: from the current limit, with 10 ms from zero to maximum;
    /// safe value 0.
    #[must_use]
    pub const fn limits(&self) -> InputLimits {
        let max = self.torque_constant_nm_per_a * self.max_current_a;
        InputLimits { min: -max, max, rate_per_s: max / RISE_S, safe_value: SafeValue::Zero }
    }

    /// Returns the limits of position measurements: any angle, and 1.5 times the no-load speed at this
    /// supply.
    #[must_use]
    pub const fn position_limits(&self) -> OutputLimits {
        let speed_rad_per_s = self.supply_v / self.torque_constant_nm_per_a;
        OutputLimits { rate_per_s: 1.5 * speed_rad_per_s, ..OutputLimits::NONE }
    }

    /// Returns the voltage for `torque_nm` at standstill as a share of the supply, -1 to 1.
    #[must_use]
    pub fn voltage_share(&self, torque_nm: f32) -> f32 {
        let current_a = torque_nm / self.torque_constant_nm_per_a;
        (self.resistance_ohm * current_a / self.supply_v).clamp(-1.0, 1.0)
    }
}

/// A torque ramp after the alignment of the rotor: from 0 to the command within the rate limit. After that
/// only the safety stage limits the torque.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ramp {
    /// Torque of the last tick; `None` when the command is reached.
    given_nm: Option<f32>,
}

impl Ramp {
    /// Starts at 0.
    pub fn begin(&mut self) {
        self.given_nm = Some(0.0);
    }

    /// Returns the torque of this tick for a motor with these limits.
    pub fn step(&mut self, commanded_nm: f32, limits: &InputLimits, period_s: f32) -> f32 {
        let Some(last_nm) = self.given_nm else { return commanded_nm };
        let step_nm = limits.rate_per_s * period_s;
        let given_nm = commanded_nm.max(last_nm - step_nm).min(last_nm + step_nm);
        self.given_nm = (given_nm.to_bits() != commanded_nm.to_bits()).then_some(given_nm);
        given_nm
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::f32::consts::TAU;

    use dimsart_core::{AxisKind, DeviceDescriptor, types};
    use std::vec;

    use super::*;

    const MOTOR: Motor = Motor {
        torque_constant_nm_per_a: 0.05,
        resistance_ohm: 0.6,
        max_current_a: 5.0,
        supply_v: 12.0,
        counts_per_turn: 4096,
        pole_pairs: 7,
    };

    #[test]
    fn a_ramp_reaches_the_command_at_the_rate_and_passes_it_from_then_on() {
        let (limits, mut ramp) = (MOTOR.limits(), Ramp::default());
        assert_eq!(ramp.step(limits.max, &limits, 1e-3).to_bits(), limits.max.to_bits(), "no ramp yet");
        for _ in 0..2 {
            ramp.begin();
            let mut last_nm = 0.0;
            for tick in 1..20 {
                let given_nm = ramp.step(limits.max, &limits, 1e-3);
                assert!(given_nm - last_nm <= limits.max / 10.0 * 1.001, "{tick}: {last_nm} to {given_nm}");
                last_nm = given_nm;
            }
            assert_eq!(last_nm.to_bits(), limits.max.to_bits());
            for commanded_nm in [limits.min, limits.max, 0.0] {
                let given_nm = ramp.step(commanded_nm, &limits, 1e-3);
                assert_eq!(given_nm.to_bits(), commanded_nm.to_bits());
            }
        }
    }

    #[test]
    fn a_motor_allows_the_torque_of_its_current_and_no_step_to_it() {
        let InputLimits { min, max, rate_per_s, safe_value } = MOTOR.limits();
        let max_nm = MOTOR.torque_constant_nm_per_a * MOTOR.max_current_a;
        assert_eq!([min, max].map(f32::to_bits), [-max_nm, max_nm].map(f32::to_bits));
        assert!((max / rate_per_s - 0.01).abs() < 1e-6);
        assert_eq!(safe_value, SafeValue::Zero);
        for axes in 1..=8 {
            let axes = vec![AxisKind::Rotary; axes];
            let device =
                DeviceDescriptor::new("joints", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
            const LIMITS: &[&[InputLimits]] = &[&[MOTOR.limits()]];
            assert!(device.unwrap().with_limits(LIMITS).is_ok());
        }
    }

    #[test]
    fn a_motor_is_never_faster_than_its_encoder_may_show() {
        // Without load the motor turns until its back-EMF equals the supply.
        let fastest_rad_per_s = MOTOR.supply_v / MOTOR.torque_constant_nm_per_a;
        let limits = MOTOR.position_limits();
        assert!(limits.rate_per_s > 1.4 * fastest_rad_per_s && limits.rate_per_s < 2.0 * fastest_rad_per_s);
        // Half a turn of the 16-bit counter is more than that.
        let lost_rad = TAU * 32_768.0 / f32::from(MOTOR.counts_per_turn);
        assert!(lost_rad > limits.rate_per_s * 1e-3);
    }

    #[test]
    fn the_stalled_motor_makes_the_torque_that_the_safety_stage_passes_up_to_its_supply() {
        let torque = |drive: f32| drive * MOTOR.supply_v / MOTOR.resistance_ohm * 0.05;
        for wanted in [-0.2, 0.0, 0.1, MOTOR.limits().min, MOTOR.limits().max, 0.9] {
            assert!((torque(MOTOR.voltage_share(wanted)) - wanted).abs() < 1e-6, "{wanted}");
        }
        assert!((torque(MOTOR.voltage_share(f32::MIN)) + 1.0).abs() < 1e-6);
        let weak_supply = Motor { supply_v: 1.0, ..MOTOR };
        assert!((weak_supply.voltage_share(1.0) - 1.0).abs() < f32::EPSILON);
    }
}
