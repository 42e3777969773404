//! Properties of every module kind of the library.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "numbers of a test")]

use dimsart_core::{Command, FaultCause, MAX_CHOICES, ModuleRef, ParameterType, TickResult, Unit, Value};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::Alone;
use crate::modules::kind_alone;

const TICKS: usize = 200;

fn kinds() -> impl Iterator<Item = ModuleRef> {
    ALL.list().iter().map(|kind| ModuleRef { kind: kind.id, number: 1 })
}

fn name(module: ModuleRef) -> &'static str {
    ALL.module_name(module).name
}

/// Words of a device: mostly plausible values, sometimes zero, constant or jumping.
fn measure(random: &mut Pcg32, words: &mut [f32]) {
    for word in words {
        match random.next_u32() % 8 {
            0 => *word = 0.0,
            1..4 => {}
            _ => {
                let share = (random.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0;
                *word = share * [1e-4, 1.0, 30.0, 1e3][(random.next_u32() % 4) as usize];
            }
        }
    }
}

/// A value that a parameter accepts, anywhere in its range or near its minimum.
fn value(random: &mut Pcg32, accepts: ParameterType) -> Option<Value> {
    let below = |random: &mut Pcg32, bound: u32| random.next_u32() % bound.max(1);
    Some(match accepts {
        ParameterType::Real { min, max } => {
            let share = (random.next_u32() >> 8) as f32 / (1 << 24) as f32;
            Value::Real(min + (max - min) * share * [1e-6, 1e-3, 1.0][below(random, 3) as usize])
        }
        ParameterType::Count { min, max } => Value::Count(min + below(random, (max - min).min(64) + 1)),
        ParameterType::Integer { min, max } => {
            Value::Integer((below(random, 100) as i32 - 50).clamp(min, max))
        }
        ParameterType::Flag => Value::Flag(below(random, 2) == 0),
        ParameterType::Choice(names) => Value::Choice(below(random, names.len() as u32) as u8),
        ParameterType::Types => return None,
    })
}

/// Sets random parameters; invalid combinations are refused and keep the old values.
fn set_all(alone: &mut Alone, random: &mut Pcg32, module: ModuleRef) {
    for parameter in 0..=u8::MAX {
        let Some(found) = ALL.describe_parameter(module.kind, parameter) else { return };
        if let Some(value) = value(random, found.accepts) {
            let _ = alone.bench.dimsart.command(Command::Set { module, parameter, entry: None, value });
        }
    }
}

fn fault(alone: &Alone) -> Option<String> {
    let engine = alone.bench.dimsart.engine();
    engine.module_fault().map(|fault| match fault.cause {
        FaultCause::InvalidOutput { signal, bits, .. } => {
            format!("wrote {} to {}", f32::from_bits(bits), engine.device().signal_name(signal))
        }
        FaultCause::TimeExceeded { .. } => "took too long".to_owned(),
    })
}

fn tick(alone: &mut Alone, measured: &[f32]) -> TickResult {
    let words: Vec<_> = measured.iter().map(|value| dimsart_core::Word::from(*value)).collect();
    alone.bench.try_tick(&words).0
}

#[test]
fn with_its_defaults_it_writes_nothing_but_numbers_that_can_be() {
    for module in kinds() {
        let mut alone = kind_alone(module.kind);
        let mut random = Pcg32::seed_from_u64(module.kind.bits().into());
        let mut measured = vec![0.0; alone.bench.dimsart.frame().output_words()];
        for _ in 0..TICKS {
            measure(&mut random, &mut measured);
            let tick = tick(&mut alone, &measured);
            assert!(matches!(tick, TickResult::Ran | TickResult::LinkDown { .. }), "{}", name(module));
            assert_eq!(fault(&alone), None, "{}: {measured:?}", name(module));
        }
    }
}

/// A module whose parameters allow unlimited growth is isolated and must recover.
#[test]
fn with_any_parameters_it_begins_anew_after_a_reset_whatever_became_of_it() {
    let mut cut_out = 0;
    for module in kinds() {
        for seed in 0..20 {
            let mut random = Pcg32::seed_from_u64(1000 * seed + u64::from(module.kind.bits()));
            let mut alone = kind_alone(module.kind);
            set_all(&mut alone, &mut random, module);
            let mut measured = vec![0.0; alone.bench.dimsart.frame().output_words()];
            let fails = (0..TICKS).any(|_| {
                measure(&mut random, &mut measured);
                tick(&mut alone, &measured);
                fault(&alone).is_some()
            });
            cut_out += u32::from(fails);
            alone.bench.rows("MOD_ENG RESET");
            measured.fill(0.0);
            tick(&mut alone, &measured);
            assert_eq!(fault(&alone), None, "{} with seed {seed}", name(module));
        }
    }
    println!("{cut_out} were cut out");
}

#[test]
fn its_words_say_what_it_is() {
    for module in kinds() {
        let kind = ALL.kind(module.kind).unwrap();
        assert!(kind.name.ends_with("MOD"), "{}", kind.name);
        assert!(kind.summary.text().ends_with('.') && kind.summary.text().len() > 20, "{}", kind.name);
        let described = |index| ALL.describe_parameter(module.kind, index);
        for parameter in (0..=u8::MAX).map_while(described) {
            let said = format!("{} {}: '{}'", kind.name, parameter.name, parameter.summary.text());
            assert!(parameter.summary.text().ends_with('.'), "{said}");
            assert!(
                parameter.unit != Unit::Any || !matches!(parameter.accepts, ParameterType::Count { .. }),
                "{said}"
            );
        }
    }
}

/// A description holds a maximum number of names of a choice; a parameter with more could not be described.
#[test]
fn every_choice_can_be_described_over_the_protocol() {
    let mut choices = 0;
    for module in kinds() {
        let described = |index| ALL.describe_parameter(module.kind, index);
        for parameter in (0..=u8::MAX).map_while(described) {
            if let ParameterType::Choice(names) = parameter.accepts {
                let (name, kind) = (parameter.name, name(module));
                assert!((1..=MAX_CHOICES).contains(&names.len()), "{kind} {name}: {names:?}");
                choices += 1;
            }
        }
    }
    assert!(choices > 0);
}
