//! The laws that ship, against the same in Rust.

use hil_sim::law::Law;

use super::{controller, keep, run, tick};

/// Measurements of a tick: positions, velocities, desired positions of two axes.
fn measured(tick: u16) -> [f32; 6] {
    let t = f32::from(tick) * 1e-3;
    let [p, q] = [(7.0 * t).sin(), (11.0 * t).cos() * 0.7];
    [p, q, 7.0 * (7.0 * t).cos(), -7.7 * (11.0 * t).sin(), 0.3, if tick > 400 { -0.5 } else { 0.5 }]
}

fn compile(text: &str) -> Law {
    Law::compile(text, "law").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_pd_with_a_notch_is_the_one_in_rust_bit_by_bit() {
    let law = compile(include_str!("../../../laws/pd-with-notch.law"));
    let mut dimsart = controller(2);
    run(&mut dimsart, &law, &[(1, Some(1), 250.0), (3, None, 40.0)]);
    let mut states = [[0.0_f32; 4]; 2];
    for number in 0..1000 {
        let measured = measured(number);
        let found = tick(&mut dimsart, &measured);
        for (axis, found) in found.into_iter().enumerate() {
            let [x, v, desired] = [0, 2, 4].map(|from| measured[from + axis]);
            let stiffness = if axis == 1 { 250.0 } else { 100.0 };
            let [x1, x2, y1, y2] = states[axis];
            let wanted = stiffness * (desired - x) - 2.0 * v;
            let w = core::f32::consts::PI * 1e-3 * 40.0;
            let even = 1.0 + w * w;
            let odd = 2.0 * (w * w - 1.0);
            let share = 0.5 * w;
            let force = (even * (wanted + x2) + odd * (x1 - y1) - (even - share) * y2) / (even + share);
            states[axis] = [wanted, x1, force, y1];
            assert_eq!(found.to_bits(), force.to_bits(), "tick {number}, axis {axis}: {found} {force}");
        }
    }
}

#[test]
fn the_spring_with_hysteresis_begins_where_it_stands_and_holds_what_its_friction_took() {
    let law = compile(include_str!("../../../laws/spring-with-hysteresis.law"));
    let mut dimsart = controller(1);
    run(&mut dimsart, &law, &[]);
    assert_eq!(tick(&mut dimsart, &[0.2, 0.0, 0.0]), [0.0], "it begins where it stands");
    for position in [0.21, 0.22, 0.23, 0.24] {
        tick(&mut dimsart, &[position, 0.0, 0.0]);
    }
    let up = tick(&mut dimsart, &[0.25, 0.0, 0.0])[0];
    let back = tick(&mut dimsart, &[0.2499, 0.0, 0.0])[0];
    for position in [0.28, 0.30, 0.28, 0.26] {
        tick(&mut dimsart, &[position, 0.0, 0.0]);
    }
    let down = tick(&mut dimsart, &[0.25, 0.0, 0.0])[0];
    assert!((up - -6.0).abs() < 1e-3, "100 of the spring times 0.05, and 1 of the friction: {up}");
    assert!((back - -5.79).abs() < 1e-2, "0.2 of the friction let go, 0.01 of the spring: {back}");
    assert!((down - -4.0).abs() < 1e-3, "the same place from the other side: {down}");
}

#[test]
fn the_weight_of_two_links_is_what_lagrange_says() {
    let law = compile(include_str!("../../../laws/gravity-of-two-links.law"));
    let mut dimsart = controller(2);
    run(&mut dimsart, &law, &[(1, Some(1), 2.0)]);
    for number in 0..500 {
        let measured = measured(number);
        let found = tick(&mut dimsart, &measured);
        let [p, q] = [f64::from(measured[0]), f64::from(measured[1])];
        let second = 2.0 * 9.81 * 0.15 * (p + q).cos();
        let first = (1.0 * 0.15 + 2.0 * 0.3) * 9.81 * p.cos() + second;
        // Cosines are good to 0.002.
        assert!((f64::from(found[0]) - first).abs() < 0.03, "{found:?} {first}");
        assert!((f64::from(found[1]) - second).abs() < 0.01, "{found:?} {second}");
    }
}

#[test]
fn a_law_takes_over_without_a_step() {
    let text =
        "law HOLD\nin position: POSITION\nout force: DES_FORCE\nstate held = last(force)\nforce = held";
    let law = compile(text);
    let mut dimsart = controller(1);
    let rows = "all PCTRL_MOD K_PARAM 10\nall MOD_ENG MOD_ON PCTRL_MOD\nall MOD_ENG MATCHING_CHECK";
    dimsart_core::scheme::load(rows, "all", &[], &mut dimsart, |error| panic!("{error:?}"));
    let before = tick(&mut dimsart, &[0.2, 0.0, 0.5]);
    keep(&mut dimsart, 2, &law);
    let rows = "all MOD_ENG BEGIN\nall ONLINE_MOD PROGRAM 2\nall MOD_ENG MOD_OFF PCTRL_MOD\nall MOD_ENG MOD_ON ONLINE_MOD\n\
                all MOD_ENG COMMIT";
    dimsart_core::scheme::load(rows, "all", &[], &mut dimsart, |error| panic!("{error:?}"));
    assert_eq!(tick(&mut dimsart, &[0.1, 0.0, 0.5]), before);
}

#[test]
fn a_law_says_its_names_by_its_program() {
    let law = compile(include_str!("../../../laws/pd-with-notch.law"));
    let mut bare = law.clone();
    bare.summary.clear();
    bare.parameters.iter_mut().for_each(|parameter| parameter.summary.clear());
    assert_eq!(Law::from_program(&law.program().unwrap()), bare);
}
