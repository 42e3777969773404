//! The types matching check reports every fault of a scheme, and no others.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::collections::BTreeSet;

use crate::common::Bench;
use crate::common::module_at;
use dimsart_core::{
    AxisKind, Command, CommandError, DataType, DeviceDescriptor, Dimsart, Direction, Endpoint, Engine,
    Finding, Format, ParameterError, ProvidedMemory, Shape, Summary, Unit, UnitRelation, limits, scheme,
    types,
};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};

const SIDES: &[&str] = &["master", "slave"];

fn robot() -> Dimsart {
    let axes = [AxisKind::Linear; 3];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
    Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap()
}

/// Loads a scheme and returns the texts of the errors.
fn load(dimsart: &mut Dimsart, text: &str, side: &str) -> Vec<String> {
    let mut errors = Vec::new();
    scheme::load(text, side, SIDES, dimsart, |error| {
        errors.push(format!("{}:{} {:?}", error.place.line, error.place.column, error.problem));
    });
    errors
}

fn findings(dimsart: &Dimsart) -> Vec<String> {
    let report = dimsart.engine().check();
    report.findings().iter().map(|finding| dimsart.engine().explain(*finding).to_string()).collect()
}

#[test]
fn table_1_as_printed_matches_on_the_master() {
    let mut master = robot();
    assert_eq!(load(&mut master, include_str!("../../../schemes/table1.scheme"), "master"), [""; 0]);
    assert_eq!(findings(&master), [""; 0]);
    assert!(master.engine().is_running());
}

#[test]
fn table_1_as_printed_lacks_exactly_one_provider_on_the_slave() {
    let mut slave = robot();
    let errors = load(&mut slave, include_str!("../../../schemes/table1.scheme"), "slave");
    assert_eq!(errors, ["20:25 Refused(HasFaults { faults: 1 })"]);
    let report = slave.engine().check();
    let tx = ALL.module("COMM_TXMOD").unwrap();
    let expected = Finding::NoWriter { signal: types::CH1_TD_WAVES.first(), reader: Endpoint::Module(tx) };
    assert_eq!(report.findings(), [expected]);
    assert!(!slave.engine().is_running());
}

#[test]
fn the_shipped_scheme_runs_on_both_sides() {
    for side in SIDES {
        let mut dimsart = robot();
        assert_eq!(load(&mut dimsart, include_str!("../../../schemes/bilateral.scheme"), side), [""; 0]);
        assert!(dimsart.engine().is_running(), "{:?}", findings(&dimsart));
    }
}

const AGE: &DataType = &own(0x8000, "ARM_AGE", Format::U32, Shape::Vector);
const INERTIA: &DataType = &own(0x8001, "ARM_INERTIA", Format::F32, Shape::Matrix(2, 2));

const fn own(id: u16, name: &'static str, format: Format, shape: Shape) -> DataType {
    DataType { id, name, unit: Unit::Any, format, shape, summary: Summary::new("A board's own.") }
}

