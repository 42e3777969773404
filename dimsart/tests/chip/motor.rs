//! The b-g431b-esc1 with its supply on and a motor at its bridge.
//!
//! ```text
//! image ──▶ timer 1 ──duty cycles, on or off──▶ BridgeMotor ──angle──▶ timer 4
//!   ▲                                               │ phase currents
//!   └── converters ◀── amplifiers ◀── resistors ◀── shunts, while a lower switch or its diode leads
//! ```
//! The motor goes on from the middle of the lower switches' time to the next one, and by the parts of it in which the bridge is
//! on or off. What the converters sample there is a period's average: the modulation's ripple is 0 in this middle.

use core::f64::consts::TAU;
use std::collections::VecDeque;

use boards::BOARDS;
use boards::catalogue::ThreePhaseDrive;
use chips::stm32g4::Wire;
use chips::{Bench, Stm32g4};
use cycles::processor::Processor;
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};

use crate::common::bench;

const CLOCK_HZ: f64 = 168e6;
pub(crate) const PERIOD_CYCLES: u64 = 8_400;
/// So long before the middle the pins get their voltages.
const AHEAD_CYCLES: u64 = 100;
const ROTOR_KG_M2: f64 = 2e-5;
/// No current turns it within a test.
const LOCKED_KG_M2: f64 = 1e6;
const ROOM_C: f64 = 25.0;

/// The board and its motor.
#[derive(Clone)]
pub(crate) struct Powered {
    pub(crate) bench: Bench,
    pub(crate) motor: BridgeMotor,
    pub(crate) drive: ThreePhaseDrive,
    parameters: ThreePhaseParameters,
    /// What the encoder has shown so far.
    counts: i64,
    pub(crate) has_encoder: bool,
    /// From phase U through the motor's side into V, as long as the bridge is on.
    pub(crate) short_circuit_a: f64,
    /// Up to which cycle the motor is.
    motor_cycle: u64,
    duties: [f64; 3],
    is_on: bool,
    /// Every time that the bridge was switched on or off.
    pub(crate) switched: Vec<(u64, bool)>,
    /// What came over the command line and was not taken.
    pub(crate) received: VecDeque<u8>,
}

impl Powered {
    /// At its power-on; none without images.
    pub(crate) fn new() -> Option<Self> {
        let drive = BOARDS.iter().find_map(|board| board.tooling.drive).unwrap();
        let parameters = ThreePhaseParameters {
            supply_v: 12.0,
            rotor_inertia_kg_m2: ROTOR_KG_M2,
            viscous_nms_per_rad: 1e-4,
            ..(&drive.configuration).into()
        };
        let mut powered = Self {
            bench: bench("b-g431b-esc1")?,
            motor: BridgeMotor::new(&parameters).unwrap(),
            drive,
            parameters,
            counts: 0,
            has_encoder: true,
            short_circuit_a: 0.0,
            motor_cycle: 0,
            duties: [0.0; 3],
            is_on: false,
            switched: Vec::new(),
            received: VecDeque::new(),
        };
        powered.set_supply(12.0);
        powered.set_bridge_temperature(ROOM_C);
        // Other ends of the shunts.
        for (port, pin) in [('A', 3), ('A', 5), ('B', 2)] {
            powered.bench.chip().set_voltage(port, pin, 0.0);
        }
        Some(powered)
    }

    pub(crate) fn chip(&mut self) -> &mut Stm32g4 {
        self.bench.chip()
    }

    /// The supply's voltage, as the board measures it.
    pub(crate) fn set_supply(&mut self, volts: f64) {
        self.chip().set_voltage('A', 0, volts * 18.0 / 187.0);
    }

