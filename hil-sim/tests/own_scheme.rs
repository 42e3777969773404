//! A user's own scheme is run as it is written; only settings that were really given go over it.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::fs;
use std::sync::atomic::AtomicBool;

use hil_sim::experiment::Experiment;
use hil_sim::outcome::Outcome;
use hil_sim::response::round_trip_ticks;
use hil_sim::rig_file::RigFile;

/// The paper's scheme with gains and delays of its own, and one axis unlike the others.
const OWN: &str = "
m&s      COMM_RXMOD     CRX_ADD_DATA    CH2_WAVES
m&s      MOD_ENG        MOD_ON          COMM_RXMOD
m&s      WTRANSF_MOD    B_PARAM         20
master   WTRANSF_MOD    CONF_MODE       MASTER
slave    WTRANSF_MOD    CONF_MODE       SLAVE
m&s      MOD_ENG        MOD_ON          WTRANSF_MOD
m&s      PDCTRL_MOD     K_PARAM         2000
master   PDCTRL_MOD     K_PARAM[1]      1000
m&s      MOD_ENG        MOD_ON          PDCTRL_MOD
master   TIMEDELAY_MOD  TD_PARAM        3
slave    TIMEDELAY_MOD  TD_PARAM        6
m&s      MOD_ENG        MOD_ON          TIMEDELAY_MOD
m&s      COMM_TXMOD     CTX_ADD_DATA    CH1_TD_WAVES
m&s      MOD_ENG        MOD_ON          COMM_TXMOD
m&s      MOD_ENG        MATCHING_CHECK
";

/// What a hand of 20 N s/m, matched to the line, feels with this scheme on both sides, and what stood in the way.
fn run(scheme: &str, settings: &[&str]) -> Result<Outcome, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.scheme");
    fs::write(&path, scheme).unwrap();
    let path = path.display();
    let own = [
        format!("master.scheme={path}"),
        format!("slave.scheme={path}"),
        "dof=2".to_owned(),
        "hand.damping_n_s_per_m=20".to_owned(),
        "slave.device.damping_n_s_per_m=20".to_owned(),
    ];
    let settings: Vec<String> =
        own.into_iter().chain(settings.iter().map(|text| (*text).to_owned())).collect();
    let scenario = RigFile::from_shipped("bilateral", &settings).unwrap();
    let experiment = Experiment::new(&scenario).map_err(|error| error.to_string())?;
    let expected_ticks = round_trip_ticks(&scenario).unwrap();
    let outcome = experiment.run(&AtomicBool::new(false), |_| {}).outcome;
    assert!(outcome.stable, "{:?}", outcome.faults);
    assert_eq!(outcome.round_trip_ticks, expected_ticks, "as measured and as planned");
    Ok(outcome)
}

/// Springs in series before the shipped wall of 1e4 N/m, `N/m`.
fn chain(master: f64, impedance_n_s_per_m: f64, ticks: u32, slave: f64) -> f64 {
    let line = f64::from(ticks) * 1e-3 / (2.0 * impedance_n_s_per_m);
    1.0 / (1.0 / master + line + 1.0 / slave + 1.0 / 1e4)
}

fn feels(outcome: &Outcome, expected: [f64; 2]) {
    for (axis, expected) in outcome.axes.iter().zip(expected) {
        for found in [axis.contact.unwrap().k_perceived_n_per_m, axis.contact.unwrap().k_predicted_n_per_m] {
            let error = found.unwrap() / expected - 1.0;
            assert!(error.abs() < 1e-4, "axis {}: {found:?} instead of {expected}", axis.axis);
        }
    }
}

#[test]
fn gains_delays_and_single_axes_of_a_scheme_are_what_is_perceived() {
    let outcome = run(OWN, &[]).unwrap();
    assert_eq!(outcome.round_trip_ticks, Some(1 + 1 + 3 + 6));
    feels(&outcome, [chain(2000.0, 20.0, 11, 2000.0), chain(1000.0, 20.0, 11, 2000.0)]);
}

#[test]
fn a_setting_that_is_given_goes_over_the_rows_and_the_others_stay() {
    let outcome = run(OWN, &["master.stiffness_n_per_m=1500", "slave.time_delay_ticks=0"]).unwrap();
    assert_eq!(outcome.round_trip_ticks, Some(1 + 1 + 3));
    feels(&outcome, [chain(1500.0, 20.0, 5, 2000.0); 2]);
}

/// A row after its module was plugged in would otherwise have the last word.
#[test]
fn a_setting_goes_over_a_row_that_comes_after_its_module() {
    let late = format!("{OWN}master PDCTRL_MOD K_PARAM[0] 700\n");
    let outcome = run(&late, &["master.stiffness_n_per_m=1500"]).unwrap();
    feels(&outcome, [chain(1500.0, 20.0, 11, 2000.0); 2]);
    feels(&run(&late, &[]).unwrap(), [chain(700.0, 20.0, 11, 2000.0), chain(1000.0, 20.0, 11, 2000.0)]);
}

