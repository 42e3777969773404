//! The device always gets finite commands within range and rate limit, and a safe value when no scheme
//! commands it.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::float_cmp, reason = "these numbers are exact")]

use dimsart_core::ProvidedMemory;
use dimsart_core::{
    AxisKind, Command, CommandError, DataType, DescriptorError, DeviceDescriptor, Dimsart, DriveFault,
    DriveState, FrameError, InputLimits, LimitsError, Packet, SafeValue, SafetyReason, TickResult, Word,
    limits::MAX_LIMITED_WORDS, scheme, types,
};
use dimsart_link::EventKind;
use dimsart_modules::ALL;

const AXES: usize = 3;
/// A power of two, so that products with it are exact.
const H_S: f32 = 1.0 / 1024.0;
/// A different kind of actuator on each axis.
const LIMITS: [InputLimits; AXES] = [
    InputLimits { min: -8.0, max: 5.0, rate_per_s: 1024.0, safe_value: SafeValue::Zero },
    InputLimits { min: 1.0, max: 30.0, rate_per_s: 128.0, safe_value: SafeValue::Hold },
    InputLimits {
        min: -20.0,
        max: 20.0,
        rate_per_s: 3072.0,
        safe_value: SafeValue::Damping { coefficient: 2.0 },
    },
];
const DAMPED: &[InputLimits] = &[LIMITS[2]; AXES];
const SLOW: &[InputLimits] =
    &[InputLimits { min: -1e4, max: 1e4, rate_per_s: 51.2, safe_value: SafeValue::Zero }; AXES];
const HELD_COUNT: &[InputLimits] = &[InputLimits { safe_value: SafeValue::Hold, ..InputLimits::NONE }];

/// A spring from the measured to the desired position, through which a test sets the command. Values near the
/// maximum of `f32` become infinite.
const SPRING: &str = "
any PCTRL_MOD K_PARAM 2
any MOD_ENG MOD_ON PCTRL_MOD
any COMM_RXMOD CRX_ADD_DATA VELOCITY.2
any MOD_ENG MOD_ON COMM_RXMOD
any MOD_ENG MATCHING_CHECK";

/// Commands the peer's value.
const FOLLOWS: &str = "
any LIMIT_MOD PORT_SIGNAL_IN FAR_POSITION
any LIMIT_MOD PORT_SIGNAL_OUT DES_POSITION
any MOD_ENG MOD_ON LIMIT_MOD
any MOD_ENG MATCHING_CHECK";

/// A controller whose device measures position and desired position; its inputs are a force and a whole
/// number.
struct Arm {
    dimsart: Dimsart,
    sender: Dimsart,
    position_m: [f32; AXES],
    /// The last command.
    given: [f32; AXES],
    count: u32,
}

fn load(dimsart: &mut Dimsart, rows: &str) {
    assert_eq!(scheme::load(rows, "any", &["any"], dimsart, |error| eprintln!("{error:?}")), 0);
}

fn described(
    outputs: &'static [&'static DataType],
    inputs: &'static [&'static DataType],
) -> DeviceDescriptor {
    DeviceDescriptor::new("arm", &[AxisKind::Linear; AXES], H_S, outputs, inputs).unwrap()
}

fn device() -> DeviceDescriptor {
    let outputs = &[types::DES_POSITION, types::POSITION];
    described(outputs, &[types::LINK_AGE, types::DES_FORCE])
}

impl Arm {
    fn limited() -> Self {
        Self::of(device().with_limits(&[HELD_COUNT, &LIMITS]).unwrap())
    }

    fn of(device: DeviceDescriptor) -> Self {
        let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap();
        load(&mut dimsart, SPRING);
        let mut sender =
            Dimsart::new(ProvidedMemory::leak_default(), described(&[types::VELOCITY], &[]), ALL).unwrap();
        load(
            &mut sender,
            "any COMM_TXMOD CTX_ADD_DATA VELOCITY\nany MOD_ENG MOD_ON COMM_TXMOD\nany MOD_ENG MATCHING_CHECK",
        );
        Self { dimsart, sender, position_m: [0.0; AXES], given: [0.0; AXES], count: 0 }
    }

