//! The board's current loop, from ADC counts to duty cycles, with the simulator's motor.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "in helpers of tests as in tests; converters and encoders count"
)]

use core::f64::consts::TAU;

use boards::BOARDS;
use boards::catalogue::ThreePhaseDrive;
use boards::current_loop::{AdcCounts, CurrentLoop, LoopExchange, LoopState, MAX_COUNTS};
use dimsart_core::DriveFault;
use dimsart_link::protocol::{Identification, IdentificationFailure};
use drive::{Angle, Duties, Encoder, Rotor};
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};

const PERIODS_PER_TICK: u32 = 20;
const TICK_S: f32 = 1e-3;
/// Angle of an incremental encoder at which the d axis is aligned with phase U, `rad`.
const OFFSET_RAD: f64 = 1.3;

fn drive() -> ThreePhaseDrive {
    BOARDS.iter().find_map(|board| board.tooling.drive).unwrap()
}

/// A motor as configured on the board, with its joint.
fn motor(drive: &ThreePhaseDrive) -> ThreePhaseParameters {
    ThreePhaseParameters { supply_v: 12.0, rotor_inertia_kg_m2: 2e-5, ..(&drive.configuration).into() }
}

struct Bench {
    drive: ThreePhaseDrive,
    current_loop: CurrentLoop,
    exchange: LoopExchange,
    motor: BridgeMotor,
    duties: Option<Duties>,
    /// Zero-current counts, to be found by the loop.
    rest: [f32; 3],
    bus_v: f32,
    temperature_counts: u16,
    /// Reading of the encoder instead of an angle.
    encoder_fault: Option<Rotor>,
    /// A phase with a saturated amplifier, and its count.
    saturated: Option<(usize, u16)>,
}

impl Bench {
    fn new(change: impl FnOnce(&mut ThreePhaseDrive)) -> Self {
        let parameters = motor(&drive());
        let mut drive = drive();
        change(&mut drive);
        let checked = drive.configuration.checked().unwrap();
        Self {
            current_loop: CurrentLoop::new(&drive, &checked, TICK_S),
            drive,
            exchange: LoopExchange::new(),
            motor: BridgeMotor::new(&parameters).unwrap(),
            duties: None,
            rest: [2540.0, 2561.0, 2550.0],
            bus_v: 12.0,
            temperature_counts: 1309,
            encoder_fault: None,
            saturated: None,
        }
    }

    /// Starts with an absolute encoder after its first reading.
    fn absolute() -> Self {
        let mut bench = Self::new(|drive| {
            drive.configuration.encoder = Encoder::As5047p;
            drive.configuration.motor.encoder_offset_rad = OFFSET_RAD as f32;
        });
        bench.motor.set_rotor(2.0, 0.0);
        (0..100).for_each(|_| assert!(!bench.tick(None).is_ready || !bench.is_on()));
        bench
    }

    /// Runs one period.
    fn period(&mut self) {
        let scaling = &self.drive.scaling;
        let mut phases = [0; 3];
        for ((count, rest), phase_a) in phases.iter_mut().zip(self.rest).zip(self.motor.phase_a()) {
            let exact = rest + phase_a as f32 / scaling.a_per_count;
            *count = exact.round().clamp(0.0, f32::from(MAX_COUNTS)) as u16;
        }
        if let Some((phase, count)) = self.saturated {
            phases[phase] = count;
        }
        let bus = (self.bus_v / scaling.v_per_count).round() as u16;
        let counts = AdcCounts { phases, bus, temperature: self.temperature_counts };
        let encoder = self.drive.configuration.encoder;
        let state = self.motor.state();
        // An absolute encoder captured the angle in the previous period.
        let age_s = if encoder.is_absolute() { 0.76 * 5e-5 } else { 0.0 };
        let turns = (state.angle_rad - age_s * state.speed_rad_per_s + OFFSET_RAD) / TAU;
        let count = (turns.rem_euclid(1.0) * f64::from(encoder.counts_per_turn())) as u32;
        let shown = Rotor::Angle(Angle::from_counts(count, encoder.counts_per_turn()));
        let rotor = self.encoder_fault.unwrap_or(shown);
        let next = self.current_loop.run_period(counts, rotor, &self.exchange);
        let now = self.duties.filter(|_| next.is_some());
        self.motor.advance(now.map(|duties| duties.map(f64::from)), 5e-5);
        self.duties = next;
    }

