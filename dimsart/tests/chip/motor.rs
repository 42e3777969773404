//! A powered board with a motor at its bridge.
//!
//! ```text
//! image ──▶ timer 1 ──duty cycles, on or off──▶ BridgeMotor ──angle──▶ a timer, or an encoder on SPI 3 or I²C 4
//!   ▲                                               │ phase currents
//!   └── converters ◀── amplifiers ◀── resistors ◀── shunts, while a lower switch or its diode leads
//! ```
//! The motor is simulated from one middle of the lower switches' on-time to the next, divided where the bridge switches on or
//! off. The converters sample a period's average there: the ripple of the modulation is 0 in this middle.

use core::f64::consts::TAU;
use std::collections::VecDeque;

use boards::BOARDS;
use boards::catalogue::{ThreePhaseDrive, ihm08m1};
use chips::stm32g4::VoltageSource;
use chips::{Bench, Stm32g4};
use cycles::processor::Processor;
use drive::Encoder;
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};

use crate::common::{bench, bench_of};
use crate::encoders::{As5047pModel, As5600Model, Mt6701Model};
use crate::image_drive;

const CLOCK_HZ: f64 = 168e6;
pub(crate) const PERIOD_CYCLES: u64 = 8_400;
/// Time before the middle at which the pins get their voltages.
const AHEAD_CYCLES: u64 = 100;
const ROTOR_KG_M2: f64 = 2e-5;
/// Inertia that no current moves within a test.
const LOCKED_KG_M2: f64 = 1e6;
const ROOM_C: f64 = 25.0;
/// Time from the lower switches' middle to the angle sample of an absolute encoder, `s`.
const ASKED_S: f64 = 12e-6;
/// Sample period of an AS5600: 150 us.
const SAMPLE_PERIODS: u64 = 3;
/// Maximum number of averaged samples.
const MAX_SAMPLES: usize = 16;
/// Angle of an absolute encoder with the d axis aligned to phase U, `rad`.
pub(crate) const OFFSET_RAD: f64 = 1.1;

/// Surroundings of a board's chip.
#[derive(Clone, Copy)]
struct Surroundings {
    /// Pins of the shunt signals of U, V, W.
    shunts: [(char, u32); 3],
    /// Voltage at the pins for a current into the motor, `V`.
    shunt_v: fn(f64) -> f64,
    supply: (char, u32),
    supply_share: f64,
    thermistor: (char, u32),
    /// Timer of an incremental encoder.
    timer: u32,
}

const ESC1: Surroundings = Surroundings {
    shunts: [('A', 1), ('A', 7), ('B', 0)],
    shunt_v: input_v,
    supply: ('A', 0),
    supply_share: 18.0 / 187.0,
    thermistor: ('B', 14),
    timer: 4,
};

/// X-NUCLEO-IHM08M1 on nucleo-g474re.
const SHIELD: Surroundings = Surroundings {
    shunts: [('A', 0), ('C', 1), ('C', 0)],
    shunt_v: amplified_v,
    supply: ('A', 1),
    supply_share: 9.31 / 178.31,
    thermistor: ('C', 2),
    timer: 2,
};

/// The board and its motor.
#[derive(Clone)]
pub(crate) struct Powered {
    pub(crate) bench: Bench,
    pub(crate) motor: BridgeMotor,
    pub(crate) drive: ThreePhaseDrive,
    around: Surroundings,
    parameters: ThreePhaseParameters,
    /// Encoder counts so far.
    counts: i64,
    /// Last samples of an AS5600, in turns, and periods since the last one.
    samples: VecDeque<f64>,
    sampled_periods: u64,
    pub(crate) has_encoder: bool,
    /// Error of the encoder's angle, `rad`.
    pub(crate) slip_rad: f64,
    /// A shunt with a saturated amplifier: its phase, and the sign of its current.
    pub(crate) saturated: Option<(usize, f64)>,
    /// Additional current from phase U through the motor's side into V while the bridge is on.
    pub(crate) short_circuit_a: f64,
    /// Cycle of the motor's state.
    motor_cycle: u64,
    duties: [f64; 3],
    is_on: bool,
    /// Every time that the bridge was switched on or off.
    pub(crate) switched: Vec<(u64, bool)>,
    /// Unread bytes of the command line.
    pub(crate) received: VecDeque<u8>,
}