    fn packet(&mut self) -> Packet {
        self.sender.tick(&[Word(0); AXES], &mut []);
        self.sender.take_outgoing(0).unwrap()
    }

    /// Runs a tick in which the scheme commands twice this value.
    fn tick(&mut self, half_n: [f32; AXES]) -> TickResult {
        let packet = self.packet();
        self.dimsart.receive_parsed(0, &Ok(packet)).unwrap();
        self.tick_in_silence(half_n)
    }

    fn tick_in_silence(&mut self, half_n: [f32; AXES]) -> TickResult {
        let mut measured = [Word(0); 2 * AXES];
        for axis in 0..AXES {
            measured[axis] = (half_n[axis] + self.position_m[axis]).into();
            measured[AXES + axis] = self.position_m[axis].into();
        }
        // The content of the caller's buffer must not matter.
        let mut commanded = [Word(0x7FC0_0000); 1 + AXES];
        let tick = self.dimsart.tick(&measured, &mut commanded);
        self.count = commanded[0].0;
        self.given = [1, 2, 3].map(|place| f32::from_bits(commanded[place].0));
        tick
    }

    /// Called when the safe value is reached.
    fn reset(&mut self) {
        while self.dimsart.safety().state() == DriveState::FaultReactionActive {
            self.tick_in_silence([0.0; AXES]);
        }
        load(&mut self.dimsart, "any MOD_ENG RESET");
    }

    fn reason(&self) -> SafetyReason {
        self.dimsart.safety().reason()
    }

    fn ticks_of(&self, reason: SafetyReason) -> u32 {
        self.dimsart.safety().counts().tick_count(reason)
    }
}

/// splitmix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.next().is_multiple_of(count)
    }

    /// From -1 to 1.
    fn share(&mut self) -> f32 {
        ((self.next() >> 40) as f32 / (1u64 << 23) as f32) - 1.0
    }

    fn force_n(&mut self) -> f32 {
        match self.next() % 2000 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::MAX,
            3 => f32::MIN,
            4..1000 => 10.0 * self.share(),
            _ => 100.0 * self.share(),
        }
    }
}

/// Model of the safety stage: computes the expected command from the last one.
struct Model {
    given: [f32; AXES],
    count: u32,
    /// Measurements of the last tick, if any.
    position_m: Option<[f32; AXES]>,
    /// The latched fault.
    failed: Option<TickResult>,
    /// Whether the scheme commanded the device in the last tick.
    was_enabled: bool,
}

impl Model {
    fn new() -> Self {
        let given = LIMITS.map(|limits| 0.0_f32.max(limits.min));
        Self { given, count: 0, position_m: None, failed: None, was_enabled: false }
    }

    /// Value of an axis while no scheme commands it, before limits.
    fn safe_value(&self, axis: usize, now_m: Option<[f32; AXES]>) -> f64 {
        match LIMITS[axis].safe_value {
            SafeValue::Zero => 0.0,
            SafeValue::Hold => self.given[axis].into(),
            SafeValue::Damping { coefficient } => {
                let moved = now_m.zip(self.position_m).map_or(0.0, |(now, last)| now[axis] - last[axis]);
                -f64::from(coefficient) * f64::from(moved) / f64::from(H_S)
            }
        }
    }

