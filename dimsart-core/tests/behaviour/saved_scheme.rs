//! A scheme saved as commands is restored unchanged, or not at all.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use crate::common::module_at;
use crate::common::{self, Bench, words};
use dimsart_core::KindId;

use dimsart_core::{
    Command, CommandError, Context, Dimsart, EVERY_TICKS, Module, ModuleRef, ParameterShape, ParameterType,
    Parameters, TypeRef, Unit, Value, types, words,
};
use dimsart_link::saved_scheme::{
    LoadError, MAX_SCHEME_BYTES, SAVED_SCHEME_VERSION, SchemeBytes, TooLong, Writer, fingerprint, load, save,
};
use dimsart_modules::{ALL, P, Pd};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

const MEASURED: common::Types =
    &[types::POSITION, types::VELOCITY, types::DES_POSITION, types::CH2_WAVES, types::SIGNAL];
const SCHEME: &str = include_str!("../../../schemes/bilateral.scheme");

fn below(random: &mut Pcg32, bound: u32) -> u32 {
    random.next_u32() % bound
}

fn small(random: &mut Pcg32, bound: u32) -> u8 {
    u8::try_from(below(random, bound)).unwrap()
}

fn any_signal(random: &mut Pcg32) -> TypeRef {
    let found = &types::ALL[below(random, u32::try_from(types::ALL.len()).unwrap()) as usize];
    TypeRef { id: found.id, number: 1 + small(random, 3) }
}

fn any_value(accepts: ParameterType, random: &mut Pcg32) -> Value {
    let unit = f32::from(u16::try_from(random.next_u32() >> 16).unwrap()) / 65_536.0;
    match accepts {
        // Small, so that the following ticks stay finite.
        ParameterType::Real { min, max } => Value::Real(min + unit * (max.min(2.0 + min.max(0.0)) - min)),
        ParameterType::Count { min, max } => Value::Count(min + below(random, (max - min).min(30) + 1)),
        ParameterType::Integer { min, max } => Value::Integer(if below(random, 2) == 0 { min } else { max }),
        ParameterType::Flag => Value::Flag(below(random, 2) == 1),
        ParameterType::Choice(names) => Value::Choice(small(random, u32::try_from(names.len()).unwrap())),
        ParameterType::Types => Value::Type(any_signal(random)),
    }
}

/// A random scheme that matches.
fn any_scheme(dof: usize, random: &mut Pcg32) -> Bench {
    let mut bench = Bench::of(dof, MEASURED, &[]);
    let kinds = u32::try_from(ALL.list().len()).unwrap();
    for _ in 0..10 + below(random, 10) {
        let module = module_at(below(random, kinds) as usize, 1 + small(random, 2));
        for _ in 0..below(random, 8) {
            let Some(index) = parameters(module.kind).checked_sub(1).map(|last| small(random, last + 1))
            else {
                continue;
            };
            let index = if below(random, 8) == 0 { EVERY_TICKS } else { index };
            let parameter = ALL.describe_parameter(module.kind, index).unwrap();
            let place = |random: &mut Pcg32, count: usize| small(random, u32::try_from(count).unwrap());
            // All values of a large matrix exceed the size of a saved scheme.
            let entry = match parameter.entries {
                entries if entries.is_matrix() => {
                    Some(place(random, entries.count(u8::try_from(dof).unwrap()).into()))
                }
                ParameterShape::AXES if below(random, 2) == 0 => Some(place(random, dof)),
                _ => None,
            };
            let value = any_value(parameter.accepts, random);
            let _ = bench.dimsart.command(Command::Set { module, parameter: index, entry, value });
        }
        for _ in 0..below(random, 3) {
            let _ = bench.dimsart.command(Command::bind(module, small(random, 6), any_signal(random)));
        }
        if below(random, 4) == 0 {
            let other = module_at(below(random, kinds) as usize, 1);
            let _ = bench.dimsart.command(Command::PlaceBefore(other));
        }
        let _ = bench.dimsart.command(Command::PlugIn(module));
        if bench.dimsart.engine().check().faults() > 0 {
            let _ = bench.dimsart.command(Command::Unplug(module));
        }
    }
    assert_eq!(bench.dimsart.command(Command::Check), Ok(()), "{:?}", bench.findings());
    bench
}

fn parameters(kind: KindId) -> u32 {
    let described = |index| ALL.describe_parameter(kind, index);
    u32::try_from((0..).map_while(described).count()).unwrap()
}

