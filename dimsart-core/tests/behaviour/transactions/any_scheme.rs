//! Random transactions of the library's modules on the shipped scheme and on arms: the device always gets
//! finite forces within its range and rate limit, and a refusal changes nothing.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "numbers of a test, small by construction"
)]

use crate::common::IDS;
use dimsart_core::{
    AxisKind, Command, DeviceDescriptor, Dimsart, EVERY_TICKS, InputLimits, ModuleRef, Packet, ParameterType,
    ProvidedMemory, SafeValue, TickResult, TypeRef, Value, Word, scheme, types,
};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Bench, H, Types};

const SHIPPED: &str = include_str!("../../../../schemes/bilateral.scheme");
const LIMITS: &[InputLimits] =
    &[InputLimits { min: -40.0, max: 40.0, rate_per_s: 5_000.0, safe_value: SafeValue::Zero }];
/// A step of 5 N per tick, rounded.
const STEP_N: f32 = 5_000.0 * H * 1.000_01;

fn below(random: &mut Pcg32, bound: u32) -> u32 {
    random.next_u32() % bound
}

fn any_real(random: &mut Pcg32, min: f32, max: f32) -> f32 {
    match below(random, 20) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => min,
        3 => max,
        4 => max * 2.0 + 1.0,
        5..12 => min + (max - min) * 1e-4 * below(random, 100) as f32,
        _ => min + (max - min) * (below(random, 1 << 20) as f32 / (1 << 20) as f32),
    }
}

fn any_signal(random: &mut Pcg32) -> TypeRef {
    let known = &types::ALL[below(random, types::ALL.len() as u32) as usize];
    let often = [types::POSITION, types::DES_FORCE, types::DES_POSITION, known];
    let data_type = often[below(random, 4) as usize];
    TypeRef { id: data_type.id, number: [1, 1, 1, 2, 3][below(random, 5) as usize] }
}

fn any_value(random: &mut Pcg32, accepts: ParameterType) -> Value {
    match accepts {
        ParameterType::Real { min, max } => Value::Real(any_real(random, min, max)),
        ParameterType::Count { max, .. } => Value::Count(below(random, max.min(200) + 2)),
        ParameterType::Integer { .. } => Value::Integer(below(random, 100) as i32 - 50),
        ParameterType::Flag => Value::Flag(below(random, 2) == 0),
        ParameterType::Choice(names) => Value::Choice(below(random, names.len() as u32 + 1) as u8),
        ParameterType::Types => Value::Type(any_signal(random)),
    }
}

fn any_command(random: &mut Pcg32) -> Command {
    let kind = IDS[below(random, ALL.list().len() as u32) as usize];
    let module = ModuleRef { kind, number: 1 + below(random, 2) as u8 };
    match below(random, 60) {
        0..9 => Command::PlugIn(module),
        9..14 => Command::Unplug(module),
        14..16 => Command::CloseModule(module),
        16..19 => Command::PlaceBefore(module),
        19 => Command::InitModule(module),
        20..37 => {
            let parameter = if below(random, 12) == 0 { EVERY_TICKS } else { below(random, 7) as u8 };
            let accepts = ALL.describe_parameter(kind, parameter).map(|found| found.accepts);
            let value = any_value(random, accepts.unwrap_or(ParameterType::Flag));
            let entry = [None, None, Some(0), Some(5)][below(random, 4) as usize];
            Command::Set { module, parameter, entry, value }
        }
        37..46 => Command::bind(module, below(random, 5) as u8, any_signal(random)),
        46..48 => Command::Check,
        48 => Command::ResetModule(module),
        49 => match below(random, 30) {
            0 => Command::Stop,
            1 => Command::Close,
            2 => Command::Reset,
            _ => Command::Check,
        },
        50..54 => Command::Begin,
        54..56 => Command::Abort,
        _ => Command::Commit,
    }
}

/// Replaces one controller by another, which succeeds as long as either drives the device.
fn exchange(random: &mut Pcg32) -> Vec<Command> {
    let of = |name| ALL.module(name).unwrap();
    let all = [of("PDCTRL_MOD"), of("PIDCTRL_MOD"), of("PCTRL_MOD")];
    let [from, to] = [0, 1].map(|_| all[below(random, 3) as usize]);
    let k = Value::Real(below(random, 3_000) as f32);
    [
        Command::Begin,
        Command::Unplug(from),
        Command::set(to, 0, k),
        Command::set(to, 1, Value::Real(below(random, 30) as f32)),
        Command::PlugIn(to),
        Command::Commit,
        Command::Abort,
    ]
    .to_vec()
}

