//! Wave variables: power in every tick, and line transients as in theory, to the tick.
#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, clippy::float_cmp, reason = "rounded and compared on purpose")]

use crate::common::{self, Bench, DelayedLink, H, assert_close};
use dimsart_core::{Context, Input, Module, ModuleKinds, Output, Unit, types, words};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Response of a load of impedance Z to a wave: `v = a u / (b + Z)`, `F = Z v`, `out = u - 2 F / a`.
#[derive(Debug)]
struct Resistor;

words! {
    parameters Settings {
        /// Wave impedance.
        impedance: f32 = real("B_PARAM", Unit::Damping, 1e-3..=1e4, 10.0),
        /// Damper.
        load: f32 = real("Z_PARAM", Unit::Damping, 0.0..=1e6, 0.0),
    }
    ports Ports {
        waves_in: Input = input("WAVES_IN", types::CH2_WAVES),
        waves_out: Output = output("WAVES_OUT", types::CH1_WAVES),
        velocity: Output = output("LINE_VELOCITY", types::LINE_VELOCITY),
    }
}

impl Module for Resistor {
    const NAME: &'static str = "RESISTOR_MOD";
    const SUMMARY: &'static str = "A damper at the end of the line.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn compute(context: &Context<'_, Self>) {
        let Ports { waves_in, waves_out, velocity } = context.ports();
        let Settings { impedance: b, load: z } = context.settings();
        let a = (2.0 * b).sqrt();
        context.map_axes([waves_in], [waves_out, velocity], |(), (), [wave]| {
            let velocity = a * wave / (b + z);
            [wave - 2.0 / a * z * velocity, velocity]
        });
    }
}

const SLAVES: ModuleKinds = dimsart_core::kinds![
    dimsart_modules::CommRx,
    dimsart_modules::CommTx,
    dimsart_modules::WaveTransformer,
    dimsart_modules::WaveImpedance,
    dimsart_modules::SignalGenerator,
    Resistor
];

const B: f64 = 10.0;
const V: f64 = 0.2;
const DELAYS: [(usize, usize); 4] = [(1, 1), (10, 10), (3, 8), (40, 4)];

/// A controller at one end of the line, with these modules between receiver and sender.
fn end(kinds: ModuleKinds, outputs: common::Types, modules: &str) -> Bench {
    let mut bench = Bench::with_kinds(kinds, 3, outputs, &[]);
    bench.run(&format!(
        "COMM_RXMOD TIMEOUT_TICKS 0\nCOMM_RXMOD CRX_ADD_DATA CH2_WAVES\nMOD_ENG MOD_ON COMM_RXMOD\n{modules}\n\
         COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD"
    ));
    bench
}

/// A velocity step at the master; returns force at the master and velocity at the slave, by tick.
fn step_response(slave: &str, (forward, backward): (usize, usize)) -> Vec<[f64; 2]> {
    let mut master = end(ALL, &[types::VELOCITY], "MOD_ENG MOD_ON WIMPEDANCE_MOD");
    let mut slave = end(SLAVES, &[types::VELOCITY], slave);
    let (mut there, mut back) = (DelayedLink::new(forward), DelayedLink::new(backward));
    let step = |tick| {
        back.deliver(tick, &mut master.dimsart);
        master.tick(&[V as f32; 3]);
        there.send(tick, &mut master.dimsart);
        there.deliver(tick, &mut slave.dimsart);
        slave.tick(&[0.0; 3]);
        back.send(tick, &mut slave.dimsart);
        let force = master.signal("DES_FORCE");
        assert!(force.iter().all(|axis| *axis == force[0]), "all axes are alike");
        let has_velocity = slave.dimsart.engine().data_base().slot(types::LINE_VELOCITY.first()).is_some();
        let velocity = if has_velocity { slave.signal("LINE_VELOCITY")[0] } else { 0.0 };
        [-f64::from(force[0]), f64::from(velocity)]
    };
    (0..2000).map(step).collect()
}

