//! A drive and a motor, connected by the quantised converters of a board.

use core::cell::Cell;
use core::f64::consts::TAU;

use drive::{Angle, Configuration, Drive, Duties, Encoder, Inverter, Joint, Limits, Motor, Rotor, Sample};
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};

pub(crate) const PERIOD_S: f64 = 5e-5;
/// Counts per turn of the encoder.
const COUNTS: u32 = 16_384;
/// Step of the current converters, `A`: 12 bits over ±40 A; the noise is one step.
const CURRENT_STEP_A: f64 = 80.0 / 4096.0;

/// Motor of the tests: a 70 mm joint motor at 24 V.
pub(crate) fn motor() -> ThreePhaseParameters {
    ThreePhaseParameters {
        supply_v: 24.0,
        dead_time_share: 0.02,
        rotor_inertia_kg_m2: 1e6,
        ..ThreePhaseParameters::default()
    }
}

/// Returns the exact configuration of the motor.
pub(crate) fn configuration(motor: &ThreePhaseParameters) -> Configuration {
    let as_f32 = |value: f64| value as f32;
    Configuration {
        motor: Motor {
            resistance_ohm: as_f32(motor.resistance_ohm),
            direct_inductance_h: as_f32(motor.direct_inductance_h),
            quadrature_inductance_h: as_f32(motor.quadrature_inductance_h),
            flux_linkage_vs: as_f32(motor.flux_linkage_vs),
            pole_pairs: u8::try_from(motor.pole_pairs).unwrap(),
            is_encoder_reversed: false,
            encoder_offset_rad: 0.4,
        },
        limits: Limits {
            current_a: 20.0,
            trip_current_a: 30.0,
            min_bus_v: 10.0,
            max_bus_v: 30.0,
            derating_c: 80.0,
            trip_c: 100.0,
            speed_rad_per_s: 400.0,
            stall_s: f32::INFINITY,
        },
        bandwidth_rad_per_s: as_f32(TAU * 1000.0),
        aligning_current_a: 5.0,
        encoder: Encoder::Incremental { counts_per_turn: 4096 },
        joint: Joint { gear_ratio: 1.0, zero_rad: 0.0 },
        inverter: Inverter {
            period_s: as_f32(PERIOD_S),
            dead_time_share: as_f32(motor.dead_time_share),
            dead_time_current_a: as_f32(motor.dead_time_current_a),
            max_duty: 0.95,
        },
    }
}

pub(crate) struct Bench {
    pub(crate) drive: Drive,
    pub(crate) motor: BridgeMotor,
    pub(crate) configuration: Configuration,
    pub(crate) bus_v: f64,
    /// Duty cycles computed in the last period and applied in this one.
    duties: Option<Duties>,
    has_steps: bool,
    noise: Cell<u32>,
}

impl Bench {
    pub(crate) fn new(motor: &ThreePhaseParameters, configuration: Configuration) -> Self {
        Self {
            drive: Drive::new(&configuration).unwrap(),
            motor: BridgeMotor::new(motor).unwrap(),
            configuration,
            bus_v: motor.supply_v,
            duties: None,
            has_steps: true,
            noise: Cell::new(1),
        }
    }

    /// Uses converters without quantisation and noise, for comparison with formulas.
    pub(crate) fn exact(self) -> Self {
        Self { has_steps: false, ..self }
    }

    pub(crate) fn sample(&self) -> Sample {
        self.sample_shown(0.0)
    }

    /// Sets an encoder error of `slip_rad`.
    pub(crate) fn sample_shown(&self, slip_rad: f64) -> Sample {
        let state = self.motor.state();
        let Motor { encoder_offset_rad, is_encoder_reversed, .. } = self.configuration.motor;
        let shown_rad = state.angle_rad + slip_rad + f64::from(encoder_offset_rad);
        let turns = if is_encoder_reversed { -shown_rad } else { shown_rad } / TAU;
        let counts = if self.has_steps { COUNTS } else { 1 << 30 };
        #[expect(clippy::cast_sign_loss, reason = "a turn has fewer counts")]
        let count = (turns.rem_euclid(1.0) * f64::from(counts)) as u32;
        let step_a = if self.has_steps { CURRENT_STEP_A } else { 1e-9 };
        let converted = |phase_a: f64| ((phase_a / step_a + self.noise()).round() * step_a) as f32;
        Sample {
            phase_a: self.motor.phase_a().map(converted),
            bus_v: self.bus_v as f32,
            temperature_c: 25.0,
            rotor: Rotor::Angle(Angle::from_counts(count, counts)),
        }
    }

    /// Returns the noise of a converter, within ±1 step.
    fn noise(&self) -> f64 {
        // Marsaglia's xorshift.
        let mut noise = self.noise.get();
        noise ^= noise << 13;
        noise ^= noise >> 17;
        noise ^= noise << 5;
        self.noise.set(noise);
        f64::from(noise) / f64::from(u32::MAX) * 2.0 - 1.0
    }

    /// Runs one period; returns the torque at its beginning, `N m`.
    pub(crate) fn step(&mut self, torque_nm: Option<f32>) -> f64 {
        let sample = self.sample();
        self.step_with(&sample, torque_nm)
    }

    pub(crate) fn step_with(&mut self, sample: &Sample, torque_nm: Option<f32>) -> f64 {
        let made_nm = self.motor.torque_nm();
        let next = self.drive.step(sample, torque_nm);
        // Turning the bridge off takes effect at once.
        let now = self.duties.filter(|_| next.is_some());
        self.motor.advance(now.map(|duties| duties.map(f64::from)), PERIOD_S);
        self.duties = next;
        made_nm
    }

    pub(crate) fn run(&mut self, torque_nm: Option<f32>, periods: u32) {
        for _ in 0..periods {
            self.step(torque_nm);
        }
    }

    /// Returns the mean torque over `periods`, after as many to settle.
    pub(crate) fn mean_torque_nm(&mut self, torque_nm: f32, periods: u32) -> f64 {
        self.run(Some(torque_nm), periods);
        (0..periods).map(|_| self.step(Some(torque_nm))).sum::<f64>() / f64::from(periods)
    }
}