    /// A thermistor of 10 kOhm, B 3425 K, above 4.7 kOhm.
    pub(crate) fn set_bridge_temperature(&mut self, celsius: f64) {
        let ohm = 10e3 * (3_425.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15)).exp();
        self.chip().set_voltage('B', 14, 3.3 * 4.7e3 / (4.7e3 + ohm));
    }

    /// Holds the rotor where it is, or lets it go.
    pub(crate) fn lock(&mut self, is_locked: bool) {
        let rotor_inertia_kg_m2 = if is_locked { LOCKED_KG_M2 } else { ROTOR_KG_M2 };
        let angle_rad = self.motor.state().angle_rad;
        self.motor =
            BridgeMotor::new(&ThreePhaseParameters { rotor_inertia_kg_m2, ..self.parameters.clone() })
                .unwrap();
        self.motor.set_rotor(angle_rad, 0.0);
    }

    pub(crate) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Currents of the phases into the motor, `A`.
    fn phase_a(&self) -> [f64; 3] {
        let [u, v, w] = self.motor.phase_a();
        let more = if self.is_on { self.short_circuit_a } else { 0.0 };
        [u + more, v - more, w]
    }

    /// Goes on for a period.
    pub(crate) fn period(&mut self) {
        let now = self.bench.processor.cycles();
        let end = match self.chip().next_middle() {
            Some(middle) if middle >= now + 2 * AHEAD_CYCLES => middle - AHEAD_CYCLES,
            Some(middle) => middle + PERIOD_CYCLES - AHEAD_CYCLES,
            None => now + PERIOD_CYCLES,
        };
        self.wire_shunts();
        self.bench.processor.run_until(end).unwrap();
        self.turn_motor();
        let bytes = self.bench.received();
        self.received.extend(bytes);
    }

    /// Goes on to the next call of the current loop and through it; gives its cycles.
    pub(crate) fn current_loop_cycles(&mut self) -> u64 {
        let processor = &mut self.bench.processor;
        let current_loop = processor.image().function("dimsart_current_loop").unwrap();
        let (begin, end) = (current_loop.address, current_loop.end());
        let stack = |processor: &Processor<Stm32g4>| processor.registers.core[13];
        while processor.address() != begin {
            processor.step(u64::MAX).unwrap();
        }
        let (begun, stack_at_begin) = (processor.cycles(), stack(processor));
        // Until it has given its stack back, and something else runs.
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
        let pins = [('A', 1), ('A', 7), ('B', 0)];
        for (channel, ((port, pin), phase_a)) in (0..).zip(pins.into_iter().zip(self.phase_a())) {
            let wire = Wire::Shunt {
                channel,
                low_v: input_v(phase_a),
                high_v: input_v(0.0),
                // The lower diode leads what flows into the motor.
                open_v: input_v(phase_a.max(0.0)),
            };
            self.chip().wire(port, pin, wire);
        }
    }

    fn turn_motor(&mut self) {
        let now = self.bench.processor.cycles();
        let pulses = self.chip().pulses();
        if let Some(pulses) = pulses {
            self.duties = pulses.duties.map(|duty| duty.unwrap_or(0.0));
        }
        for (cycle, is_on) in self.chip().take_switched() {
            self.advance_motor(cycle);
            self.is_on = is_on;
            self.switched.push((cycle, is_on));
        }
        self.advance_motor(now);
        #[expect(clippy::cast_possible_truncation, reason = "a few turns")]
        let counts =
            (self.motor.state().angle_rad / TAU * f64::from(self.drive.counts_per_turn)).floor() as i64;
        if counts != self.counts && self.has_encoder {
            let by = counts - self.counts;
            self.chip().turn(4, by);
            self.counts = counts;
        }
    }

    fn advance_motor(&mut self, cycle: u64) {
        #[expect(clippy::cast_precision_loss, reason = "a period")]
        let time_s = cycle.saturating_sub(self.motor_cycle) as f64 / CLOCK_HZ;
        self.motor_cycle = self.motor_cycle.max(cycle);
        let state = self.motor.state();
        // Without current and standing still, it stays so.
        let rests = [state.direct_a, state.quadrature_a, state.speed_rad_per_s]
            .iter()
            .all(|value| value.abs() < 1e-9);
        if time_s > 0.0 && (self.is_on || !rests) {
            self.motor.advance(self.is_on.then_some(self.duties), time_s);
        }
    }
}

/// At an amplifier's input: a shunt of 3 mOhm behind 1.5 kOhm, with 22 kOhm to 3.3 V and 2.2 kOhm to the ground. A current into
/// the motor comes up through it.
fn input_v(phase_a: f64) -> f64 {
    let conductance = 1.0 / 1.5e3 + 1.0 / 22e3 + 1.0 / 2.2e3;
    (-0.003 * phase_a / 1.5e3 + 3.3 / 22e3) / conductance
}