    /// Checks a tick in which the scheme would have commanded `force_n`.
    fn check(
        &mut self,
        arm: &Arm,
        tick: TickResult,
        is_allowed: bool,
        is_measured: bool,
        force_n: [f32; AXES],
    ) {
        let commands = is_allowed && arm.dimsart.engine().is_running();
        let refused = matches!(tick, TickResult::MeasurementRefused(_));
        assert_eq!(self.failed.unwrap_or(tick), tick, "until a reset");
        let fails = match tick {
            TickResult::CommandsLate => commands && self.was_enabled,
            TickResult::LinkDown { .. } => false,
            _ => tick.reason().is_fault() && (commands || !refused),
        };
        if self.failed.is_none() && fails {
            self.failed = Some(tick);
        }
        let state = arm.dimsart.safety().state();
        assert_eq!(state.is_fault(), self.failed.is_some(), "{state:?}");
        assert_eq!(state == DriveState::OperationEnabled, tick == TickResult::Ran, "{state:?}");
        let now_m = is_measured.then_some(arm.position_m);
        let (mut is_outside, mut is_too_fast) = (false, false);
        for (axis, limits) in LIMITS.iter().enumerate() {
            let (given, last) = (arm.given[axis], self.given[axis]);
            let (min, max) = (limits.min, limits.max);
            let wanted =
                if tick == TickResult::Ran { force_n[axis].into() } else { self.safe_value(axis, now_m) };
            let inside = wanted.clamp(min.into(), max.into());
            let step = f64::from(limits.rate_per_s * H_S);
            let reached = inside.clamp(f64::from(last) - step, f64::from(last) + step);
            // Rounding of f32: last value plus step, and velocity.
            let rounding = f64::from(f32::EPSILON) * (f64::from(last).abs() + reached.abs());
            let found = format!("{tick:?}, axis {axis}: {given} after {last}, wanted {wanted}");
            assert!(given.is_finite() && min <= given && given <= max, "{found}");
            assert!((f64::from(given) - f64::from(last)).abs() <= step + rounding, "{found}");
            assert!((f64::from(given) - reached).abs() <= rounding, "{found}, not {reached}");
            is_outside |= !(min..=max).contains(&force_n[axis]);
            is_too_fast |= force_n[axis].max(min).min(max).to_bits() != given.to_bits();
        }
        let reason = match tick {
            TickResult::Ran if is_outside => SafetyReason::RangeLimited,
            TickResult::Ran if is_too_fast => SafetyReason::RateLimited,
            _ => tick.reason(),
        };
        assert_eq!(arm.reason(), reason);
        assert!(tick == TickResult::Ran || arm.count == self.count, "{tick:?}: not held");
        let is_there = (0..AXES).all(|axis| {
            f64::from(arm.given[axis])
                == self.safe_value(axis, now_m).clamp(LIMITS[axis].min.into(), LIMITS[axis].max.into())
        });
        if is_there && tick != TickResult::Ran {
            assert!(
                !matches!(state, DriveState::QuickStopActive | DriveState::FaultReactionActive),
                "{state:?}"
            );
        }
        let was_enabled = tick == TickResult::Ran;
        *self = Self { given: arm.given, count: arm.count, position_m: now_m, was_enabled, ..*self };
    }
}

#[test]
fn every_tick_keeps_range_rate_and_safe_value_whatever_comes() {
    let mut met = [0; SafetyReason::ALL.len()];
    for seed in 0..60 {
        let (mut random, mut arm, mut model) = (Random(seed), Arm::limited(), Model::new());
        let (mut is_allowed, mut is_silent, mut is_late) = (true, false, false);
        for _ in 0..600 {
            is_allowed ^= random.one_in(40);
            is_silent ^= random.one_in(80);
            is_late ^= random.one_in(if is_late { 10 } else { 80 });
            if random.one_in(40) {
                let is_stop = random.one_in(3);
                load(
                    &mut arm.dimsart,
                    if is_stop { "any MOD_ENG STOP" } else { "any MOD_ENG MATCHING_CHECK" },
                );
            }
            if random.one_in(20) {
                let is_on_its_way = arm.dimsart.safety().state() == DriveState::FaultReactionActive;
                let refused = is_on_its_way.then_some(CommandError::StillStopping);
                assert_eq!(arm.dimsart.command(Command::Reset).err(), refused);
                model.failed = model.failed.filter(|_| is_on_its_way);
            }
            if !random.one_in(4) {
                arm.position_m = arm.position_m.map(|position| position + 0.01 * random.share());
            }
            let half_n = [(); AXES].map(|()| random.force_n());
            arm.dimsart.set_motion_allowed(is_allowed);
            arm.dimsart.set_commands_stale(is_late);
            let tick = if is_silent { arm.tick_in_silence(half_n) } else { arm.tick(half_n) };
            let position_m = arm.position_m;
            let force_n = [0, 1, 2].map(|axis| 2.0 * ((half_n[axis] + position_m[axis]) - position_m[axis]));
            let is_measured = (0..AXES).all(|axis| (half_n[axis] + position_m[axis]).is_finite());
            model.check(&arm, tick, is_allowed, is_measured, force_n);
        }
        for (met, (_, ticks)) in met.iter_mut().zip(arm.dimsart.safety().counts().iter()) {
            *met += ticks;
        }
    }
    let mut often = SafetyReason::ALL.iter().zip(met);
    // A command frame of wrong length cannot occur here; the arm has no drive, so drive faults cannot occur
    // either.
    let is_none = |reason: SafetyReason| {
        matches!(reason, SafetyReason::CommandRefused | SafetyReason::DriveGone)
            || DriveFault::ALL.iter().any(|fault| fault.reason() == reason)
    };
    let is_met = often.all(|(reason, ticks)| ticks > 100 || is_none(*reason));
    assert!(is_met, "every reason occurs often: {met:?}");
}