#[test]
fn a_scheme_comes_back_with_the_same_modules_signals_parameters_and_bits() {
    let mut random = Pcg32::seed_from_u64(3);
    let (mut modules, mut bindings, mut too_long) = (0, 0, 0);
    for round in 0..180 {
        let dof = [1, 3, 8][round % 3];
        let mut made = any_scheme(dof, &mut random);
        let Ok(bytes) = save(made.dimsart.engine_mut()) else {
            too_long += 1;
            continue;
        };
        let mut copy = Bench::of(dof, MEASURED, &[]);
        assert_eq!(reload(&bytes, &mut copy.dimsart), Ok(()), "round {round}");
        assert_eq!(save(copy.dimsart.engine_mut()), Ok(bytes), "round {round}");
        let (mut expected, mut found) = (made.snapshot(), copy.snapshot());
        // Instances are listed in order of creation; values of missing axes are ignored.
        if dof < 8 {
            expected.parameters.clear();
            found.parameters.clear();
        }
        let slots = |snapshot: &mut common::Snapshot| {
            snapshot.signals.sort_by_key(|(signal, _)| (signal.id, signal.number))
        };
        slots(&mut expected);
        slots(&mut found);
        assert_eq!(found, expected, "round {round}");
        modules += found.steps.len();
        bindings += found.bindings.iter().filter(|(.., bound)| bound.is_some()).count();
        for tick in 0..1000 {
            let values: Vec<f32> =
                (0..MEASURED.len() * dof).map(|_| f32::from(small(&mut random, 200)) / 100.0 - 1.0).collect();
            let outcomes = [&mut made, &mut copy].map(|bench| bench.try_tick(&words(&values)));
            assert_eq!(outcomes[0], outcomes[1]);
            for link in 0..2 {
                let [sent, resent] = [&mut made, &mut copy].map(|bench| bench.dimsart.take_outgoing(link));
                assert_eq!(sent, resent, "round {round}, tick {tick}");
            }
            let signals = |bench: &Bench| {
                let data_base = bench.dimsart.engine().data_base();
                let mut all: Vec<_> = data_base
                    .signals()
                    .map(|(slot, entry)| {
                        ((entry.signal.id, entry.signal.number), data_base.words(slot).to_vec())
                    })
                    .collect();
                all.sort();
                all
            };
            assert_eq!(signals(&made), signals(&copy), "round {round}, tick {tick}");
        }
    }
    assert!(modules > 300 && bindings > 300 && too_long < 90, "{modules} {bindings} {too_long}");
}

/// Loads it as an image with its fingerprint.
fn reload(bytes: &[u8], dimsart: &mut Dimsart) -> Result<(), LoadError> {
    let print = fingerprint(dimsart.engine_mut());
    load(bytes, print, dimsart)
}

/// One side of the shipped scheme.
fn shipped() -> Dimsart {
    let mut bench = Bench::of(3, &[types::POSITION], &[types::DES_FORCE]);
    let sides = &["master", "slave"];
    let failed = dimsart_core::scheme::load(SCHEME, "master", sides, &mut bench.dimsart, |_| {});
    assert_eq!(failed, 0);
    bench.dimsart
}

fn empty() -> Dimsart {
    Bench::of(3, &[types::POSITION], &[types::DES_FORCE]).dimsart
}

#[test]
fn a_transaction_that_is_open_ends_when_a_scheme_is_loaded() {
    let mut bench = Bench::of(3, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    bench.run("PDCTRL_MOD K_PARAM 10\nMOD_ENG MOD_ON PDCTRL_MOD");
    let bytes = save(bench.dimsart.engine_mut()).unwrap();
    bench.rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON PIDCTRL_MOD");
    assert_eq!(save(bench.dimsart.engine_mut()).unwrap(), bytes, "what runs is saved");
    let image = fingerprint(bench.dimsart.engine_mut());
    load(&bytes, image, &mut bench.dimsart).unwrap();
    assert!(!bench.dimsart.engine().is_in_transaction());
    assert_eq!(bench.steps(), ["PDCTRL_MOD Early"]);
}

#[test]
fn a_saved_scheme_has_no_transaction_in_it() {
    for command in [Command::Begin, Command::Commit, Command::Abort] {
        let mut dimsart = shipped();
        let image = fingerprint(dimsart.engine_mut());
        let mut bytes = SchemeBytes::new();
        let mut writer = Writer::new(&mut bytes, image);
        writer.push(&command).unwrap();
        writer.finish().unwrap();
        assert_eq!(load(&bytes, image, &mut dimsart), Err(LoadError::Damaged), "{command:?}");
        let engine = dimsart.engine();
        assert_eq!(
            (engine.is_running(), engine.is_in_transaction(), engine.usage().modules),
            (false, false, 0)
        );
    }
}

#[test]
fn what_is_damaged_cut_or_of_another_image_is_refused_before_any_command() {
    let mut shipped = shipped();
    let bytes = save(shipped.engine_mut()).unwrap();
    let mut dimsart = empty();
    let nothing = format!("{dimsart:?}");
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(reload(&damaged, &mut dimsart), Err(LoadError::Damaged), "bit {bit}");
    }
    for length in 0..bytes.len() {
        assert_eq!(reload(&bytes[..length], &mut dimsart), Err(LoadError::Damaged), "cut to {length}");
    }
    let mut other = SchemeBytes::new();
    Writer::new(&mut other, fingerprint(shipped.engine_mut()) ^ 1).finish().unwrap();
    assert_eq!(reload(&other, &mut dimsart), Err(LoadError::IncompatibleImage));
    assert_eq!(format!("{dimsart:?}"), nothing);
    assert_eq!(bytes[0], SAVED_SCHEME_VERSION);
    assert_eq!(reload(&bytes, &mut dimsart), Ok(()));
    assert!(dimsart.engine().is_running());
}