    /// Runs a tick with a torque command and the periods until the next one.
    fn tick(&mut self, wanted_nm: Option<f32>) -> LoopState {
        self.exchange.command(wanted_nm);
        (0..PERIODS_PER_TICK).for_each(|_| self.period());
        self.told()
    }

    fn told(&self) -> LoopState {
        self.exchange.state().unwrap()
    }

    /// Runs until the loop is ready; returns the number of ticks.
    fn align(&mut self) -> u32 {
        for tick in 0..12_000 {
            if self.tick(Some(0.0)).is_ready {
                return tick;
            }
            assert_eq!(self.told().fault, None, "tick {tick}");
        }
        unreachable!("it is never ready");
    }

    fn is_on(&self) -> bool {
        self.duties.is_some()
    }
}

#[test]
fn it_finds_its_offsets_aligns_the_rotor_and_makes_the_torque() {
    let mut bench = Bench::new(|_| {});
    for _ in 0..100 {
        assert!(!bench.tick(None).is_ready && !bench.is_on(), "nothing moves before a torque is wanted");
    }
    let ticks = bench.align();
    assert!((3_000..9_000).contains(&ticks), "{ticks}");
    for wanted_nm in [0.02_f32, -0.05, 0.1] {
        let mut sum_nm = 0.0;
        bench.tick(Some(wanted_nm));
        for _ in 0..5 * PERIODS_PER_TICK {
            bench.exchange.command(Some(wanted_nm));
            bench.period();
            sum_nm += bench.motor.torque_nm();
        }
        let mean_nm = sum_nm / f64::from(5 * PERIODS_PER_TICK);
        // An ADC count is 0.03 A, which is 0.0015 N m; the offset error is half of that.
        assert!((mean_nm - f64::from(wanted_nm)).abs() < 0.003, "{wanted_nm}: {mean_nm}");
        let told = bench.told();
        assert!((told.current_a - wanted_nm / 0.05).abs() < 0.1, "{told:?}");
        assert!((told.bus_v - 12.0).abs() < 0.02 && (told.temperature_c - 25.0).abs() < 1.0, "{told:?}");
        assert!(
            (f64::from(told.speed_rad_per_s) - bench.motor.state().speed_rad_per_s).abs() < 15.0,
            "{told:?}"
        );
    }
}

#[test]
fn a_rotor_with_an_absolute_encoder_is_driven_at_once_and_along_its_magnets_while_it_turns() {
    let mut bench = Bench::absolute();
    assert!(bench.told().is_ready);
    assert!((bench.motor.state().angle_rad - 2.0).abs() < 1e-9, "nothing has turned it");
    bench.tick(Some(0.02));
    assert!(bench.is_on());
    // Low enough for the acceleration to be negligible.
    let (mut sum_rad, mut periods) = (0.0, 0.0);
    while bench.motor.state().speed_rad_per_s < 150.0 {
        bench.tick(Some(0.05));
        let state = bench.motor.state();
        if state.speed_rad_per_s > 100.0 {
            (sum_rad, periods) = (sum_rad + state.direct_a / state.quadrature_a, periods + 1.0);
        }
    }
    let askew_rad: f64 = sum_rad / periods;
    // Without compensation the angle would lag by 0.033 rad.
    assert!(askew_rad.abs() < 0.012, "{askew_rad}");
}

