//! Unbounded growth is reported with its rate, at the latest when it leaves its range, without false alarms.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::sync::atomic::AtomicBool;

use hil_sim::experiment::Experiment;
use hil_sim::observer::watch::{Alarm, FaultMonitor, Ranges};
use hil_sim::outcome::{LinearLoop, Outcome};
use hil_sim::rig::Rig;

use crate::loops::{bilateral, delays};
use crate::stability::{held, nudge};

fn outcome(settings: &str) -> Outcome {
    let experiment = Experiment::new(&bilateral(settings)).unwrap();
    experiment.without_recording().run(&AtomicBool::new(false), |_| ()).outcome
}

/// Returns the first alarm within `ticks`.
fn alarm(rig: &mut Rig, limits: Ranges, ticks: u64) -> Option<Alarm> {
    let mut watch = FaultMonitor::new(rig, [limits; 2]);
    (0..ticks).find_map(|_| {
        rig.tick();
        let alarm = watch.check(rig);
        rig.advance();
        alarm
    })
}

/// The unstable loops of `stability.rs`: settings, contact, growth per tick.
fn unstable() -> Vec<(String, bool, f64)> {
    let mut loops = Vec::new();
    for (ticks, growth) in
        [(1, 1.40097), (2, 1.20220), (5, 1.08118), (10, 1.04063), (20, 1.02032), (50, 1.00813)]
    {
        for in_contact in [false, true] {
            loops.push((format!("wave.form=printed {}", delays(ticks, ticks)), in_contact, growth));
        }
    }
    for (ticks, in_contact, growth) in [(4, false, 1.004032), (2, true, 1.002652)] {
        let link = format!("link.forward_delay_ticks={ticks} link.backward_delay_ticks={ticks}");
        let scheme = "master.scheme=builtin:position_position slave.scheme=builtin:position_position";
        loops.push((format!("{scheme} {link}"), in_contact, growth));
    }
    loops
}

#[test]
fn what_flies_apart_is_told_before_or_when_it_leaves_its_range() {
    let limits = bilateral("").devices[0].ranges();
    for (settings, in_contact, _) in unstable() {
        let alarm = alarm(&mut held(&settings, in_contact, nudge()), limits, 2000);
        println!("{settings}, contact {in_contact}: {alarm:?}");
        assert!(alarm.is_some(), "{settings}, contact {in_contact}");
    }
}

/// With wide ranges, growth is detected first. Growth above 15 % per tick leaves any range before detection
/// is certain.
#[test]
fn growth_is_told_with_its_rate() {
    let limits = Ranges { position: 1e30, force: 1e9, max_force: [1e9; 8], wave: 1e9 };
    for (settings, in_contact, expected) in unstable().into_iter().filter(|(.., growth)| *growth < 1.15) {
        let alarm = alarm(&mut held(&settings, in_contact, nudge()), limits, 20_000);
        let Some(Alarm::Growth(text)) = &alarm else { panic!("{settings}, contact {in_contact}: {alarm:?}") };
        let (_, rate) = text.split_once("by a factor of ").unwrap();
        let growth: f64 = rate.split(' ').next().unwrap().parse().unwrap();
        println!("{settings}, contact {in_contact}: {text}");
        assert!((growth - expected).abs() < 0.2 * (expected - 1.0), "{text} instead of {expected}");
    }
}

#[test]
fn a_run_that_ends_before_its_range_is_left_is_not_stable_all_the_same() {
    let outcome = outcome("wave.form=printed duration_s=0.4 dof=3");
    assert!(!outcome.stable && outcome.ticks == 400);
    // After the known faults of its linear loops, each of which grows.
    let [_, _, _, fault] = outcome.faults.as_slice() else { panic!("{:?}", outcome.faults) };
    assert!(outcome.loops.iter().all(LinearLoop::is_unstable), "{:?}", outcome.loops);
    for part in [
        "master ",
        " wave of axis ",
        " grows without bound, by a factor of 1.0",
        " per tick, detected at 0.3",
    ] {
        assert!(fault.contains(part), "{fault}");
    }
}

#[test]
fn nothing_stable_is_taken_for_growth() {
    let link = |forward: u32, backward: u32| {
        format!("link.forward_delay_ticks={forward} link.backward_delay_ticks={backward}")
    };
    let mut settings = vec!["dof=3".to_owned()];
    for form in ["split", "implicit"] {
        for (forward, backward) in [(0, 0), (5, 5), (50, 7), (0, 200), (500, 500)] {
            for wall in ["1e4", "inf"] {
                let link = link(forward, backward);
                settings.push(format!("wave.form={form} wall.stiffness_n_per_m={wall} {link}"));
            }
        }
    }
    for stale in ["zero", "hold", "limited", "integral"] {
        for loss in ["loss=0.01", "loss=0.1", "loss=0.3", "reordering=0.5", "duplication=0.5"] {
            settings.push(format!("link.stale={stale} link.{loss}"));
        }
    }
    for ticks in [0, 1] {
        let scheme = "master.scheme=builtin:position_position slave.scheme=builtin:position_position";
        settings.push(format!("{scheme} {}", link(ticks, ticks)));
    }
    for step in ["1e-5", "3e-5"] {
        for friction in ["0.0", "0.2"] {
            settings.push(format!(
                "master.device.encoder_step_m={step} slave.device.encoder_step_m={step} \
                 master.device.coulomb_friction_n={friction} slave.device.coulomb_friction_n={friction}"
            ));
        }
    }
    settings.push("slave.device.start_position_m=0.01".to_owned());
    settings.push("hand.contact_force_n=[8.0]".to_owned());
    for settings in settings {
        let outcome = outcome(&settings);
        assert!(outcome.stable && outcome.faults.is_empty(), "{settings}: {:?}", outcome.faults);
    }
}