#[test]
fn a_scheme_that_does_not_load_leaves_no_module_behind() {
    let mut dimsart = shipped();
    let mut bytes = SchemeBytes::new();
    let mut writer = Writer::new(&mut bytes, fingerprint(dimsart.engine_mut()));
    let pd = ALL.module("PDCTRL_MOD").unwrap();
    let mut commands: Vec<Command> = dimsart.engine_mut().rebuild_commands().collect();
    commands.retain(|command| *command != Command::PlugIn(pd));
    commands.iter().for_each(|command| writer.push(command).unwrap());
    writer.finish().unwrap();
    let error = reload(&bytes, &mut dimsart).unwrap_err();
    let LoadError::Refused { command, error: CommandError::HasFaults { .. } } = error else {
        panic!("{error}")
    };
    assert_eq!(usize::from(command), commands.len(), "the last command, which starts it");
    assert_eq!((dimsart.engine().is_running(), dimsart.engine().usage().modules), (false, 0));
}

#[test]
fn a_scheme_without_the_command_that_starts_it_is_damaged() {
    let mut dimsart = shipped();
    let commands: Vec<Command> = dimsart.engine_mut().rebuild_commands().collect();
    for count in [0, 1, commands.len()] {
        let mut bytes = SchemeBytes::new();
        let mut writer = Writer::new(&mut bytes, fingerprint(dimsart.engine_mut()));
        commands.iter().take(count).for_each(|command| writer.push(command).unwrap());
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR).checksum(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes()).unwrap();
        assert_eq!(reload(&bytes, &mut dimsart), Err(LoadError::Damaged), "{count} commands");
        assert_eq!((dimsart.engine().is_running(), dimsart.engine().usage().modules), (false, 0));
    }
}

#[test]
fn a_scheme_that_fits_no_page_is_refused() {
    let gain = Command::set(ModuleRef::new("PDCTRL_MOD", 1), 0, Value::Real(1.0));
    let mut bytes = SchemeBytes::new();
    let mut writer = Writer::new(&mut bytes, 0);
    let gains = (0..).take_while(|_| writer.push(&gain).is_ok()).count();
    assert_eq!(gains, (MAX_SCHEME_BYTES - 5) / 11);
    while writer.push(&Command::Stop).is_ok() {}
    assert_eq!(writer.finish(), Err(TooLong));
    // Size of the shipped scheme, to show that the limit is far away.
    assert!(save(shipped().engine_mut()).unwrap().len() < MAX_SCHEME_BYTES / 2);
}

#[test]
fn images_with_other_modules_have_other_fingerprints() {
    let of = |bench: &mut Bench| fingerprint(bench.dimsart.engine_mut());
    let standard = of(&mut Bench::of(3, MEASURED, &[]));
    assert_eq!(of(&mut Bench::of(1, &[], MEASURED)), standard, "it does not contain the device");
    let two = fingerprint(Bench::with_kinds(dimsart_core::kinds![Pd, P], 1, &[], &[]).dimsart.engine_mut());
    let swapped =
        fingerprint(Bench::with_kinds(dimsart_core::kinds![P, Pd], 1, &[], &[]).dimsart.engine_mut());
    assert!(two != standard && swapped != standard && two != swapped);
}

words! { parameters Gain { k: f32 } }

/// A gain, for all axes or for each.
#[derive(Debug)]
struct Law<const IS_PER_AXIS: bool>;

impl<const IS_PER_AXIS: bool> Module for Law<IS_PER_AXIS> {
    const NAME: &'static str = "LAW_MOD";
    const SUMMARY: &'static str = "Has a gain.";
    type Settings = Gain;
    type Gains = Gain;
    type State = ();
    type AxisState = ();
    type Ports = ();

    fn parameters(settings: &mut Gain, gains: &mut Gain, visit: &mut Parameters<'_>) {
        if IS_PER_AXIS {
            visit.per_axis(&mut gains.k, "K", Unit::One, 0.0..=1.0, 0.5, "Gain.");
        } else {
            visit.real(&mut settings.k, "K", Unit::One, 0.0..=1.0, 0.5, "Gain.");
        }
    }

    fn compute(_: &Context<'_, Self>) {}
}

#[test]
fn an_image_whose_parameter_has_another_number_of_values_has_another_fingerprint() {
    let one =
        fingerprint(Bench::with_kinds(dimsart_core::kinds![Law<false>], 1, &[], &[]).dimsart.engine_mut());
    let per_axis =
        fingerprint(Bench::with_kinds(dimsart_core::kinds![Law<true>], 1, &[], &[]).dimsart.engine_mut());
    assert_ne!(one, per_axis);
}