#[test]
fn the_safe_value_is_reached_and_left_at_the_rate() {
    let mut arm = Arm::limited();
    (0..400).for_each(|_| assert_eq!(arm.tick([2.5, 10.0, 5.0]), TickResult::Ran));
    assert_eq!(arm.given, [5.0, 20.0, 10.0]);
    arm.dimsart.set_motion_allowed(false);
    for tick in 1_u8..=10 {
        assert_eq!(arm.tick([2.5, 10.0, 5.0]), TickResult::Disarmed);
        let left = f32::from(5_u8.saturating_sub(tick));
        assert_eq!(arm.given, [left, 20.0, f32::max(10.0 - 3.0 * f32::from(tick), 0.0)]);
    }
    arm.dimsart.set_motion_allowed(true);
    assert_eq!(arm.tick([2.5, 10.0, 5.0]), TickResult::Ran);
    assert_eq!(arm.given, [1.0, 20.0, 3.0]);
}

#[test]
fn arming_forgets_what_an_integrator_has_wound_up_and_keeps_to_the_rate() {
    let run = |limits: &'static [&'static [InputLimits]]| {
        let device = described(&[types::DES_POSITION, types::POSITION], &[types::DES_FORCE]);
        let mut dimsart =
            Dimsart::new(ProvidedMemory::leak_default(), device.with_limits(limits).unwrap(), ALL).unwrap();
        let rows = "
any PIDCTRL_MOD I_PARAM 1000
any MOD_ENG MOD_ON PIDCTRL_MOD
any MOD_ENG MATCHING_CHECK";
        load(&mut dimsart, rows);
        let mut measured = [Word(0); 2 * AXES];
        measured[0] = 1.0_f32.into();
        let mut tick = |is_allowed| {
            let mut commanded = [Word(0); AXES];
            dimsart.set_motion_allowed(is_allowed);
            dimsart.tick(&measured, &mut commanded);
            f32::from_bits(commanded[0].0)
        };
        assert!((0..850).all(|_| tick(false) == 0.0));
        [tick(true), tick(true)]
    };
    let [first, _] = run(&[&[]]);
    assert_eq!(first, 1000.0 * H_S, "the change of one tick");
    let limited = run(&[SLOW]);
    assert_eq!(limited, [0.05, 0.1]);
}

