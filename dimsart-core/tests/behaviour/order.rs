//! Every module kind, plugged in before and after the writer of one of its inputs: in each order that the
//! matching check accepts, the law uses the right value.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_precision_loss, reason = "small by construction")]

use dimsart_core::{
    AxisKind, Command, DeviceDescriptor, Dimsart, Direction, Engine, ModuleRef, ParameterType, PortSpec,
    ProvidedMemory, TickResult, TypeRef, Value, Word, types,
};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Bench, H, surroundings_of};

const TICKS: usize = 40;
const DOF: usize = 2;

/// A module with these settings, whose inputs the device measures; one input may come from a copy that a
/// module makes before or after it.
struct Case {
    module: ModuleRef,
    settings: Vec<(u8, Value)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Copied {
    Before(usize),
    After(usize),
}

impl Case {
    fn ports(&self) -> Vec<PortSpec> {
        let none = DeviceDescriptor::new("none", &[AxisKind::Linear; DOF], H, &[], &[]).unwrap();
        let mut engine = Engine::new(ProvidedMemory::leak_default(), none, ALL);
        for (parameter, value) in &self.settings {
            let _ = engine.command(Command::set(self.module, *parameter, *value));
        }
        engine.ports(self.module).unwrap().to_vec()
    }

    /// None if the matching check refuses it.
    fn scheme(&self, copied: Option<Copied>) -> Option<Dimsart> {
        let ports = self.ports();
        let (measured, bindings) = surroundings_of(&ports);
        let device =
            DeviceDescriptor::new("bench", &[AxisKind::Linear; DOF], H, measured.leak(), &[]).unwrap();
        let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap();
        for (parameter, value) in &self.settings {
            let _ = dimsart.command(Command::set(self.module, *parameter, *value));
        }
        let bind = |dimsart: &mut Dimsart, port, signal| {
            dimsart.command(Command::bind(self.module, port, signal)).unwrap();
        };
        for (port, signal) in &bindings {
            bind(&mut dimsart, *port, *signal);
        }
        let copy = ALL.module("TIMEDELAY_MOD.9").unwrap();
        if let Some(Copied::Before(port) | Copied::After(port)) = copied {
            let source = source(&ports, &bindings, port);
            let target = TypeRef { number: 9, ..source };
            dimsart.command(Command::bind(copy, 0, source)).unwrap();
            dimsart.command(Command::bind(copy, 1, target)).unwrap();
            bind(&mut dimsart, u8::try_from(port).unwrap(), target);
        }
        let order = match copied {
            None => vec![self.module],
            Some(Copied::Before(_)) => vec![copy, self.module],
            Some(Copied::After(_)) => vec![self.module, copy],
        };
        for module in order {
            dimsart.command(Command::PlugIn(module)).ok()?;
        }
        dimsart.command(Command::Check).ok()?;
        Some(dimsart)
    }

    /// The module's outputs in each tick; the input of a late port comes a tick later than the others.
    fn run(&self, mut dimsart: Dimsart, late: Option<usize>) -> Vec<Vec<u32>> {
        let ports = self.ports();
        let (measured, bindings) = surroundings_of(&ports);
        let words = dimsart.frame().output_words();
        let of = |port: usize| {
            let source = source(&ports, &bindings, port);
            let place = measured.iter().position(|found| found.first() == source).unwrap();
            let before: usize = measured[..place].iter().map(|found| found.shape.words(DOF)).sum();
            before..before + measured[place].shape.words(DOF)
        };
        let mut random = Pcg32::seed_from_u64(u64::from(self.module.kind.bits()));
        let mut previous = vec![Word(0); words];
        let mut written = Vec::new();
        for _ in 0..TICKS {
            let fresh: Vec<_> =
                (0..words).map(|_| Word::from((random.next_u32() >> 8) as f32 / 16_777_216.0)).collect();
            let mut frame = fresh.clone();
            if let Some(port) = late {
                frame[of(port)].copy_from_slice(&previous[of(port)]);
            }
            previous = fresh;
            assert!(matches!(dimsart.tick(&frame, &mut []), TickResult::Ran | TickResult::LinkDown { .. }));
            let engine = dimsart.engine();
            let signals = engine.steps().filter(|step| step.module == self.module);
            let signals = signals.flat_map(|step| engine.step_signals(step)).collect::<Vec<_>>();
            let data_base = engine.data_base();
            written.push(
                signals
                    .iter()
                    .filter(|(_, way)| *way == Direction::Write)
                    .flat_map(|(signal, _)| data_base.words(data_base.slot(*signal).unwrap()).to_vec())
                    .collect(),
            );
        }
        written
    }
}

/// The measured signal of a port.
fn source(ports: &[PortSpec], bindings: &[(u8, TypeRef)], port: usize) -> TypeRef {
    let bound = bindings.iter().find(|(bound, _)| usize::from(*bound) == port);
    bound.map_or_else(|| ports[port].data_type.unwrap().1, |(_, signal)| *signal)
}

/// Every kind with defaults, with each value of each choice and switch, and with random numbers.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for kind in ALL.list().iter().map(|kind| kind.id) {
        let module = ModuleRef { kind, number: 1 };
        let described = |index| ALL.describe_parameter(kind, index);
        let parameters: Vec<_> = (0..=u8::MAX).map_while(described).map(|found| found.accepts).collect();
        let mut random = Pcg32::seed_from_u64(kind.bits().into());
        let numbers: Vec<_> = (0..)
            .zip(&parameters)
            .filter(|(_, accepts)| matches!(accepts, ParameterType::Real { .. }))
            .map(|(index, _)| (index, Value::Real((random.next_u32() % 40) as f32 * 0.1)))
            .collect();
        let mut settings = vec![numbers.clone()];
        for (index, accepts) in (0..).zip(&parameters) {
            let values: Vec<_> = match accepts {
                ParameterType::Flag => [false, true].map(Value::Flag).to_vec(),
                ParameterType::Choice(names) => (0..).take(names.len()).map(Value::Choice).collect(),
                _ => Vec::new(),
            };
            settings.extend(values.into_iter().map(|value| [&numbers[..], &[(index, value)]].concat()));
        }
        cases.extend(settings.into_iter().map(|settings| Case { module, settings }));
    }
    cases
}