#[test]
fn a1_a_clamped_slave_pushes_back_in_steps_of_twice_the_wave() {
    for (n1, n2) in DELAYS {
        let response = step_response("MOD_ENG MOD_ON WIMPEDANCE_MOD", (n1, n2));
        for (tick, [force, _]) in response.into_iter().enumerate() {
            let expected = B * V * (1.0 + 2.0 * (tick / (n1 + n2)) as f64);
            assert!((force - expected).abs() < 1e-4 * expected, "{n1}+{n2}, {tick}: {force} {expected}");
        }
    }
}

#[test]
fn a2_a_free_slave_gives_the_wave_back_with_alternating_sign() {
    // A zero generator is the force; another one is the transformer's initial position.
    let free = "SIGGEN_MOD PORT_SIGNAL_OUT DES_FORCE\nMOD_ENG MOD_ON SIGGEN_MOD\n\
        SIGGEN_MOD.2 PORT_SIGNAL_OUT POSITION\nMOD_ENG MOD_ON SIGGEN_MOD.2\n\
        WTRANSF_MOD CONF_MODE SLAVE\nMOD_ENG MOD_ON WTRANSF_MOD";
    for (n1, n2) in DELAYS {
        for (tick, [force, velocity]) in step_response(free, (n1, n2)).into_iter().enumerate() {
            let bounces = tick / (n1 + n2);
            let expected = if bounces % 2 == 0 { B * V } else { -B * V };
            assert!((force - expected).abs() < 1e-4 * B * V, "{n1}+{n2}, {tick}: {force} {expected}");
            // At the slave: zero before the first wave, then twice the speed in every other round trip.
            let is_moving = tick >= n1 && ((tick - n1) / (n1 + n2)) % 2 == 0;
            let expected = if is_moving { 2.0 * V } else { 0.0 };
            assert!((velocity - expected).abs() < 1e-4 * V, "{n1}+{n2}, {tick}: {velocity} {expected}");
        }
    }
}

#[test]
fn a3_a_damper_is_perceived_after_a_geometric_series_of_bounces() {
    for z in [1.0, 4.0, 25.0, 200.0] {
        for (n1, n2) in DELAYS {
            let slave = format!("RESISTOR_MOD Z_PARAM {z}\nMOD_ENG MOD_ON RESISTOR_MOD");
            let reflection = (B - z) / (B + z);
            for (tick, [force, _]) in step_response(&slave, (n1, n2)).into_iter().enumerate() {
                let bounces = i32::try_from(tick / (n1 + n2)).unwrap();
                let expected = z * V + (B - z) * V * (-reflection).powi(bounces);
                let scale = expected.abs().max(z * V);
                assert!(
                    (force - expected).abs() < 1e-4 * scale,
                    "Z {z}, {n1}+{n2}, {tick}: {force} {expected}"
                );
            }
        }
    }
}

#[test]
fn a4_a_matched_damper_is_perceived_at_once_and_moves_after_exactly_the_forward_delay() {
    for (n1, n2) in DELAYS {
        let slave = format!("RESISTOR_MOD Z_PARAM {B}\nMOD_ENG MOD_ON RESISTOR_MOD");
        for (tick, [force, velocity]) in step_response(&slave, (n1, n2)).into_iter().enumerate() {
            assert!((force - B * V).abs() < 1e-4 * B * V, "{n1}+{n2}, {tick}: {force}");
            let expected = if tick < n1 { 0.0 } else { V };
            assert!((velocity - expected).abs() < 1e-4 * V, "{n1}+{n2}, {tick}: {velocity}");
        }
    }
}

/// Runs a transformer with a PD in one form on noise; returns the results of `look` for each tick.
fn transformer(rows: &str, mut look: impl FnMut(&Bench, [f32; 2])) {
    let mut bench = Bench::of(1, &[types::POSITION, types::CH2_WAVES], &[types::DES_FORCE]);
    bench.run(&format!(
        "WTRANSF_MOD B_PARAM 7\n{rows}\nMOD_ENG MOD_ON WTRANSF_MOD\nPDCTRL_MOD K_PARAM 2000\n\
         PDCTRL_MOD D_PARAM 0.5\nMOD_ENG MOD_ON PDCTRL_MOD"
    ));
    let mut random = Pcg32::seed_from_u64(6);
    for _ in 0..5000 {
        let position = 1e-3 * (f64::from(random.next_u32()) / 4_294_967_296.0) as f32;
        let wave = 3.0 * ((f64::from(random.next_u32()) / 2_147_483_648.0) as f32 - 1.0);
        bench.tick(&[position, wave]);
        look(&bench, [position, wave]);
    }
}