/// At the minimum accepted rate, the command can leave every value of the range.
#[test]
fn a_rate_that_is_accepted_changes_the_command_anywhere_in_its_range() {
    for [min, max] in [[-1000.0_f32, 10.0], [-3.0, 1024.0], [0.0, 1e-3], [-1e8, 0.0]] {
        let at = min.abs().max(max.abs());
        let rate_per_s = (at - at.next_down()) / H_S;
        let limits: &'static [InputLimits] =
            Box::leak(Box::new([InputLimits { min, max, rate_per_s, safe_value: SafeValue::Hold }]));
        for [stands, wanted] in [[min, max], [max, min], [0.5 * (min + max), min], [0.5 * (min + max), max]] {
            let device = described(&[types::FAR_POSITION, types::POSITION], &[types::DES_POSITION]);
            let device = device.with_limits(Box::leak(Box::new([limits]))).unwrap();
            let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap();
            load(&mut dimsart, FOLLOWS);
            let measured = [[Word::from(wanted); AXES], [Word::from(stands); AXES]].concat();
            let mut commanded = [Word(0); AXES];
            assert_eq!(dimsart.tick(&measured, &mut commanded), TickResult::Ran);
            let given = f32::from_bits(commanded[0].0);
            assert!((given - stands) * (wanted - stands) > 0.0, "{min} to {max}: {given} from {stands}");
        }
    }
}

#[test]
fn a_position_that_is_held_begins_where_the_device_stands() {
    const HELD: &[InputLimits] =
        &[InputLimits { min: -2.0, max: 2.0, rate_per_s: 1.0, safe_value: SafeValue::Hold }];
    let tick = |dimsart: &mut Dimsart, stands: f32| {
        let mut measured = [Word(0); 2 * AXES];
        measured[AXES] = stands.into();
        let mut commanded = [Word(0); AXES];
        let tick = dimsart.tick(&measured, &mut commanded);
        (tick, f32::from_bits(commanded[0].0))
    };
    let device = || described(&[types::FAR_POSITION, types::POSITION], &[types::DES_POSITION]);
    let new = |limits| {
        Dimsart::new(ProvidedMemory::leak_default(), device().with_limits(limits).unwrap(), ALL).unwrap()
    };
    let mut dimsart = new(&[HELD]);
    // Without commands the device may be moved by hand.
    assert_eq!(tick(&mut dimsart, f32::NAN).1, 0.0, "no measurement yet");
    assert_eq!(tick(&mut dimsart, 1.5), (TickResult::Idle, 1.5));
    assert_eq!(tick(&mut dimsart, -1.25), (TickResult::Idle, -1.25));
    assert_eq!(tick(&mut dimsart, 7.0), (TickResult::Idle, 2.0), "the nearest value of the range");
    tick(&mut dimsart, 1.0);
    // A scheme that commands 0 starts from there.
    load(&mut dimsart, FOLLOWS);
    assert_eq!(tick(&mut dimsart, 1.0), (TickResult::Ran, 1.0 - H_S));
    dimsart.set_motion_allowed(false);
    assert_eq!(tick(&mut dimsart, 1.75), (TickResult::Disarmed, 1.0 - H_S), "its last value");
    // A scheme that commands from the first tick on.
    let mut dimsart = new(&[HELD]);
    load(&mut dimsart, FOLLOWS);
    assert_eq!(tick(&mut dimsart, 1.0), (TickResult::Ran, 1.0 - H_S));
}

#[test]
fn damping_takes_the_measured_velocity_where_there_is_one() {
    let device = described(&[types::POSITION, types::VELOCITY], &[types::DES_FORCE]);
    let mut dimsart =
        Dimsart::new(ProvidedMemory::leak_default(), device.with_limits(&[DAMPED]).unwrap(), ALL).unwrap();
    let mut tick = |velocity: f32| {
        let mut measured = [Word(0); 2 * AXES];
        measured[AXES + 1] = velocity.into();
        let mut commanded = [Word(0); AXES];
        dimsart.tick(&measured, &mut commanded);
        commanded.map(|word| f32::from_bits(word.0))
    };
    assert_eq!(tick(1.0), [0.0, -2.0, 0.0]);
    assert_eq!(tick(1.5), [0.0, -3.0, 0.0]);
    assert_eq!(tick(f32::NAN), [0.0; AXES], "a velocity that is not known damps nothing");
    assert_eq!([tick(-1e9), tick(-1e9)].map(|given| given[1]), [3.0, 6.0], "and no faster than the rate");
}