#[test]
fn every_fault_of_a_scheme_is_in_one_report_and_the_declared_delays_behind() {
    let outputs = &[types::POSITION, types::FORCE, AGE, INERTIA];
    let mut bench = Bench::of(3, outputs, &[types::DES_FORCE, types::DES_VELOCITY]);
    let errors = bench.load(
        "RECORDER_MOD PORT_SIGNAL_IN LINE_FORCE
         MOD_ENG MOD_ON RECORDER_MOD
         WTRANSF_MOD FORM PRINTED
         WTRANSF_MOD PORT_POSITION FORCE
         MOD_ENG MOD_ON WTRANSF_MOD
         PCTRL_MOD PORT_POSITION ARM_AGE
         PCTRL_MOD PORT_DES_POS POSITION
         MOD_ENG MOD_ON PCTRL_MOD
         PDCTRL_MOD PORT_POSITION ARM_INERTIA
         MOD_ENG MOD_ON PDCTRL_MOD
         MOD_ENG MOD_ON PIDCTRL
         MOD_ENG MATCHING_CHECK",
    );
    let pcontrol = ALL.module("PCTRL_MOD").unwrap();
    assert_eq!(
        errors,
        [
            format!("7:ModuleCommand({pcontrol:?})"),
            "11:ModuleValue".to_owned(),
            "12:Refused(HasFaults { faults: 7 })".to_owned()
        ]
    );
    let mut findings = bench.findings();
    let declared = findings.split_off(7);
    findings.sort_unstable();
    let fitting = |kind| {
        format!(
            "bind the port to a compatible signal (PORT_POSITION command); `dimsart modules {kind}` shows the ports"
        )
    };
    let stale = "so the value is one tick old";
    assert_eq!(
        findings,
        [
            "DES_FORCE has two providers, PCTRL_MOD and PDCTRL_MOD: \
         unplug one of the two, or bind its port to another signal (PORT_... command)"
                .to_owned(),
            format!(
                "RECORDER_MOD reads LINE_FORCE before WTRANSF_MOD writes it, {stale}: plug in the writer first"
            ),
            "WTRANSF_MOD reads CH2_WAVES, which has no provider: plug in a module that writes CH2_WAVES"
                .to_owned(),
            format!(
                "port POSITION of PCTRL_MOD is bound to ARM_AGE, which has the wrong format, U32: {}",
                fitting("PCTRL_MOD")
            ),
            format!(
                "port POSITION of PDCTRL_MOD is bound to ARM_INERTIA, which has the wrong shape, Matrix(2, 2): {}",
                fitting("PDCTRL_MOD")
            ),
            format!(
                "port POSITION of WTRANSF_MOD is bound to FORCE, which has the wrong unit, N: {}",
                fitting("WTRANSF_MOD")
            ),
            "the device bench reads DES_VELOCITY, which has no provider: \
         plug in a module that writes DES_VELOCITY"
                .to_owned(),
        ]
    );
    assert_eq!(
        declared,
        ["PCTRL_MOD", "PDCTRL_MOD"].map(|reader| {
            format!("{reader} reads DES_POSITION before WTRANSF_MOD writes it, {stale} (declared)")
        })
    );
}

#[test]
fn a_report_counts_what_it_cannot_list_and_lists_faults_before_declared_delays() {
    let mut bench = Bench::of(3, &[types::POSITION, types::FORCE], &[]);
    let mut rows = String::new();
    for number in 1..=14 {
        rows += &format!(
            "PDCTRL_MOD.{number} PORT_POSITION FORCE.2\nPDCTRL_MOD.{number} PORT_DES_FORCE POSITION\n\
             MOD_ENG MOD_ON PDCTRL_MOD.{number}\n"
        );
    }
    bench.rows(&(rows + "WTRANSF_MOD FORM PRINTED\nMOD_ENG MOD_ON WTRANSF_MOD"));
    let report = bench.dimsart.engine().check();
    // Each PD: two wrong units, two providers, no provider; the wave transformer: no wave, no force.
    assert_eq!(report.faults(), 14 * 4 + 2);
    assert_eq!(report.findings().len(), limits::MAX_FINDINGS);
    assert_eq!(report.unlisted(), 14 * 5 + 2 - limits::MAX_FINDINGS);
    assert!(report.findings().iter().all(Finding::is_fault));
    assert!(!report.has_no_fault());
}

#[test]
fn a_comm_channel_bound_to_another_format_or_shape_is_a_fault() {
    for (signal, difference) in
        [("ARM_AGE", "format, U32"), ("ARM_INERTIA", "shape, Matrix(2, 2)"), ("LINK_AGE", "format, U32")]
    {
        let mut bench = Bench::of(3, &[AGE, INERTIA, types::LINK_AGE], &[]);
        let rows = "COMM_TXMOD CTX_ADD_DATA SIGNAL\nCOMM_TXMOD PORT_DATA_1";
        bench.rows(&format!("{rows} {signal}\nMOD_ENG MOD_ON COMM_TXMOD"));
        let expected = format!(
            "port DATA_1 of COMM_TXMOD is bound to {signal}, which has the wrong {difference}: \
             bind the port to a compatible signal (PORT_DATA_1 command); `dimsart modules COMM_TXMOD` shows the ports"
        );
        assert_eq!(bench.findings(), [expected]);
    }
}