#[test]
fn a_bad_row_is_an_error_with_a_setting_over_it_too() {
    let bad = OWN.replace("K_PARAM[1]      1000", "K_PARAM[1]      1OOO");
    let message = run(&bad, &["master.stiffness_n_per_m=1500"]).unwrap_err();
    assert!(message.contains("own.scheme:9:41: '1OOO' is not a number from 0 to 1000000"), "{message}");
    let no_axis = OWN.replace("K_PARAM[1]", "K_PARAM[2]");
    let message = run(&no_axis, &["master.stiffness_n_per_m=1500"]).unwrap_err();
    assert!(message.contains("no such axis: the device has 2 axes, counted from 0"), "{message}");
}

#[test]
fn a_setting_of_a_module_that_is_not_there_is_refused() {
    let without = OWN.lines().filter(|row| !row.contains("TIMEDELAY_MOD")).collect::<Vec<_>>().join("\n");
    let without = without.replace("CH1_TD_WAVES", "CH1_WAVES");
    assert_eq!(run(&without, &[]).unwrap().round_trip_ticks, Some(2));
    let message = run(&without, &["slave.time_delay_ticks=4"]).unwrap_err();
    assert!(message.contains("does not run on the slave"), "{message}");
    let expected = "the setting slave.time_delay_ticks has no effect: the scheme does not plug in \
    TIMEDELAY_MOD; remove slave.time_delay_ticks";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn a_delay_on_the_way_in_counts_and_is_perceived() {
    let incoming = "
        m&s TIMEDELAY_MOD.2 PORT_SIGNAL_IN  CH2_WAVES
        m&s TIMEDELAY_MOD.2 PORT_SIGNAL_OUT CH2_TD_WAVES
        m&s TIMEDELAY_MOD.2 TD_PARAM        4
        m&s MOD_ENG         MOD_ON          TIMEDELAY_MOD.2
        m&s WTRANSF_MOD     PORT_WAVES_IN   CH2_TD_WAVES
        m&s WTRANSF_MOD     B_PARAM         20";
    let scheme = OWN.replace("m&s      WTRANSF_MOD    B_PARAM         20", incoming);
    let outcome = run(&scheme, &[]).unwrap();
    assert_eq!(outcome.round_trip_ticks, Some(1 + 1 + 3 + 6 + 4 + 4));
    feels(&outcome, [chain(2000.0, 20.0, 19, 2000.0), chain(1000.0, 20.0, 19, 2000.0)]);
}

/// The master is stepped before the slave, so nothing comes back to it within a tick.
#[test]
fn the_planned_round_trip_is_the_measured_one_at_every_short_delay() {
    for (forward, backward, ticks) in [(0, 0, 1), (0, 1, 1), (1, 0, 2), (0, 2, 2), (3, 2, 5)] {
        let settings = [
            format!("link.forward_delay_ticks={forward}"),
            format!("link.backward_delay_ticks={backward}"),
            "duration_s=0.2".to_owned(),
        ];
        let outcome = run(OWN, &settings.each_ref().map(String::as_str)).unwrap();
        assert_eq!(outcome.round_trip_ticks, Some(ticks + 9), "{forward} there, {backward} back");
    }
}

/// Unlike impedances scale forces and motions: that is said, and no stiffness is predicted for what is no spring.
#[test]
fn unlike_wave_impedances_are_named() {
    let unlike = OWN.replace("m&s      WTRANSF_MOD    B_PARAM         20", "slave WTRANSF_MOD B_PARAM 5");
    let outcome = run(&unlike, &["duration_s=0.2"]).unwrap();
    assert_eq!(outcome.k_predicted_n_per_m, [None, None]);
    let expected = "wave impedances differ, 10 N s/m on the master and 5 N s/m on the slave";
    assert!(outcome.faults.iter().any(|fault| fault.contains(expected)), "{:?}", outcome.faults);
    let outcome = run(&unlike, &["duration_s=0.2", "wave.impedance_n_s_per_m=20"]).unwrap();
    assert!(outcome.faults.is_empty(), "{:?}", outcome.faults);
}

/// Sides that do not listen to what is sent run by themselves: the link is named, with the reason.
#[test]
fn packets_that_a_scheme_does_not_listen_for_are_named() {
    let settings: Vec<String> =
        ["slave.scheme=builtin:position_position", "duration_s=0.2"].map(str::to_owned).to_vec();
    let faults = |settings: &[String]| {
        let experiment = Experiment::new(&RigFile::from_shipped("bilateral", settings).unwrap()).unwrap();
        experiment.run(&AtomicBool::new(false), |_| {}).outcome.faults
    };
    let [master, slave] = &*faults(&settings) else { panic!("{:?}", faults(&settings)) };
    for (side, fault) in [("master", master), ("slave", slave)] {
        let expected = format!(
            "the link to COMM_RXMOD of the {side} never came up: all 199 packets contained other signals than expected"
        );
        assert!(fault.starts_with(&expected), "{fault}");
    }
    let repeated = ["link.duplication=1", "link.reordering=1", "duration_s=0.2"].map(str::to_owned);
    assert_eq!(faults(&repeated), [""; 0], "refused now and then is not deaf");
}