#[test]
fn limits_that_limit_nothing_change_no_bit() {
    let (mut random, mut plain) = (Random(1), Arm::of(device()));
    let none: &[&[InputLimits]] = &[&[InputLimits::NONE], &[InputLimits::NONE; AXES]];
    let mut limited = Arm::of(device().with_limits(none).unwrap());
    for _ in 0..5000 {
        let is_allowed = !random.one_in(4);
        let half_n = [(); AXES].map(|()| random.force_n());
        let ticks = [&mut plain, &mut limited].map(|arm| {
            arm.dimsart.set_motion_allowed(is_allowed);
            let tick = arm.tick(half_n);
            (format!("{tick:?}"), arm.count, arm.given.map(f32::to_bits), arm.reason())
        });
        assert_eq!(ticks[0], ticks[1]);
    }
}

#[test]
fn every_reason_can_be_met_and_is_counted() {
    let mut arm = Arm::limited();
    let mut met = Vec::new();
    let mut meet = |arm: &Arm, tick: TickResult, reason| {
        assert_eq!((arm.reason(), arm.ticks_of(reason)), (reason, 1), "{tick:?}");
        met.push(reason);
    };
    (0..20).for_each(|_| _ = arm.tick([0.0, 0.5, 0.0]));
    assert_eq!((arm.reason(), arm.ticks_of(SafetyReason::RateLimited)), (SafetyReason::None, 0));
    let tick = arm.tick([0.0, 1.0, 0.0]);
    meet(&arm, tick, SafetyReason::RateLimited);
    let tick = arm.tick([0.0, 0.4, 0.0]);
    meet(&arm, tick, SafetyReason::RangeLimited);
    arm.dimsart.set_motion_allowed(false);
    let tick = arm.tick([0.0; AXES]);
    meet(&arm, tick, SafetyReason::Disarmed);
    arm.dimsart.set_motion_allowed(true);
    let tick = arm.tick([f32::NAN; AXES]);
    assert!(matches!(tick, TickResult::MeasurementRefused(FrameError::NotFinite { .. })));
    meet(&arm, tick, SafetyReason::MeasurementRefused);
    arm.reset();
    let tick = arm.dimsart.tick(&[Word(0); 2 * AXES], &mut []);
    meet(&arm, tick, SafetyReason::CommandRefused);
    assert_eq!(arm.dimsart.refused_ticks(), 2);
    arm.reset();
    let tick = arm.tick([f32::MAX; AXES]);
    meet(&arm, tick, SafetyReason::ModuleFailed);
    arm.reset();
    arm.tick([0.0, 0.5, 0.0]);
    arm.dimsart.set_commands_stale(true);
    let tick = arm.tick([0.0, 0.5, 0.0]);
    meet(&arm, tick, SafetyReason::CommandsLate);
    arm.dimsart.set_commands_stale(false);
    // On a bus of drives, the fault names the axis.
    let gone = DriveFault::NoResponse { axis: 1 };
    for fault in DriveFault::ALL.iter().copied().chain([gone]) {
        arm.reset();
        arm.tick([0.0, 0.5, 0.0]);
        arm.dimsart.set_drive_fault(Some(fault));
        let tick = arm.tick([0.0, 0.5, 0.0]);
        meet(&arm, tick, fault.reason());
        assert_eq!(tick, TickResult::DriveFailed(fault));
        assert_eq!(DriveFault::from_number(fault.reason().number()), (fault != gone).then_some(fault));
        arm.dimsart.set_drive_fault(None);
        assert_eq!(arm.tick([0.0, 0.5, 0.0]), tick, "until a reset");
        // An implausible measurement or a module fault in the same tick is a consequence.
        for measured in [[f32::NAN; AXES], [f32::MAX; AXES]] {
            arm.reset();
            arm.tick([0.0, 0.5, 0.0]);
            arm.dimsart.set_drive_fault(Some(fault));
            assert_eq!(arm.tick(measured), TickResult::DriveFailed(fault));
            arm.dimsart.set_drive_fault(None);
            assert_eq!(arm.tick([0.0, 0.5, 0.0]), TickResult::DriveFailed(fault), "until a reset");
        }
    }
    arm.reset();
    arm.tick([0.0, 0.5, 0.0]);
    let tick = core::iter::repeat_with(|| arm.tick_in_silence([0.0, 0.5, 0.0]))
        .take(100)
        .find(|tick| *tick == TickResult::LinkLost { link: 0 });
    meet(&arm, tick.unwrap(), SafetyReason::LinkLost);
    arm.reset();
    let tick = core::iter::repeat_with(|| arm.tick_in_silence([0.0, 0.5, 0.0]))
        .take(100)
        .find(|tick| *tick == TickResult::LinkDown { link: 0 });
    meet(&arm, tick.unwrap(), SafetyReason::LinkDown);
    arm.reset();
    load(&mut arm.dimsart, "any MOD_ENG STOP");
    let tick = arm.tick([0.0; AXES]);
    meet(&arm, tick, SafetyReason::Stopped);
    met.sort_by_key(|reason| reason.number());
    assert_eq!(met, SafetyReason::ALL);
}