#[test]
fn in_every_order_that_is_accepted_a_module_computes_what_its_law_says() {
    let (mut accepted, mut refused, mut delayed) = (0, 0, 0);
    for case in cases() {
        let Some(alone) = case.scheme(None) else { continue };
        let expected = case.run(alone, None);
        let name = ALL.module_name(case.module).name;
        for (place, port) in case.ports().iter().enumerate() {
            if port.direction != Direction::Read {
                continue;
            }
            for copied in [Copied::Before(place), Copied::After(place)] {
                let Some(scheme) = case.scheme(Some(copied)) else {
                    refused += 1;
                    continue;
                };
                accepted += 1;
                let found = case.run(scheme, None);
                let said = format!("{name} {:?}: {} {copied:?}", case.settings, port.name);
                if port.is_delayed {
                    // The law needs the previous tick's value; a measurement is already of that tick.
                    delayed += 1;
                    let of_before = case.run(case.scheme(None).unwrap(), Some(place));
                    assert_eq!((copied, &found), (Copied::After(place), &of_before), "{said}");
                } else {
                    assert_eq!(found, expected, "{said}");
                }
            }
        }
    }
    assert!(accepted > 300 && refused > 200 && delayed >= 5, "{accepted} {refused} {delayed}");
}

/// The observer's law needs the force of the previous tick: plugged in after the controller, it would
/// interpret this tick's force as a disturbance.
#[test]
fn an_observer_behind_its_controller_is_refused_and_before_it_observes_nothing_without_a_disturbance() {
    let (observer, controller) = ("MOD_ENG MOD_ON DISTURBANCE_OBSERVER_MOD", "MOD_ENG MOD_ON PDCTRL_MOD");
    let rows = "DISTURBANCE_OBSERVER_MOD INERTIA 2\nPDCTRL_MOD K_PARAM 100\nPDCTRL_MOD D_PARAM 10";
    let measured = &[types::POSITION, types::VELOCITY, types::DES_POSITION];
    let mut bench = Bench::of(1, measured, &[types::DES_FORCE]);
    bench.rows(&format!("{rows}\n{controller}\n{observer}"));
    assert_eq!(bench.load("MOD_ENG MATCHING_CHECK").len(), 1);
    assert_eq!(
        bench.findings(),
        [
            "DISTURBANCE_OBSERVER_MOD needs the last tick's DES_FORCE, but PDCTRL_MOD overwrites it first: plug in \
          DISTURBANCE_OBSERVER_MOD before PDCTRL_MOD"
        ]
    );
    let mut bench = Bench::of(1, measured, &[types::DES_FORCE]);
    bench.run(&format!("{rows}\n{observer}\n{controller}"));
    let (mut x, mut v) = (0.0, 0.0);
    for _ in 0..500 {
        let force = bench.tick(&[x, v, 0.1])[0];
        // 2 kg, the force is constant during the tick.
        let a = force / 2.0;
        (x, v) = (x + H * (v + 0.5 * H * a), v + H * a);
        let observed = bench.signal("EXTERNAL_FORCE")[0];
        assert!(observed.abs() < 2e-3, "{observed}");
    }
}
