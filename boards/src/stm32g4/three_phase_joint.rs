//! A joint with a three-phase motor, above its current loop.

use dimsart_core::{DataType, DriveFault, InputLimits, OutputLimits, Scalar as _, TickResult, Word, types};
use dimsart_link::protocol::{Identification, MotorFallback, MotorReport};
use drive::Configuration;
use embassy_stm32::gpio::{AfType, Flex};
use static_cell::StaticCell;

use super::bridge::ThreePhase;
use super::current_loop::{self, TICK_S};
use super::current_sensing;
use super::half_bridges::HalfBridges;
use crate::Selected;
use crate::board::{Joints, Limits, needs_power_stage};
use crate::current_loop::{CurrentLoop, LoopState};
use crate::motor::Ramp;
use crate::shaft::Shaft;
use crate::three_phase;

type EncoderPins = <Selected as ThreePhase>::EncoderPins;

/// Measured types.
pub(crate) const OUTPUTS: &[&DataType] = &[
    types::POSITION,
    types::VELOCITY,
    types::MOTOR_CURRENT,
    types::SUPPLY_VOLTAGE,
    types::BRIDGE_TEMPERATURE,
    types::CAN_REJOINS,
    types::TICK_PERIOD,
];

/// Assigns a pin permanently to a peripheral.
pub(crate) fn keep_as(mut pin: Flex<'static>, function: u8, kind: AfType) {
    pin.set_as_af_unchecked(function, kind);
    core::mem::forget(pin);
}

/// The joint.
pub struct Joint {
    /// Parts that wait for the configuration.
    waiting: Option<(HalfBridges, EncoderPins)>,
    shaft: Shaft,
    limits: InputLimits,
    /// Data of the last tick.
    told: LoopState,
    fault: Option<DriveFault>,
    /// Active after the alignment.
    ramp: Ramp,
}

impl Joint {
    /// Creates a joint whose current loop waits for its [configuration](Self::begin).
    pub(crate) fn new(bridges: HalfBridges, pins: EncoderPins) -> Self {
        let Configuration { joint, .. } = Selected::DRIVE.configuration;
        Self {
            waiting: Some((bridges, pins)),
            shaft: Shaft::new(joint, false),
            limits: InputLimits::NONE,
            told: LoopState::default(),
            fault: None,
            ramp: Ramp::default(),
        }
    }
}

impl Joints for Joint {
    const HAS_DRIVE: bool = true;

    /// Starts encoder, current loop and ADCs with the stored configuration or the image's.
    fn begin(&mut self, motor: &mut MotorReport) -> Option<Limits> {
        let checked = three_phase::select_configuration(motor, &Selected::image(), Selected::reads);
        let Configuration { encoder, joint, .. } = *checked.get();
        if let Some((bridges, pins)) = self.waiting.take() {
            let current_loop = CurrentLoop::new(&Selected::DRIVE, &checked, TICK_S);
            current_loop::start(current_loop, bridges, Selected::start_encoder(pins, encoder));
            current_sensing::start_converters(&Selected::CHANNELS);
        }
        self.shaft = Shaft::new(joint, encoder.is_absolute());
        self.limits = three_phase::torque_limits(checked.get());
        static TORQUES: StaticCell<[InputLimits; 1]> = StaticCell::new();
        static INPUTS: StaticCell<[&[InputLimits]; 1]> = StaticCell::new();
        static POSITIONS: StaticCell<[OutputLimits; 1]> = StaticCell::new();
        Some(Limits {
            inputs: INPUTS.init([TORQUES.init([self.limits])]),
            outputs: POSITIONS.init([three_phase::position_limits(checked.get())]),
        })
    }

    fn check_motor(layout: u16, words: &[u32]) -> Result<(), MotorFallback> {
        three_phase::decode_configuration(layout, words, Selected::image().get(), Selected::reads).map(|_| ())
    }

    fn identify(current_a: f32) {
        current_loop::exchange().identification.request(current_a);
    }

    fn identification() -> Identification {
        current_loop::exchange().identification.state()
    }

    fn read(&mut self, measured: &mut [Word]) {
        let last = self.told.periods;
        match current_loop::exchange().state() {
            Some(told) if told.periods != last => {
                self.told = told;
                self.fault = told.fault;
                self.shaft.update(told.angle);
            }
            // No data in a whole tick.
            Some(_) | None => self.fault = Some(DriveFault::Silent),
        }
        let LoopState { speed_rad_per_s, current_a, bus_v, temperature_c, .. } = self.told;
        let speed_rad_per_s = self.shaft.speed_rad_per_s(speed_rad_per_s);
        let read = [self.shaft.angle_rad(), speed_rad_per_s, current_a, bus_v, temperature_c];
        for (word, value) in measured.iter_mut().zip(read) {
            *word = value.into_word();
        }
        super::measure(measured.get_mut(read.len()..));
    }

    fn fault(&self) -> Option<DriveFault> {
        self.fault
    }

    fn write(&mut self, tick: TickResult, commanded: &[Word]) {
        let is_ready = self.told.is_ready;
        if !is_ready {
            self.ramp.begin();
        }
        if self.fault == Some(DriveFault::Silent)
            || !needs_power_stage(tick, commanded)
            || !matches!(tick, TickResult::Ran) && !is_ready
        {
            return current_loop::disarm();
        }
        let commanded_nm = commanded.first().map_or(0.0, |word| f32::from_word(*word));
        let joint_nm = if is_ready { self.ramp.step(commanded_nm, &self.limits, TICK_S) } else { 0.0 };
        current_loop::exchange().command(Some(self.shaft.rotor_torque_nm(joint_nm)));
    }
}