/// Released numbers and names: add a row for a new one, never change one.
const NUMBERS: [(u8, &str); 26] = [
    (0, "none"),
    (8, "stopped"),
    (16, "disarmed"),
    (32, "measurement refused"),
    (36, "command refused"),
    (40, "module failed"),
    (44, "commands late"),
    (46, "link down"),
    (48, "link lost"),
    (56, "overcurrent"),
    (57, "current sensors"),
    (58, "undervoltage"),
    (59, "overvoltage"),
    (60, "overtemperature"),
    (61, "encoder lost"),
    (62, "encoder jumped"),
    (63, "encoder magnet"),
    (64, "stalled"),
    (65, "overspeed"),
    (66, "rotor not aligned"),
    (67, "drive silent"),
    (68, "drive gone"),
    (69, "encoder slipped"),
    (70, "current loop"),
    (96, "range limited"),
    (100, "rate limited"),
];

/// Rows of the page's tables.
fn row(number: u8, cells: [&str; 3]) -> String {
    format!("\n| {number} | {} |\n", cells.join(" | ").trim_end())
}

#[test]
fn numbers_and_names_stay_and_the_page_of_faults_has_them_all_in_the_same_words() {
    let page = include_str!("../../docs/faults.md");
    let all = core::iter::once(&SafetyReason::None).chain(SafetyReason::ALL);
    assert_eq!(all.map(|reason| (reason.number(), reason.name())).collect::<Vec<_>>(), NUMBERS);
    for number in 0..=u8::MAX {
        let found = SafetyReason::from_number(number);
        let name = NUMBERS.iter().find(|(known, _)| *known == number).map(|(_, name)| *name);
        assert_eq!(found.map(|reason| (reason.number(), reason.name())), name.map(|name| (number, name)));
        let Some(reason) = found else { continue };
        assert_eq!(reason.is_fault(), (32..96).contains(&number));
        assert_eq!(reason.is_limit(), number >= 96);
        let row = row(number, [reason.name(), reason.meaning(), reason.remedy()]);
        assert!(page.contains(&row), "docs/faults.md lacks: {row}");
    }
    for kind in EventKind::ALL {
        let row = row(*kind as u8, [kind.name(), kind.meaning(), kind.remedy()]);
        assert!(page.contains(&row), "docs/faults.md lacks: {row}");
    }
}

#[test]
fn a_new_device_begins_anew_but_motion_stays_forbidden() {
    let mut arm = Arm::limited();
    arm.dimsart.set_motion_allowed(false);
    arm.tick([1.0; AXES]);
    arm.dimsart.connect(device(), ALL).unwrap();
    assert_eq!((arm.reason(), arm.ticks_of(SafetyReason::Disarmed)), (SafetyReason::None, 0));
    load(&mut arm.dimsart, SPRING);
    assert_eq!(arm.tick([1.0; AXES]), TickResult::Disarmed);
}