const FORMS: [&str; 3] = [
    "WTRANSF_MOD FORM SPLIT",
    "WTRANSF_MOD FORM IMPLICIT\nPDCTRL_MOD LAW_OUTPUT ON",
    "WTRANSF_MOD FORM PRINTED",
];

#[test]
fn power_at_the_port_is_half_the_difference_of_squared_waves_in_every_form_and_mode() {
    for form in FORMS {
        for (mode, sign) in [("MASTER", -1.0), ("SLAVE", 1.0)] {
            transformer(&format!("{form}\nWTRANSF_MOD CONF_MODE {mode}"), |bench, [_, wave]| {
                let value = |name| f64::from(bench.signal(name)[0]);
                assert_eq!(value("LINE_FORCE"), sign * value("DES_FORCE"), "of the actual force command");
                let power = value("DES_FORCE") * value("LINE_VELOCITY");
                let (coming, going) = (f64::from(wave).powi(2) / 2.0, value("CH1_WAVES").powi(2) / 2.0);
                let error = (power - (coming - going)).abs();
                assert!(error <= 4e-6 * (coming + going), "{form} {mode}: {power} {coming} {going}");
            });
        }
    }
}

#[test]
fn the_desired_position_moves_at_the_speed_of_the_line() {
    // If the loop is closed without delay, the port moves exactly as the waves. In its first tick the
    // implicit form does not know the controller's law yet; it compensates later.
    for (form, settled) in [(FORMS[1], 1), (FORMS[2], 0)] {
        let (mut expected, mut tick) = (None, 0);
        transformer(form, |bench, [position, _]| {
            let value = |name| f64::from(bench.signal(name)[0]);
            let expected = expected.get_or_insert(f64::from(position));
            *expected += f64::from(H) * value("LINE_VELOCITY");
            let error = (value("DES_POSITION") - *expected).abs();
            assert!(tick < settled || error < 1e-6, "{form}, {tick}: off by {error} m");
            tick += 1;
        });
    }
}

#[test]
fn the_desired_position_starts_at_the_device_in_every_form() {
    for form in FORMS {
        let mut bench = Bench::of(1, &[types::POSITION, types::CH2_WAVES], &[types::DES_FORCE]);
        bench.run(&format!(
            "{form}\nMOD_ENG MOD_ON WTRANSF_MOD\nPDCTRL_MOD K_PARAM 5000\nMOD_ENG MOD_ON PDCTRL_MOD"
        ));
        for _ in 0..3 {
            assert_eq!(bench.tick(&[0.75, 0.0]), [0.0], "{form}: no wave, no force");
            assert_eq!(bench.signal("DES_POSITION"), [0.75]);
        }
        // Moved by hand, then reset: the new position counts.
        bench.rows("MOD_ENG RESET");
        assert_eq!(bench.tick(&[0.5, 0.0]), [0.0], "{form}: a reset drops the old position");
    }
}

#[test]
fn the_split_form_settles_where_the_waves_are() {
    // A constant wave onto a clamped device: it pushes until F = a u, at K (x_d - x).
    let mut bench = Bench::of(1, &[types::POSITION, types::CH2_WAVES], &[types::DES_FORCE]);
    bench.run(
        "MOD_ENG MOD_ON WTRANSF_MOD\nPDCTRL_MOD K_PARAM 3000\nMOD_ENG MOD_ON PDCTRL_MOD\n\
         WTRANSF_MOD B_PARAM 10",
    );
    let a = 20.0_f64.sqrt();
    let mut carried = 0.25;
    for tick in 0..1000 {
        let force = f64::from(bench.tick(&[0.25, 0.5])[0]);
        carried += f64::from(H) * f64::from(bench.signal("LINE_VELOCITY")[0]);
        if tick > 500 {
            assert_close(force, a * 0.5, 1e-4);
            assert!((carried - 0.25 - force / 3000.0).abs() < 1e-6, "{carried}");
            assert!((f64::from(bench.signal("CH1_WAVES")[0]) + 0.5).abs() < 1e-4, "everything is reflected");
        }
    }
}