const PD: &str = "
    master PDCTRL_MOD K_PARAM 9
    master MOD_ENG MOD_ON PDCTRL_MOD
    master MOD_ENG MATCHING_CHECK";

/// A robot and its rows.
#[derive(Debug, Clone, Copy)]
struct Robot {
    axes: usize,
    outputs: Types,
    rows: &'static str,
}

impl Robot {
    /// The shipped scheme, which computes the desired position.
    const SHIPPED: Self = Self { axes: 3, outputs: &[types::POSITION], rows: SHIPPED };

    /// A scheme with a given desired position.
    const fn arm(axes: usize) -> Self {
        Self { axes, outputs: &[types::POSITION, types::DES_POSITION], rows: PD }
    }

    fn controller(self) -> Dimsart {
        let axes = vec![AxisKind::Rotary; self.axes];
        let device = DeviceDescriptor::new("arm", &axes, H, self.outputs, &[types::DES_FORCE]);
        Dimsart::new(ProvidedMemory::leak_default(), device.unwrap().with_limits(&[LIMITS]).unwrap(), ALL)
            .unwrap()
    }

    fn load(self, side: &str, dimsart: &mut Dimsart) {
        let rows = self.rows;
        assert_eq!(scheme::load(rows, side, &["master", "slave"], dimsart, |error| panic!("{error:?}")), 0);
    }
}

#[derive(Debug, Default)]
struct Counts {
    commits: u32,
    ran: u32,
    refused: u32,
    compared: u32,
}

fn torment(robot: Robot, commands: u32, seed: u64) -> Counts {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut bench = Bench { dimsart: robot.controller() };
    let empty = bench.dimsart.engine().usage();
    // The peer, which keeps sending.
    let mut other = Robot::SHIPPED.controller();
    Robot::SHIPPED.load("slave", &mut other);
    let mut counts = Counts::default();
    let (mut planned, mut given) = (Vec::new(), vec![0.0_f32; robot.axes]);
    let mut x_m = given.clone();
    for number in 0..commands {
        if number % 1_000 == 0 {
            let _ = bench.dimsart.command(Command::Abort);
            bench.dimsart.command(Command::Close).unwrap();
            robot.load("master", &mut bench.dimsart);
        }
        let command = match planned.pop() {
            Some(command) => command,
            None if below(&mut random, 10) == 0 => {
                planned = exchange(&mut random);
                planned.reverse();
                continue;
            }
            None => any_command(&mut random),
        };
        let before = (below(&mut random, 40) == 0).then(|| bench.snapshot());
        match bench.dimsart.command(command) {
            Ok(()) => counts.commits += u32::from(command == Command::Commit),
            Err(error) => {
                counts.refused += 1;
                if let Some(before) = before {
                    counts.compared += 1;
                    assert_eq!(bench.snapshot(), before, "{command:?}: {error:?}");
                }
            }
        }
        if below(&mut random, 50) == 0 {
            bench.dimsart.set_motion_allowed(below(&mut random, 3) > 0);
        }
        other.tick(&[Word(0); 3], &mut [Word(0); 3]);
        if let Some(packet) = other.take_outgoing(0) {
            let _ = bench.dimsart.receive_parsed(0, &Ok::<Packet, _>(packet));
        }
        let mut measured: Vec<Word> = x_m.iter().map(|x| Word::from(*x)).collect();
        measured.resize(bench.dimsart.frame().output_words(), Word::from(0.3));
        let (tick, commanded) = bench.try_tick(&measured);
        counts.ran += u32::from(tick == TickResult::Ran);
        for ((word, given), x) in commanded.iter().zip(&mut given).zip(&mut x_m) {
            let force = f32::from_bits(word.0);
            assert!(force.abs() <= 40.0, "{number} {command:?}: {force}");
            assert!((force - *given).abs() <= STEP_N, "{number} {command:?}: {force} after {given}");
            *given = force;
            *x = (*x + 1e-4 * force).clamp(-1.0, 1.0);
        }
        while let Some(packet) = bench.dimsart.take_outgoing(0) {
            let _ = other.receive_parsed(0, &Ok(packet));
        }
    }
    let _ = bench.dimsart.command(Command::Abort);
    bench.dimsart.command(Command::Close).unwrap();
    assert_eq!(bench.dimsart.engine().usage(), empty, "memory leak");
    counts
}

#[test]
fn random_transactions_of_any_modules_keep_the_device_within_its_limits() {
    for robot in [Robot::SHIPPED, Robot::arm(1), Robot::arm(6)] {
        let counts = torment(robot, 100_000, robot.axes as u64);
        let Counts { commits, ran, refused, compared } = counts;
        assert!(commits > 2_000 && ran > 10_000 && refused > 10_000 && compared > 500, "{counts:?}");
    }
}