impl Powered {
    /// Powers the b-g431b-esc1 on; `None` without images.
    pub(crate) fn new() -> Option<Self> {
        let drive = BOARDS.iter().find_map(|board| board.tooling.drive).unwrap();
        let mut powered = Self::at(bench("b-g431b-esc1")?, drive, ESC1);
        // Alternative ends of the shunts.
        for (port, pin) in [('A', 3), ('A', 5), ('B', 2)] {
            powered.bench.chip().set_voltage(port, pin, 0.0);
        }
        Some(powered)
    }

    /// Powers the nucleo-g474re with its shield on, with this encoder configured; `None` without images.
    pub(crate) fn with_shield(encoder: Encoder) -> Option<Self> {
        const NAME: &str = "nucleo-g474re-ihm08m1";
        let mut drive = ihm08m1::DRIVE;
        drive.configuration.encoder = encoder;
        if encoder.is_absolute() {
            #[expect(clippy::cast_possible_truncation, reason = "an angle")]
            let offset_rad = OFFSET_RAD as f32;
            drive.configuration.motor.encoder_offset_rad = offset_rad;
        }
        let image = image_drive::configured(NAME, &drive.configuration)?;
        let mut powered = Self::at(bench_of(NAME, image), drive, SHIELD);
        powered.plug(true);
        Some(powered)
    }

    fn at(bench: Bench, drive: ThreePhaseDrive, around: Surroundings) -> Self {
        let parameters = ThreePhaseParameters {
            supply_v: 12.0,
            rotor_inertia_kg_m2: ROTOR_KG_M2,
            viscous_nms_per_rad: 1e-4,
            ..(&drive.configuration).into()
        };
        let mut powered = Self {
            bench,
            motor: BridgeMotor::new(&parameters).unwrap(),
            drive,
            around,
            parameters,
            counts: 0,
            samples: VecDeque::new(),
            sampled_periods: 0,
            has_encoder: true,
            slip_rad: 0.0,
            saturated: None,
            short_circuit_a: 0.0,
            motor_cycle: 0,
            duties: [0.0; 3],
            is_on: false,
            switched: Vec::new(),
            received: VecDeque::new(),
        };
        powered.set_supply(12.0);
        powered.set_bridge_temperature(ROOM_C);
        powered
    }

    /// Connects or disconnects an absolute encoder.
    pub(crate) fn plug(&mut self, is_plugged: bool) {
        let device = match self.drive.configuration.encoder {
            Encoder::As5047p => Some(As5047pModel::device()),
            Encoder::Mt6701 => Some(Mt6701Model::device()),
            _ => None,
        };
        self.chip().connect_spi("SPI3", ('D', 2), device.filter(|_| is_plugged));
        let is_there = is_plugged && self.drive.configuration.encoder == Encoder::As5600;
        self.chip().connect_i2c("I2C4", is_there.then(As5600Model::device));
    }

    pub(crate) fn chip(&mut self) -> &mut Stm32g4 {
        self.bench.chip()
    }

    /// Sets the supply voltage as measured by the board.
    pub(crate) fn set_supply(&mut self, volts: f64) {
        let Surroundings { supply: (port, pin), supply_share, .. } = self.around;
        self.chip().set_voltage(port, pin, volts * supply_share);
    }

