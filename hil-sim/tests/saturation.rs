//! Actuators at their range and rate: what they get, how controllers recover, and what a run reports.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use hil_sim::experiment::{self, Run};
use hil_sim::rig_file::RigFile;

/// The shipped joint's gains with another row instead of its limit, of 24 N m by its motor: it is to go to 4 rad for 6 s, with
/// a stop at 3 rad, then to 0.5 rad.
fn against_the_stop(row: &str) -> Run {
    let rig = include_str!("../../scenarios/joint.toml");
    let (rig, _) = rig.split_once("[[experiment.move]]").unwrap();
    let moves = "[[experiment.move]]
        device = \"joint\"
        on = \"DES_POSITION\"
        step = { at_s = 0.1, amplitude = 4.0 }
        [[experiment.move]]
        device = \"joint\"
        on = \"DES_POSITION\"
        step = { at_s = 6.0, amplitude = -3.5 }";
    let rig = rig.replace("duration_s = 1.6", "duration_s = 8.0").replace("builtin:joint", "law.scheme");
    let limit = "all     PIDCTRL_MOD  LIMIT           20";
    let scheme = include_str!("../../schemes/joint.scheme");
    assert!(scheme.contains(limit));
    run(&format!("{rig}{moves}"), &scheme.replace(limit, row))
}

fn run(rig: &str, scheme: &str) -> Run {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("law.scheme"), scheme).unwrap();
    experiment::run(&RigFile::read(rig, "test", folder.path().to_owned(), &[]).unwrap()).unwrap()
}

fn column(run: &Run, group: &str, name: &str) -> Vec<f64> {
    run.recording.column(run.recording.find(group, name, Some(0)).unwrap()).collect()
}

/// From the step back until it has left the stop by 0.1 rad, `s`.
fn recovery_s(run: &Run) -> f64 {
    let position = column(run, "world", "joint.position");
    let left = position.iter().skip(6000).position(|position| *position < 2.9).unwrap();
    f64::from(u32::try_from(left).unwrap()) * 1e-3
}

#[test]
fn a_controller_recovers_from_the_limit_of_its_motor_as_from_its_own_and_the_run_reports_it() {
    let (declared, own) = (against_the_stop(""), against_the_stop("all PIDCTRL_MOD LIMIT 24"));
    let [found_s, expected_s] = [&declared, &own].map(recovery_s);
    // 2.03 s without tracking of the motor's limit.
    assert!(found_s < 0.1 && (found_s - expected_s).abs() < 0.005, "{found_s} s, {expected_s} s");
    let commands = column(&declared, "joint", "DES_FORCE");
    let beyond = commands.iter().filter(|force| force.abs() > 24.0).count();
    let [saturated] = &declared.outcome.saturated[..] else { panic!("{:?}", declared.outcome.saturated) };
    assert_eq!((saturated.device.as_str(), saturated.axis), ("joint", 0));
    assert!(
        (saturated.time_s - 1e-3 * f64::from(u32::try_from(beyond).unwrap())).abs() < 2e-3,
        "{saturated:?}"
    );
    assert!((5.0..7.0).contains(&saturated.time_s), "{saturated:?}");
    assert_eq!(own.outcome.saturated, []);
}

#[test]
fn a_rig_declares_range_and_rate_of_an_actuator() {
    let rig = |actuator: &str| {
        format!(
            r#"
            duration_s = 1.0
            [[device]]
            name = "joint"
            measures = ["POSITION", "DES_POSITION"]
            [[device.axis]]
            {actuator}
            plant.load = {{ inertia = 0.05, damping = 0.1 }}
            [[controller]]
            device = "joint"
            scheme = "law.scheme"
            [[experiment.move]]
            device = "joint"
            on = "DES_POSITION"
            step = {{ at_s = 0.1, amplitude = 0.5 }}
            "#
        )
    };
    let scheme = "all PIDCTRL_MOD K_PARAM 150\nall PIDCTRL_MOD D_PARAM 6\nall PIDCTRL_MOD I_PARAM 300\n\
                  all PIDCTRL_MOD FILTER_TIME 0.001\nall MOD_ENG MOD_ON PIDCTRL_MOD\nall MOD_ENG MATCHING_CHECK";
    let limited = run(&rig("actuator = { max_force = 20.0, max_rate = 2000.0 }"), scheme);
    let given = column(&limited, "world", "joint.actuator_force");
    let changes = given.iter().zip(given.iter().skip(1)).map(|(last, force)| (force - last).abs());
    let peak = given.iter().fold(0.0_f64, |peak, force| force.abs().max(peak));
    assert!((19.999..=20.001).contains(&peak), "{peak}");
    assert!(changes.fold(0.0, f64::max) < 2.001);
    assert!(limited.outcome.stable && limited.outcome.saturated.len() == 1, "{:?}", limited.outcome);
    assert_eq!(run(&rig(""), scheme).outcome.saturated, []);
    let folder = tempfile::tempdir().unwrap();
    for actuator in ["actuator.max_force = 0.0", "actuator.max_rate = nan"] {
        let wrong = RigFile::read(&rig(actuator), "test", folder.path().to_owned(), &[]).unwrap_err();
        assert!(wrong.to_string().contains("device 'joint', axis 0: actuator.max_"), "{wrong}");
    }
}
