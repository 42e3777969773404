//! Friction hunting: the report on a joint that never comes to rest, compared with its recorded position.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use hil_sim::experiment::{self, Run};
use hil_sim::rig_file::RigFile;

fn run(plant: &str, [k, i, d]: [f64; 3], duration_s: f64) -> Run {
    let text = format!(
        r#"
        duration_s = {duration_s}
        [[device]]
        name = "drive"
        measures = ["POSITION", "DES_POSITION"]
        [[device.axis]]
        {plant}
        [[controller]]
        device = "drive"
        scheme = "law.scheme"
        [experiment]
        margins = false
        [[experiment.move]]
        device = "drive"
        on = "DES_POSITION"
        step = {{ at_s = 0.1, amplitude = 0.5 }}
        "#
    );
    let rows = format!(
        "all PIDCTRL_MOD K_PARAM {k}\nall PIDCTRL_MOD I_PARAM {i}\nall PIDCTRL_MOD D_PARAM {d}\n\
         all PIDCTRL_MOD FILTER_TIME 0.001\nall MOD_ENG MOD_ON PIDCTRL_MOD\nall MOD_ENG MATCHING_CHECK"
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("law.scheme"), rows).unwrap();
    experiment::run(&RigFile::read(&text, "test", folder.path().to_owned(), &[]).unwrap()).unwrap()
}

/// Width of the recorded position over a part of the run.
#[expect(clippy::cast_possible_truncation, reason = "a share of a few thousand")]
fn width(run: &Run, from: f64, to: f64) -> f64 {
    let place = run.recording.find("world", "drive.position", Some(0)).unwrap();
    let positions: Vec<f64> = run.recording.column(place).collect();
    let at = |share: f64| (share * positions.len() as f64) as usize;
    let part = &positions[at(from)..at(to)];
    part.iter().copied().fold(f64::MIN, f64::max) - part.iter().copied().fold(f64::MAX, f64::min)
}

/// Sticks for 5 s at each end, where its gear rings.
const HUNTING: &str = "plant.load = { inertia = 0.2303, damping = 0.1753 }
    plant.gear = { ratio = 49.56, inertia_kg_m2 = 1.658e-5 }
    plant.flexible = { stiffness = 2782.2, damping = 1.96 }
    plant.friction = { coulomb = 1.1343, breakaway = 2.2391, stribeck_velocity = 0.091 }";

#[test]
fn a_joint_that_hunts_by_friction_is_reported_with_amplitude_and_frequency() {
    let run = run(HUNTING, [25.404, 33.859, 3.0309], 60.0);
    let outcome = &run.outcome;
    assert!(!outcome.stable && outcome.undecided.is_empty(), "{outcome:?}");
    let cycle = &outcome.limit_cycles[0];
    assert!((2.0 * cycle.amplitude / width(&run, 0.75, 1.0) - 1.0).abs() < 0.01, "{cycle:?}");
    assert!((0.08..0.12).contains(&cycle.hz), "{cycle:?}");
}

#[test]
fn a_run_too_short_to_decide_says_so_and_how_long_it_should_last() {
    let run = run(HUNTING, [25.404, 33.859, 3.0309], 30.0);
    let outcome = &run.outcome;
    assert!(!outcome.stable && outcome.faults.is_empty() && outcome.limit_cycles.is_empty(), "{outcome:?}");
    let needed = outcome.undecided[0].split("duration_s to ").nth(1).unwrap();
    let needed: f64 = needed.split(' ').next().unwrap().parse().unwrap();
    assert!((40.0..120.0).contains(&needed), "{outcome:?}");
}

/// Joints with dry friction or bristles, rigid and flexible, under random PID: one whose recorded position keeps moving by a
/// hundredth of its step is never reported as stable, and one that rests is.
#[test]
fn random_joints_with_friction_are_stable_when_and_only_when_they_come_to_rest() {
    let mut state = 5_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let (mut hunting, mut resting) = (0, 0);
    for _ in 0..14 {
        let mut between = |from: f64, to: f64| from * (to / from).powf(uniform());
        let inertia = between(0.02, 0.4);
        let natural = between(8.0, 30.0);
        let stiffness = inertia * natural * natural;
        let gains = [stiffness, stiffness * between(0.5, 4.0), 2.0 * between(0.4, 1.0) * inertia * natural];
        let coulomb = 0.5 * stiffness * between(0.02, 0.2);
        let breakaway = coulomb * between(1.2, 2.2);
        let presliding = match between(1.0, 10.0) > 5.0 {
            true => format!(
                ", presliding_stiffness = {}, presliding_damping = {}",
                200.0 * breakaway,
                2.0 * breakaway
            ),
            false => String::new(),
        };
        let flexible = match between(1.0, 10.0) > 4.0 {
            true => format!(
                "plant.flexible = {{ stiffness = {}, damping = {} }}\n",
                60.0 * stiffness,
                0.05 * stiffness.sqrt()
            ),
            false => String::new(),
        };
        let plant = format!(
            "plant.load = {{ inertia = {inertia}, damping = {} }}\nplant.gear = {{ ratio = 50.0, inertia_kg_m2 = {} }}\n{flexible}\
             plant.friction = {{ coulomb = {coulomb}, breakaway = {breakaway}, stribeck_velocity = {}{presliding} }}",
            0.2 * inertia,
            0.3 * inertia / 2500.0,
            between(0.02, 0.1)
        );
        let run = run(&plant, gains, 60.0);
        let [before, last] = [width(&run, 0.5, 0.75), width(&run, 0.75, 1.0)];
        let outcome = &run.outcome;
        println!(
            "{before:.4} {last:.4} {} {:?} {:?}",
            outcome.stable, outcome.limit_cycles, outcome.undecided
        );
        if last >= 0.9 * before && last > 0.012 {
            hunting += 1;
            assert!(!outcome.stable, "{before} {last}: {plant} {gains:?} {outcome:?}");
        } else if last < 1e-4 {
            resting += 1;
            assert!(outcome.stable, "{before} {last}: {plant} {gains:?} {outcome:?}");
        }
    }
    assert!(hunting >= 3 && resting >= 2, "{hunting} hunt, {resting} rest");
}