#[test]
fn the_unit_in_a_finding_is_the_one_of_the_axes() {
    let device = DeviceDescriptor::new("arm", &[AxisKind::Rotary], 1e-3, &[types::FORCE], &[]).unwrap();
    let mut bench: Bench =
        Bench { dimsart: Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap() };
    bench.rows("VWALL_MOD PORT_POSITION FORCE\nMOD_ENG MOD_ON VWALL_MOD");
    assert!(bench.findings()[0].contains("wrong unit, N·m:"), "{:?}", bench.findings());
}

#[test]
fn instances_of_one_kind_live_side_by_side_on_numbered_signals() {
    let mut bench = Bench::of(2, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    bench.run(
        "PCTRL_MOD K_PARAM 100
         PCTRL_MOD PORT_DES_FORCE FORCE.2
         MOD_ENG MOD_ON PCTRL_MOD
         PCTRL_MOD.2 K_PARAM 10
         PCTRL_MOD.2 PORT_DES_FORCE FORCE.3
         MOD_ENG MOD_ON PCTRL_MOD.2
         SUM_MOD PORT_A FORCE.2
         SUM_MOD PORT_B FORCE.3
         SUM_MOD B_GAIN -1
         SUM_MOD PORT_SIGNAL_OUT DES_FORCE
         MOD_ENG MOD_ON SUM_MOD",
    );
    assert_eq!(bench.tick(&[0.0, 0.0, 1.0, -2.0]), [90.0, -180.0]);
    assert_eq!(bench.signal("FORCE.3"), [10.0, -20.0]);
}

/// Plugs in a module with these bindings; returns the unit faults.
fn unit_faults(module: &str, bindings: &[(&str, &str)]) -> Vec<String> {
    let mut bench = Bench::of(3, &[], &[]);
    for (port, signal) in bindings {
        bench.rows(&format!("{module} PORT_{port} {signal}"));
    }
    bench.rows(&format!("MOD_ENG MOD_ON {module}"));
    bench.findings().into_iter().filter(|finding| finding.contains("unit")).collect()
}

#[test]
fn a_sum_of_different_units_is_a_fault() {
    let sum = |a, b, out| unit_faults("SUM_MOD", &[("A", a), ("B", b), ("SIGNAL_OUT", out)]);
    let fault = |first: &str, second: &str| {
        format!(
            "SUM_MOD has {first} and {second}, but the second port must have the unit of the first: \
             bind one of these ports to a compatible signal (PORT_... command)"
        )
    };
    assert_eq!(sum("FORCE", "LINE_FORCE", "DES_FORCE.2"), [""; 0]);
    assert_eq!(sum("FORCE", "LINE_FORCE", "SIGNAL_OUT.2"), [""; 0]);
    assert_eq!(
        sum("POSITION", "CH1_WAVES", "DES_FORCE.2"),
        [
            fault("A bound to POSITION (m)", "B bound to CH1_WAVES (sqrt(W))"),
            fault("A bound to POSITION (m)", "SIGNAL_OUT bound to DES_FORCE.2 (N)")
        ]
    );
    // Also through an input of any unit.
    let through = [fault("B bound to POSITION (m)", "SIGNAL_OUT bound to DES_FORCE.2 (N)")];
    assert_eq!(sum("SIGNAL", "POSITION", "DES_FORCE.2"), through);
}

#[test]
fn a_delay_gives_back_the_unit_it_takes_and_takes_any() {
    let delay = |input, output| unit_faults("TIMEDELAY_MOD", &[("SIGNAL_IN", input), ("SIGNAL_OUT", output)]);
    assert_eq!(unit_faults("TIMEDELAY_MOD", &[]), [""; 0]);
    for (signal, other) in [("POSITION", "DES_POSITION.2"), ("CH2_WAVES", "CH2_TD_WAVES.2")] {
        assert_eq!(delay(signal, other), [""; 0]);
        assert_eq!(delay(signal, "DES_FORCE.2").len(), 1);
    }
}

#[test]
fn integrals_and_derivatives_have_the_unit_that_follows() {
    let sound = |module, input, output| {
        unit_faults(module, &[("SIGNAL_IN", input), ("SIGNAL_OUT", output)]).is_empty()
    };
    let vectors = types::ALL.iter().filter(|found| found.shape == Shape::Vector && found.unit != Unit::Any);
    for input in vectors.map(|data_type| data_type.name) {
        let is_velocity = input.ends_with("VELOCITY") && !input.contains("TIP_");
        let is_position = input.ends_with("POSITION") && !input.contains("TIP_");
        assert_eq!(sound("INTEGRATOR_MOD", input, "POSITION.2"), is_velocity, "{input}");
        assert_eq!(sound("DIFFERENTIATOR_MOD", input, "VELOCITY.2"), is_position, "{input}");
        for module in ["INTEGRATOR_MOD", "DIFFERENTIATOR_MOD"] {
            assert!(sound(module, input, "SIGNAL_OUT"), "{input}");
            assert!(!sound(module, input, "FORCE.2") && !sound(module, input, "CH1_WAVES.2"), "{input}");
        }
    }
}

#[test]
fn what_is_an_integral_one_way_is_a_derivative_the_other() {
    let units = Unit::ALL.iter().copied().filter(|unit| *unit != Unit::Any);
    for (unit, other) in units.clone().flat_map(|unit| units.clone().map(move |other| (unit, other))) {
        assert_eq!(unit.integral() == Some(other), other.derivative() == Some(unit), "{unit:?}, {other:?}");
        assert!(
            UnitRelation::Same.accepts(unit, Unit::Any) && UnitRelation::Integral.accepts(Unit::Any, unit)
        );
    }
}

#[test]
fn a_module_whose_units_differ_is_not_plugged_into_a_running_scheme() {
    let mut bench = bilateral("");
    let before = bench.snapshot();
    bench.rows("SUM_MOD PORT_A POSITION\nSUM_MOD PORT_B DES_FORCE\nSUM_MOD PORT_SIGNAL_OUT FORCE.2");
    let refused = bench.order("MOD_ENG MOD_ON SUM_MOD");
    let Err(CommandError::BreaksScheme(Finding::UnitsDiffer { port: 1, other_port: 0, .. })) = refused else {
        panic!("{refused:?}")
    };
    assert!(bench.dimsart.engine().is_running());
    assert_eq!(bench.snapshot().steps, before.steps);
}

#[test]
fn two_modules_at_one_end_of_a_link_are_a_fault() {
    let two = "COMM_TXMOD CTX_ADD_DATA CH1_WAVES
         MOD_ENG MOD_ON COMM_TXMOD
         COMM_TXMOD.2 CTX_ADD_DATA CH1_WAVES";
    let mut bench = Bench::of(3, &[types::CH1_WAVES], &[]);
    bench.rows(two);
    bench.rows("MOD_ENG MOD_ON COMM_TXMOD.2\nMOD_ENG MOD_ON COMM_RXMOD");
    assert_eq!(
        bench.findings(),
        [
            "COMM_TXMOD and COMM_TXMOD.2 use the same end of link 0: set another link for one of the two, or unplug one"
        ]
    );
    // In a running scheme, both plugging it in and changing its link are refused.
    let mut bench = Bench::of(3, &[types::CH1_WAVES], &[]);
    bench.run(two);
    let refused = bench.order("MOD_ENG MOD_ON COMM_TXMOD.2");
    assert!(
        matches!(refused, Err(CommandError::BreaksScheme(Finding::DuplicateLinkEnd { link: 0, .. }))),
        "{refused:?}"
    );
    bench.rows("COMM_TXMOD.2 CTX_LINK 1\nMOD_ENG MOD_ON COMM_TXMOD.2");
    let refused = bench.order("COMM_TXMOD.2 CTX_LINK 0");
    assert_eq!(refused, Err(CommandError::Parameter(ParameterError::WhilePluggedIn)));
    bench.tick(&[1.0, 2.0, 3.0]);
    let sent = [0, 1].map(|link| bench.dimsart.take_outgoing(link).unwrap());
    assert_eq!(sent[0], sent[1]);
}

/// The bilateral scheme on the master, with extra rows before the transformer or controller is plugged in.
fn bilateral(first: &str) -> Bench {
    let mut bench = Bench::of(3, &[types::POSITION], &[types::DES_FORCE]);
    bench.rows(first);
    assert_eq!(
        load(&mut bench.dimsart, include_str!("../../../schemes/bilateral.scheme"), "master"),
        [""; 0]
    );
    bench
}

#[test]
fn the_late_stage_of_the_transformer_follows_the_force_in_every_form() {
    let order = [
        "COMM_RXMOD Early",
        "WTRANSF_MOD Early",
        "PDCTRL_MOD Early",
        "WTRANSF_MOD Late",
        "TIMEDELAY_MOD Early",
        "COMM_TXMOD Early",
    ];
    let delays: [(&str, &[(&str, &str)]); 3] = [
        ("WTRANSF_MOD FORM SPLIT", &[]),
        (
            "WTRANSF_MOD FORM IMPLICIT\nPDCTRL_MOD LAW_OUTPUT ON",
            &[
                ("WTRANSF_MOD reads CONTROL_STIFFNESS", "PDCTRL_MOD"),
                ("WTRANSF_MOD reads CONTROL_MEMORY", "PDCTRL_MOD"),
            ],
        ),
        ("WTRANSF_MOD FORM PRINTED", &[("PDCTRL_MOD reads DES_POSITION", "WTRANSF_MOD")]),
    ];
    for (rows, delays) in delays {
        let bench = bilateral(rows);
        assert_eq!(bench.steps(), order, "{rows}");
        let expected: Vec<_> = delays
            .iter()
            .map(|(reads, writer)| {
                format!("{reads} before {writer} writes it, so the value is one tick old (declared)")
            })
            .collect();
        assert_eq!(bench.findings(), expected, "{rows}");
        assert!(bench.dimsart.engine().is_running());
    }
}

#[test]
fn the_late_stage_waits_for_the_last_writer_of_what_it_reads() {
    let mut bench = Bench::of(3, &[types::POSITION, types::CH2_WAVES], &[types::DES_FORCE]);
    bench.run(
        "MOD_ENG MOD_ON WTRANSF_MOD
         PDCTRL_MOD PORT_DES_FORCE FORCE.2
         MOD_ENG MOD_ON PDCTRL_MOD
         VWALL_MOD PORT_DES_FORCE FORCE.3
         MOD_ENG MOD_ON VWALL_MOD
         SUM_MOD PORT_A FORCE.2
         SUM_MOD PORT_B FORCE.3
         SUM_MOD PORT_SIGNAL_OUT DES_FORCE
         MOD_ENG MOD_ON SUM_MOD
         RECORDER_MOD PORT_SIGNAL_IN CH1_WAVES
         MOD_ENG MOD_ON RECORDER_MOD",
    );
    assert_eq!(
        bench.steps(),
        [
            "WTRANSF_MOD Early",
            "PDCTRL_MOD Early",
            "VWALL_MOD Early",
            "SUM_MOD Early",
            "WTRANSF_MOD Late",
            "RECORDER_MOD Early"
        ]
    );
}

#[test]
fn a_loop_within_the_tick_is_a_fault() {
    let mut bench = Bench::of(3, &[types::POSITION, types::CH2_WAVES], &[]);
    bench.rows("WTRANSF_MOD PORT_DES_FORCE LINE_FORCE\nMOD_ENG MOD_ON WTRANSF_MOD");
    assert_eq!(
        bench.findings(),
        ["WTRANSF_MOD reads LINE_FORCE before WTRANSF_MOD writes it, so the value is one tick old: \
         bind one of the module's ports to another signal (PORT_... command)"]
    );
}

#[test]
fn the_implicit_form_needs_the_law_of_a_controller() {
    let mut bench = Bench::of(3, &[types::POSITION, types::CH2_WAVES], &[types::DES_FORCE]);
    bench.rows("WTRANSF_MOD FORM IMPLICIT\nMOD_ENG MOD_ON WTRANSF_MOD\nMOD_ENG MOD_ON PDCTRL_MOD");
    assert_eq!(
        bench.findings(),
        ["CONTROL_STIFFNESS", "CONTROL_MEMORY"].map(|signal| {
            format!(
                "WTRANSF_MOD reads {signal}, which has no provider: plug in a module that writes {signal}"
            )
        })
    );
}

/// Signals that are not written exactly once and read afterwards, searched one by one in the order of the
/// tick.
fn out_of_order(engine: &Engine) -> BTreeSet<u16> {
    let of_frame = |types: &[&DataType], direction| {
        types.iter().map(|data_type| (data_type.first(), direction)).collect::<Vec<_>>()
    };
    let mut calls = vec![of_frame(engine.device().outputs, Direction::Write)];
    calls.extend(engine.steps().map(|step| engine.step_signals(step).collect()));
    calls.push(of_frame(engine.device().inputs, Direction::Read));
    let signals = engine.data_base().signals().map(|(_, entry)| entry.signal);
    let is_wrong = |signal: &dimsart_core::TypeRef| {
        let places = |wanted: Direction| -> Vec<usize> {
            let uses =
                calls.iter().enumerate().flat_map(|(place, call)| call.iter().map(move |of| (place, of)));
            uses.filter(|(_, of)| **of == (*signal, wanted)).map(|(place, _)| place).collect()
        };
        let (writes, reads) = (places(Direction::Write), places(Direction::Read));
        let first = writes.first().copied().unwrap_or(usize::MAX);
        writes.len() > 1 || reads.iter().any(|read| *read <= first)
    };
    signals.filter(is_wrong).map(|signal| signal.id).collect()
}

#[test]
fn whatever_is_plugged_in_each_signal_out_of_order_is_named_and_no_other() {
    let mut random = rand_pcg::Pcg32::seed_from_u64(11);
    let (mut dimsart, mut seen) = (robot(), [0; 3]);
    for _ in 0..5_000 {
        let kind = random.next_u32() as usize % ALL.list().len();
        let module = module_at(kind, u8::try_from(random.next_u32() % 2 + 1).unwrap());
        let is_off = random.next_u32() % 5 < 2;
        // A command that does not fit is refused and changes nothing.
        let _ = dimsart.command(if is_off { Command::Unplug(module) } else { Command::PlugIn(module) });
        let report = dimsart.engine().check();
        if report.unlisted() > 0 {
            continue;
        }
        let named = report.findings().iter().filter_map(|finding| {
            let (kind, signal) = match finding {
                Finding::NoWriter { signal, .. } => (0, signal),
                Finding::MultipleWriters { signal, .. } => (1, signal),
                Finding::Delay { signal, .. } => (2, signal),
                _ => return None,
            };
            seen[kind] += 1;
            Some(signal.id)
        });
        assert_eq!(named.collect::<BTreeSet<_>>(), out_of_order(dimsart.engine()));
    }
    assert!(seen.iter().all(|count| *count > 100), "{seen:?}");
}