#[test]
fn an_absolute_encoder_that_is_lost_or_has_no_magnet_opens_the_bridge_and_is_told() {
    for (rotor, fault) in
        [(Rotor::Lost, DriveFault::EncoderLost), (Rotor::BadMagnet, DriveFault::EncoderMagnet)]
    {
        let mut bench = Bench::absolute();
        bench.tick(Some(0.02));
        bench.encoder_fault = Some(rotor);
        assert_eq!(bench.tick(Some(0.02)).fault, Some(fault));
        assert!(!bench.is_on());
        // After reconnection, it continues when no torque was commanded for a while.
        bench.encoder_fault = None;
        for _ in 0..5 {
            bench.tick(None);
        }
        assert_eq!((bench.tick(Some(0.02)).fault, bench.is_on()), (None, true));
    }
}

#[test]
fn the_delivered_torque_is_the_commanded_one_at_every_speed() {
    for (speed, wanted_nm) in [(0.0, 0.25_f32), (60.0, 0.25), (-60.0, 0.25), (150.0, 0.25), (150.0, -0.1)] {
        let mut bench = Bench::absolute();
        let turned = ThreePhaseParameters { supply_v: 24.0, rotor_inertia_kg_m2: 1e6, ..motor(&drive()) };
        (bench.motor, bench.bus_v) = (BridgeMotor::new(&turned).unwrap(), 24.0);
        bench.motor.set_rotor(2.0, speed);
        (0..10).for_each(|_| assert_eq!(bench.tick(None).fault, None));
        (0..20).for_each(|_| assert_eq!(bench.tick(Some(wanted_nm)).fault, None));
        let mut sum_nm = 0.0;
        for _ in 0..20 * PERIODS_PER_TICK {
            bench.exchange.command(Some(wanted_nm));
            bench.period();
            sum_nm += bench.motor.torque_nm();
        }
        let mean_nm = sum_nm / f64::from(20 * PERIODS_PER_TICK);
        assert!((mean_nm - f64::from(wanted_nm)).abs() < 0.003, "{speed} rad/s, {wanted_nm}: {mean_nm}");
    }
}

#[test]
fn a_saturated_shunt_is_named_and_its_current_is_finite_in_every_phase_of_the_tick() {
    for (phase, count) in (0..3).flat_map(|phase| [(phase, 0), (phase, MAX_COUNTS)]) {
        for periods in 1..=PERIODS_PER_TICK {
            let mut bench = Bench::absolute();
            let held = ThreePhaseParameters { rotor_inertia_kg_m2: 1e6, ..motor(&drive()) };
            bench.motor = BridgeMotor::new(&held).unwrap();
            bench.motor.set_rotor(2.0, 0.0);
            // 3 A.
            (0..10).for_each(|_| assert_eq!(bench.tick(Some(0.15)).fault, None));
            bench.saturated = Some((phase, count));
            (0..periods).for_each(|_| bench.period());
            let told = bench.told();
            assert_eq!(told.fault, Some(DriveFault::CurrentSensors), "{phase} {count}: {told:?}");
            assert!(told.current_a.is_finite() && !bench.is_on(), "{told:?}");
        }
    }
}

#[test]
fn a_tick_that_dies_opens_the_bridge_after_three_ticks() {
    let mut bench = Bench::new(|_| {});
    bench.align();
    bench.tick(Some(0.02));
    assert!(bench.is_on());
    for period in PERIODS_PER_TICK..5 * PERIODS_PER_TICK {
        bench.period();
        assert_eq!(bench.is_on(), period < 3 * PERIODS_PER_TICK, "{period}");
    }
}

#[test]
fn a_tick_that_wants_nothing_opens_the_bridge_in_the_next_period() {
    let mut bench = Bench::new(|_| {});
    bench.align();
    bench.tick(Some(0.02));
    bench.exchange.command(None);
    bench.period();
    assert!(!bench.is_on());
    // Alignment happens once.
    assert!(bench.tick(Some(0.02)).is_ready && bench.is_on());
}

