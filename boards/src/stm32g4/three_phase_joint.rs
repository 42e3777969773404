//! The joint that a three-phase motor turns, above its current loop.

use dimsart_core::{DataType, DriveFault, Scalar as _, Tick, Word, types};
use embassy_stm32::gpio::{AfType, Flex};

use super::current_loop::{self, ThreePhase};
use crate::Selected;
use crate::board::{Joints, is_driven};
use crate::current_loop::Told;
use crate::motor::{Motor, Ramp};
use crate::shaft::Shaft;

const MOTOR: Motor = <Selected as ThreePhase>::MOTOR;

/// What it measures.
pub(crate) const OUTPUTS: &[&DataType] = &[
    types::POSITION,
    types::VELOCITY,
    types::MOTOR_CURRENT,
    types::SUPPLY_VOLTAGE,
    types::BRIDGE_TEMPERATURE,
    types::CAN_REJOINS,
];

/// Has a pin be one of a peripheral's, for good.
pub(crate) fn keep_as(mut pin: Flex<'static>, function: u8, kind: AfType) {
    pin.set_as_af_unchecked(function, kind);
    core::mem::forget(pin);
}

/// The joint, above the current loop.
#[derive(Default)]
pub struct Joint {
    shaft: Shaft,
    /// Of the last tick.
    told: Told,
    fault: Option<DriveFault>,
    /// From the end of the aligning on.
    ramp: Ramp,
}

impl Joints for Joint {
    fn read(&mut self, measured: &mut [Word]) {
        let last = self.told.periods;
        match current_loop::exchange().told() {
            Some(told) if told.periods != last => {
                self.told = told;
                self.fault = told.fault;
                self.shaft.update(told.angle);
            }
            // None in a whole tick.
            _ => self.fault = Some(DriveFault::Silent),
        }
        let Told { speed_rad_per_s, current_a, bus_v, temperature_c, .. } = self.told;
        let read = [self.shaft.angle_rad(), speed_rad_per_s, current_a, bus_v, temperature_c];
        for (word, value) in measured.iter_mut().zip(read) {
            *word = value.into_word();
        }
        super::measure(measured.get_mut(read.len()..));
    }

    fn fault(&self) -> Option<DriveFault> {
        self.fault
    }

    fn write(&mut self, tick: Tick, commanded: &[Word]) {
        let is_ready = self.told.is_ready;
        if self.fault == Some(DriveFault::Silent)
            || !is_driven(tick, commanded)
            || tick != Tick::Ran && !is_ready
        {
            current_loop::disarm();
            return self.ramp.begin();
        }
        if !is_ready {
            self.ramp.begin();
        }
        let wanted_nm =
            if is_ready { commanded.first().map_or(0.0, |word| f32::from_word(*word)) } else { 0.0 };
        current_loop::exchange().want(Some(self.ramp.follow(
            wanted_nm,
            &MOTOR.limits(),
            current_loop::TICK_S,
        )));
    }
}