#[test]
fn limits_that_cannot_be_kept_are_refused_with_the_word_and_why() {
    let declare = |limits: &[&[InputLimits]]| {
        let limits: Vec<&'static [InputLimits]> =
            limits.iter().map(|limits| &*Box::leak(limits.to_vec().into_boxed_slice())).collect();
        device().with_limits(Box::leak(limits.into_boxed_slice())).err()
    };
    let fault = |limits: InputLimits| match declare(&[&[], &[LIMITS[0], limits, LIMITS[0]]]) {
        Some(DescriptorError::Limits { word: 2, fault }) => Some(fault),
        None => None,
        other => unreachable!("{other:?}"),
    };
    let none = InputLimits::NONE;
    assert_eq!(fault(none), None);
    for (min, max) in [(1.0, 2.0), (-2.0, -1.0), (2.0, 1.0), (f32::NAN, 1.0), (-1.0, f32::INFINITY)] {
        assert_eq!(fault(InputLimits { min, max, ..none }), Some(LimitsError::Range), "{min} to {max}");
    }
    assert_eq!(fault(InputLimits { min: 1.0, max: 2.0, safe_value: SafeValue::Hold, ..none }), None);
    for rate_per_s in [0.0, -1.0, f32::NAN] {
        assert_eq!(fault(InputLimits { rate_per_s, ..none }), Some(LimitsError::Rate), "{rate_per_s}");
    }
    // An ulp of 1000 is 2^-14.
    let range = InputLimits { min: -1000.0, max: 10.0, ..none };
    let min_per_s = 1.0 / (16_384.0 * H_S);
    assert_eq!(fault(InputLimits { rate_per_s: min_per_s, ..range }), None);
    let rate_per_s = 0.99 * min_per_s;
    let too_small = LimitsError::RateTooSmall { rate_per_s, at: 1000.0, min_per_s };
    assert_eq!(fault(InputLimits { rate_per_s, ..range }), Some(too_small));
    assert_eq!(
        too_small.to_string(),
        "rate_per_s = 0.061875 is too small: the change per tick is lost in f32 rounding at 1000; set rate_per_s to 0.0625 or \
         more, or narrow the range"
    );
    assert!(matches!(fault(InputLimits { rate_per_s: 1e9, ..none }), Some(LimitsError::RateTooSmall { .. })));
    for coefficient in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let safe_value = SafeValue::Damping { coefficient };
        assert_eq!(
            fault(InputLimits { safe_value, ..none }),
            Some(LimitsError::Coefficient),
            "{coefficient}"
        );
    }
    let on_count = |limits: InputLimits| declare(&[&[limits], &[]]);
    let format = Some(DescriptorError::Limits { word: 0, fault: LimitsError::Format });
    assert_eq!(on_count(InputLimits { max: 3.0, ..none }), format);
    assert_eq!(on_count(LIMITS[2]), format);
    assert_eq!(on_count(none), None);
    assert_eq!(declare(&[&[]]), Some(DescriptorError::LimitsCount { expected: 2, found: 1 }));
    assert_eq!(declare(&[&[], &[none; 2]]), Some(DescriptorError::LimitsCount { expected: AXES, found: 2 }));
    assert_eq!(declare(&[&[], &[none]]), None, "one for all words");

    let blind = described(&[types::FORCE], &[types::DES_FORCE]).with_limits(&[DAMPED]).err();
    assert_eq!(blind, Some(DescriptorError::Limits { word: 0, fault: LimitsError::NoVelocity }));
    const EIGHT: &[InputLimits] = &[InputLimits::NONE; 8];
    let axes = [AxisKind::Rotary; 8];
    let many = DeviceDescriptor::new(
        "arm",
        &axes,
        H_S,
        &[],
        &[types::DES_FORCE, types::DES_POSITION, types::DES_VELOCITY],
    );
    let many = many.unwrap().with_limits(&[EIGHT; 3]).err();
    assert_eq!(many, Some(DescriptorError::TooManyLimits { wanted: MAX_LIMITED_WORDS + 8 }));
}