#[test]
fn a_fault_is_told_until_nothing_is_wanted_and_its_cause_is_gone() {
    let mut bench = Bench::new(|_| {});
    bench.align();
    bench.bus_v = 6.0;
    for _ in 0..10 {
        assert_eq!(bench.tick(Some(0.02)).fault, Some(DriveFault::Undervoltage));
        assert!(!bench.is_on());
    }
    bench.bus_v = 12.0;
    for _ in 0..10 {
        assert_eq!(bench.tick(Some(0.02)).fault, Some(DriveFault::Undervoltage), "still wanted");
    }
    let cleared = (0..5).map(|_| bench.tick(None).fault).collect::<Vec<_>>();
    assert_eq!(cleared.last(), Some(&None), "{cleared:?}");
    assert_eq!((bench.tick(Some(0.02)).fault, bench.is_on()), (None, true));
}

#[test]
fn a_hot_bridge_and_a_supply_that_is_off_are_told_while_nothing_moves() {
    for (bus_v, temperature_counts, fault) in [
        (2.0, 1309, DriveFault::Undervoltage),
        (30.0, 1309, DriveFault::Overvoltage),
        (12.0, 3_600, DriveFault::Overtemperature),
        (12.0, 0, DriveFault::Overtemperature),
    ] {
        let mut bench = Bench::new(|_| {});
        (bench.bus_v, bench.temperature_counts) = (bus_v, temperature_counts);
        for _ in 0..200 {
            bench.tick(None);
        }
        for tick in 0..200 {
            assert_eq!(bench.tick(None).fault, Some(fault), "{tick}");
            assert!(!bench.is_on());
        }
    }
}

#[test]
fn a_phase_that_shows_a_current_at_rest_keeps_the_bridge_off() {
    let mut bench = Bench::new(|_| {});
    bench.rest = [2540.0, 2000.0, 2550.0];
    for _ in 0..200 {
        bench.tick(Some(0.0));
    }
    assert_eq!(bench.told().fault, Some(DriveFault::CurrentSensors));
    assert!(!bench.is_on());
    // A loose wire that is repaired.
    bench.rest = [2540.0, 2550.0, 2550.0];
    for _ in 0..200 {
        bench.tick(None);
    }
    assert_eq!(bench.told().fault, None);
}

#[test]
fn another_motor_than_the_board_is_told_of_is_not_aligned() {
    let mut bench = Bench::new(|drive| drive.configuration.motor.pole_pairs = 4);
    let fault = (0..12_000).find_map(|_| bench.tick(Some(0.0)).fault);
    assert_eq!(fault, Some(DriveFault::NotAligned));
    for _ in 0..100 {
        bench.tick(Some(0.0));
    }
    assert!(!bench.is_on() && !bench.told().is_ready);
}

#[test]
fn a_scheme_that_is_stopped_ends_the_aligning_and_the_next_one_begins_it_again() {
    let mut bench = Bench::new(|_| {});
    for _ in 0..1_000 {
        bench.tick(Some(0.0));
    }
    assert!(bench.is_on());
    bench.tick(None);
    assert!(!bench.is_on());
    assert!(bench.align() > 3_000);
}

#[test]
fn a_phase_that_is_short_circuited_opens_the_bridge_within_two_periods() {
    let mut bench = Bench::new(|_| {});
    bench.align();
    bench.tick(Some(0.02));
    // As measured by the ADC.
    bench.rest[1] = 4095.0;
    bench.period();
    bench.period();
    assert!(!bench.is_on());
    let fault = bench.told().fault.unwrap();
    assert!([DriveFault::Overcurrent, DriveFault::CurrentSensors].contains(&fault), "{fault:?}");
}