    /// A thermistor of 10 kOhm, B 3425 K, above 4.7 kOhm.
    pub(crate) fn set_bridge_temperature(&mut self, celsius: f64) {
        let ohm = 10e3 * (3_425.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15)).exp();
        let (port, pin) = self.around.thermistor;
        self.chip().set_voltage(port, pin, 3.3 * 4.7e3 / (4.7e3 + ohm));
    }

    /// Locks the rotor at its position, or releases it.
    pub(crate) fn lock(&mut self, is_locked: bool) {
        let rotor_inertia_kg_m2 = if is_locked { LOCKED_KG_M2 } else { ROTOR_KG_M2 };
        let angle_rad = self.motor.state().angle_rad;
        self.motor =
            BridgeMotor::new(&ThreePhaseParameters { rotor_inertia_kg_m2, ..self.parameters.clone() })
                .unwrap();
        self.motor.set_rotor(angle_rad, 0.0);
    }

    /// Reduces the winding resistance.
    pub(crate) fn set_resistance(&mut self, resistance_ohm: f64) {
        self.parameters.resistance_ohm = resistance_ohm;
        self.lock(false);
    }

    /// Turns the rotor at a speed, independently of its torque, with a supply of 24 V.
    pub(crate) fn turn_at(&mut self, speed_rad_per_s: f64) {
        self.parameters.supply_v = 24.0;
        self.set_supply(24.0);
        self.lock(true);
        self.motor.set_rotor(self.motor.state().angle_rad, speed_rad_per_s);
    }

    pub(crate) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Returns the phase currents into the motor, `A`.
    fn phase_a(&self) -> [f64; 3] {
        let [u, v, w] = self.motor.phase_a();
        let more = if self.is_on { self.short_circuit_a } else { 0.0 };
        let mut phase_a = [u + more, v - more, w];
        if let Some((phase, sign)) = self.saturated {
            phase_a[phase] = 1e3 * sign;
        }
        phase_a
    }

    /// Advances by a period.
    pub(crate) fn period(&mut self) {
        let now = self.bench.processor.cycles();
        let end = match self.chip().next_low_side_midpoint() {
            Some(middle) if middle >= now + 2 * AHEAD_CYCLES => middle - AHEAD_CYCLES,
            // By several periods if the processor was halted by a flash write.
            Some(middle) => {
                let late = (now + 2 * AHEAD_CYCLES - middle).div_ceil(PERIOD_CYCLES);
                middle + late * PERIOD_CYCLES - AHEAD_CYCLES
            }
            None => now + PERIOD_CYCLES,
        };
        self.wire_shunts();
        self.bench.run_until(end).unwrap();
        self.turn_motor();
        let bytes = self.bench.take_received();
        self.received.extend(bytes);
    }

    /// Runs through the next call of the current loop; returns its cycles.
    pub(crate) fn current_loop_cycles(&mut self) -> u64 {
        let processor = &mut self.bench.processor;
        let current_loop = processor.image().function("dimsart_current_loop").unwrap();
        let (begin, end) = (current_loop.address, current_loop.end());
        let stack = |processor: &Processor<Stm32g4>| processor.registers.core[13];
        while processor.address() != begin {
            processor.step(u64::MAX).unwrap();
        }
        let (begun, stack_at_begin) = (processor.cycles(), stack(processor));
        // Runs until it has returned and other code runs.
        while stack(processor) < stack_at_begin || (begin..end).contains(&processor.address()) {
            processor.step(u64::MAX).unwrap();
        }
        processor.cycles() - begun
    }

    pub(crate) fn run_for(&mut self, time_s: f64) {
        let end_s = self.time_s() + time_s;
        while self.time_s() < end_s {
            self.period();
        }
    }

    pub(crate) fn time_s(&mut self) -> f64 {
        let cycle = self.bench.processor.cycles();
        self.chip().clock().seconds_at(cycle)
    }

    fn wire_shunts(&mut self) {
        let Surroundings { shunts, shunt_v: input_v, .. } = self.around;
        for (channel, ((port, pin), phase_a)) in (0..).zip(shunts.into_iter().zip(self.phase_a())) {
            let wire = VoltageSource::Shunt {
                channel,
                low_v: input_v(phase_a),
                high_v: input_v(0.0),
                // The lower diode conducts current into the motor.
                open_v: input_v(phase_a.max(0.0)),
            };
            self.chip().connect_voltage_source(port, pin, wire);
        }
    }

    fn turn_motor(&mut self) {
        let now = self.bench.processor.cycles();
        let pulses = self.chip().pulses();
        if let Some(pulses) = pulses {
            self.duties = pulses.duties.map(|duty| duty.unwrap_or(0.0));
        }
        for (cycle, is_on) in self.chip().take_output_enable_changes() {
            self.advance_motor(cycle);
            self.is_on = is_on;
            self.switched.push((cycle, is_on));
        }
        self.advance_motor(now);
        self.show_angle();
    }

    /// Turns the encoder with the motor.
    fn show_angle(&mut self) {
        let encoder = self.drive.configuration.encoder;
        let state = self.motor.state();
        let angle_rad = state.angle_rad + self.slip_rad;
        if encoder == Encoder::As5600 {
            return self.sample_angle((angle_rad + OFFSET_RAD) / TAU);
        }
        if encoder.is_absolute() {
            // The angle at the time of the request.
            let turns = (angle_rad + state.speed_rad_per_s * ASKED_S + OFFSET_RAD) / TAU;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "14 bits")]
            let count = (turns.rem_euclid(1.0) * f64::from(encoder.counts_per_turn())) as u32;
            if let Some(device) = self.chip().spi_device("SPI3") {
                device.state[0] = count;
            }
            return;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a few turns")]
        let counts =
            (angle_rad / TAU * f64::from(self.drive.configuration.encoder.counts_per_turn())).floor() as i64;
        if counts != self.counts && self.has_encoder {
            let by = counts - self.counts;
            let timer = self.around.timer;
            self.chip().turn_encoder(timer, by);
            self.counts = counts;
        }
    }

    /// Lets an AS5600 take its next sample when due.
    fn sample_angle(&mut self, turns: f64) {
        self.sampled_periods += 1;
        if self.sampled_periods < SAMPLE_PERIODS {
            return;
        }
        self.sampled_periods = 0;
        self.samples.push_front(turns);
        self.samples.truncate(MAX_SAMPLES);
        let Some(device) = self.bench.chip().i2c_device("I2C4") else { return };
        let count = As5600Model::filtered_samples(device).min(self.samples.len());
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        let mean = self.samples.iter().take(count).sum::<f64>() / count as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "12 bits")]
        let angle = (mean.rem_euclid(1.0) * f64::from(Encoder::As5600.counts_per_turn())) as u32;
        device.state[0] = angle;
    }

    fn advance_motor(&mut self, cycle: u64) {
        #[expect(clippy::cast_precision_loss, reason = "a period")]
        let time_s = cycle.saturating_sub(self.motor_cycle) as f64 / CLOCK_HZ;
        self.motor_cycle = self.motor_cycle.max(cycle);
        let state = self.motor.state();
        // No change without current at standstill.
        let rests = [state.direct_a, state.quadrature_a, state.speed_rad_per_s]
            .iter()
            .all(|value| value.abs() < 1e-9);
        if time_s > 0.0 && (self.is_on || !rests) {
            self.motor.advance(self.is_on.then_some(self.duties), time_s);
        }
    }
}

/// Voltage at an amplifier's input: a shunt of 3 mOhm through 1.5 kOhm, with 22 kOhm to 3.3 V and 2.2 kOhm to ground. The
/// current into the motor flows up through the shunt.
fn input_v(phase_a: f64) -> f64 {
    let conductance = 1.0 / 1.5e3 + 1.0 / 22e3 + 1.0 / 2.2e3;
    (-0.003 * phase_a / 1.5e3 + 3.3 / 22e3) / conductance
}

/// Voltage after an amplifier of the shield: shunt of 10 mOhm over 680 Ohm, with 6.8 kOhm to 3.3 V, times 5.7.
fn amplified_v(phase_a: f64) -> f64 {
    5.7 * (-0.01 * phase_a * 6.8e3 + 3.3 * 680.0) / 7.48e3
}