/// Runs while the requested identification is in progress; returns its result.
fn identify(bench: &mut Bench, current_a: f32) -> Identification {
    for _ in 0..100 {
        bench.tick(None);
    }
    bench.exchange.identification.request(current_a);
    for _ in 0..12_000 {
        let told = bench.tick(Some(0.0));
        assert!(!told.is_ready && told.fault.is_none(), "{told:?}");
        if bench.exchange.identification.state() != Identification::Running {
            break;
        }
    }
    bench.exchange.identification.state()
}

#[test]
fn a_motor_is_identified_whatever_the_board_was_told_of_it_and_rests_then() {
    let truth = drive().configuration.motor;
    let mut bench = Bench::new(|drive| {
        let motor = &mut drive.configuration.motor;
        (motor.pole_pairs, motor.is_encoder_reversed, motor.resistance_ohm) = (4, true, 1.5);
        motor.direct_inductance_h = 1e-3;
    });
    let Identification::Found(found) = identify(&mut bench, 2.0) else {
        panic!("{:?}", bench.exchange.identification.state())
    };
    let is_near = |found: f32, truth: f32, share: f32| (found / truth - 1.0).abs() < share;
    assert!(is_near(found.resistance_ohm, truth.resistance_ohm, 0.03), "{found:?}");
    assert!(is_near(found.direct_inductance_h, truth.direct_inductance_h, 0.05), "{found:?}");
    assert!(is_near(found.quadrature_inductance_h, truth.quadrature_inductance_h, 0.05), "{found:?}");
    assert_eq!((found.pole_pairs, found.is_encoder_reversed), (truth.pole_pairs, false));
    assert!(
        (f64::from(found.encoder_offset_rad) - OFFSET_RAD)
            .rem_euclid(TAU / 7.0)
            .min((OFFSET_RAD - f64::from(found.encoder_offset_rad)).rem_euclid(TAU / 7.0))
            < 0.01,
        "{found:?}"
    );
    for _ in 0..100 {
        assert!(!bench.tick(Some(0.1)).is_ready && !bench.is_on(), "it waits for the end of motion");
    }
}

#[test]
fn a_motor_that_was_identified_is_aligned_by_the_next_motion() {
    let mut bench = Bench::new(|_| {});
    bench.align();
    assert!(matches!(identify(&mut bench, 2.0), Identification::Found(_)));
    bench.tick(None);
    bench.align();
    bench.tick(Some(0.02));
    assert!(bench.is_on());
}

#[test]
fn a_rotor_that_is_held_is_not_identified() {
    let mut bench = Bench::new(|_| {});
    let held = ThreePhaseParameters { rotor_inertia_kg_m2: 1e6, ..motor(&drive()) };
    bench.motor = BridgeMotor::new(&held).unwrap();
    assert_eq!(identify(&mut bench, 2.0), Identification::Failed(IdentificationFailure::DidNotMove));
    assert!(!bench.is_on());
}

#[test]
fn the_end_of_motion_ends_an_identification() {
    let mut bench = Bench::new(|_| {});
    for _ in 0..100 {
        bench.tick(None);
    }
    bench.exchange.identification.request(2.0);
    for _ in 0..1_000 {
        bench.tick(Some(0.0));
    }
    assert!(bench.is_on());
    bench.tick(None);
    assert!(!bench.is_on());
    let told = bench.exchange.identification.state();
    assert_eq!(told, Identification::Failed(IdentificationFailure::Ended));
}

#[test]
fn no_more_current_is_made_than_the_limit_whatever_is_asked_for() {
    let mut bench = Bench::new(|drive| drive.configuration.limits.current_a = 3.0);
    for _ in 0..100 {
        bench.tick(None);
    }
    bench.exchange.identification.request(50.0);
    let mut max_a = 0.0_f64;
    for _ in 0..100_000 {
        bench.exchange.command(Some(0.0));
        bench.period();
        max_a = bench.motor.phase_a().into_iter().fold(max_a, |max_a, phase_a| max_a.max(phase_a.abs()));
    }
    assert!((2.5..3.75).contains(&max_a), "{max_a} A");
}
