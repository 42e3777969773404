//! Rigs from files: what a loop does beside a model of it written apart, and what is said of a file that is wrong.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use hil_sim::experiment::{Experiment, Run};
use hil_sim::identify;
use hil_sim::outcome::Outcome;
use hil_sim::rig_file::{RigFile, SHIPPED};

fn read(text: &str) -> RigFile {
    RigFile::read(text, "test", PathBuf::new(), &[]).unwrap()
}

fn run(text: &str) -> Run {
    let experiment = Experiment::new(&read(text)).unwrap();
    experiment.run(&AtomicBool::new(false), |_| ())
}

fn column(run: &Run, source: &str, signal: &str) -> Vec<f64> {
    let place = run.recording.find(source, signal, Some(0)).unwrap();
    run.recording.column(place).collect()
}

/// A scheme of one PD, in a file of its own.
struct SchemeFile(tempfile::TempDir);

impl SchemeFile {
    fn new(rows: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("pd.scheme"), rows).unwrap();
        Self(folder)
    }

    fn run(&self, text: &str) -> Run {
        let file = RigFile::read(text, "test", self.0.path().to_owned(), &[]).unwrap();
        Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ())
    }
}

const PD: &str = "all PDCTRL_MOD K_PARAM 40\nall PDCTRL_MOD D_PARAM 1.5\nall MOD_ENG MOD_ON PDCTRL_MOD\nall \
MOD_ENG MATCHING_CHECK";

fn pd_rig(delay_ticks: f64) -> String {
    format!(
        r#"
        duration_s = 0.6
        [[device]]
        name = "drive"
        measures = ["POSITION", "DES_POSITION"]
        delay_ticks = {delay_ticks}
        [[device.axis]]
        plant.load = {{ inertia = 0.02, damping = 0.05 }}
        [[controller]]
        device = "drive"
        scheme = "pd.scheme"
        [[experiment.move]]
        device = "drive"
        on = "DES_POSITION"
        step = {{ at_s = 0.05, amplitude = 0.5 }}
        "#
    )
}

/// A PD on an inertia with damping, sampled and delayed, by the exact solution of each stretch of constant torque.
fn exact(delay_ticks: f64) -> Vec<f64> {
    let (h, inertia, damping, stiffness, gain) = (1e-3, 0.02, 0.05, 40.0, 1.5);
    let coast = |(x, v): (f64, f64), torque: f64, time_s: f64| {
        let (end, tau) = (torque / damping, inertia / damping);
        let decay = libm::exp(-time_s / tau);
        (x + end * time_s + (v - end) * tau * (1.0 - decay), end + (v - end) * decay)
    };
    let whole = libm::floor(delay_ticks);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3")]
    let (ticks, part_s) = (whole as usize, (delay_ticks - whole) * h);
    let mut torques = vec![0.0; 8];
    let (mut state, mut last_error, mut positions) = ((0.0, 0.0), 0.0, Vec::new());
    for tick in 0..600 {
        positions.push(state.0);
        let error = if tick >= 50 { 0.5 } else { 0.0 } - state.0;
        torques.push(stiffness * error + gain * (error - last_error) / h);
        last_error = error;
        let ago = |ticks: usize| torques[torques.len() - 1 - ticks];
        let middle = coast(state, ago(ticks + 1), part_s);
        state = coast(middle, ago(ticks), h - part_s);
    }
    positions
}

#[test]
fn a_sampled_loop_goes_as_its_exact_solution_with_any_delay() {
    let scheme = SchemeFile::new(PD);
    for delay_ticks in [0.0, 0.5, 1.0, 1.75, 3.0] {
        let run = scheme.run(&pd_rig(delay_ticks));
        let (simulated, exact) = (column(&run, "world", "drive.position"), exact(delay_ticks));
        assert_eq!(simulated.len(), exact.len());
        let off = simulated.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // The controller counts in f32, and its derivative multiplies its rounding by a thousand.
        assert!(off < 2e-6, "{delay_ticks} ticks: {off} rad off");
    }
}

/// What is read off the run, beside the same read off its recording.
#[test]
fn the_figures_of_a_step_are_those_of_the_recorded_curve() {
    let run = SchemeFile::new(PD).run(&pd_rig(1.0));
    let positions = column(&run, "world", "drive.position");
    let axis = run.outcome.axes[0].following.unwrap();
    let first = |share: f64| positions.iter().position(|x| *x >= share * 0.5).unwrap() as f64;
    assert!((axis.rise_time_s.unwrap() - 1e-3 * (first(0.9) - first(0.1))).abs() < 1e-3);
    let most = positions.iter().copied().fold(0.0, f64::max);
    assert!((axis.overshoot.unwrap() - (most - 0.5) / 0.5).abs() < 1e-9);
    let last_out = positions.iter().rposition(|x| (x - 0.5).abs() > 0.01).unwrap() as f64;
    assert!((axis.settling_time_s.unwrap() - (1e-3 * last_out - 0.05)).abs() < 1e-3 + 1e-9);
    let squares: f64 =
        positions.iter().enumerate().map(|(tick, x)| (if tick >= 50 { 0.5 } else { 0.0 } - x).powi(2)).sum();
    assert!((axis.rms_error - (squares / 600.0).sqrt()).abs() < 1e-9);
    assert!((axis.peak_error - 0.5).abs() < 1e-9);
    assert!(run.outcome.stable && run.outcome.limit_cycles.is_empty());
}

/// A PD on an inertia with damping, sampled, with a whole number of ticks of delay: `L(z) = z⁻ᵈ K(z) P(z)`.
#[test]
fn margins_are_those_of_the_loop_s_formula() {
    let (h, inertia, damping, stiffness, gain) = (1e-3, 0.02, 0.05, 40.0, 1.5);
    type Complex = (f64, f64);
    let times = |a: Complex, b: Complex| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let over = |a: Complex, b: Complex| {
        let size = b.0 * b.0 + b.1 * b.1;
        ((a.0 * b.0 + a.1 * b.1) / size, (a.1 * b.0 - a.0 * b.1) / size)
    };
    let loop_gain = |hz: f64, delay_ticks: f64| {
        let angle = -std::f64::consts::TAU * hz * h;
        let back = |ticks: f64| (libm::cos(angle * ticks), libm::sin(angle * ticks));
        let (re, im) = back(1.0);
        let (tau, decay) = (inertia / damping, libm::exp(-h * damping / inertia));
        // Zero-order hold of 1 / (s (J s + d)), in z⁻¹.
        let (b1, b2) = (h - tau * (1.0 - decay), tau * (1.0 - decay) - decay * h);
        let above = times((b1 + b2 * re, b2 * im), (re / damping, im / damping));
        let below = times((1.0 - re, -im), (1.0 - decay * re, -decay * im));
        let law = (stiffness + gain * (1.0 - re) / h, -gain * im / h);
        times(times(over(above, below), law), back(delay_ticks))
    };
    for delay_ticks in [0.0, 1.0, 3.0] {
        let figures = SchemeFile::new(PD).run(&pd_rig(delay_ticks)).outcome.axes[0].loop_figures.unwrap();
        let (re, im) = loop_gain(figures.crossover_hz.unwrap(), delay_ticks);
        assert!((libm::hypot(re, im) - 1.0).abs() < 2e-3, "{delay_ticks}: {}", libm::hypot(re, im));
        let margin_deg = 180.0 + libm::atan2(im, re).to_degrees();
        assert!((figures.phase_margin_deg.unwrap() - margin_deg).abs() < 0.1, "{figures:?} {margin_deg}");
        // Where the phase passes -180°, on the formula.
        let turn = (1..500).map(f64::from).find(|hz| {
            let [a, b] = [*hz, hz + 1.0].map(|hz| loop_gain(hz, delay_ticks));
            a.1 < 0.0 && b.1 >= 0.0 && a.0 < 0.0
        });
        let at_turn =
            turn.map(|hz| 1.0 / libm::hypot(loop_gain(hz, delay_ticks).0, loop_gain(hz, delay_ticks).1));
        if let Some(expected) = at_turn {
            let found = figures.gain_margin.unwrap();
            assert!((found / expected - 1.0).abs() < 0.02, "{delay_ticks}: {found} {expected}");
        }
    }
}

/// Beyond its gain margin a loop diverges; the delay is what takes the margin away.
#[test]
fn a_loop_beyond_its_margin_is_not_stable() {
    let stiff = PD.replace("D_PARAM 1.5", "D_PARAM 15");
    assert!(SchemeFile::new(&stiff).run(&pd_rig(0.0)).outcome.stable);
    let outcome = SchemeFile::new(&stiff).run(&pd_rig(3.0)).outcome;
    assert!(!outcome.stable && !outcome.faults.is_empty(), "{outcome:?}");
}

/// A torque limit keeps an unstable loop in its range: it swings for ever.
#[test]
fn what_swings_between_its_limits_is_a_limit_cycle() {
    let rows = "all PIDCTRL_MOD K_PARAM 400\nall PIDCTRL_MOD D_PARAM 0.5\nall PIDCTRL_MOD LIMIT 2\n\
                all MOD_ENG MOD_ON PIDCTRL_MOD\nall MOD_ENG MATCHING_CHECK";
    let text = pd_rig(3.0).replace("duration_s = 0.6", "duration_s = 4.0");
    let outcome = SchemeFile::new(rows).run(&text).outcome;
    assert!(!outcome.stable, "{outcome:?}");
    let cycle = &outcome.limit_cycles[0];
    assert!(
        cycle.device == "drive" && cycle.axis == 0 && cycle.hz > 1.0 && cycle.amplitude > 1e-3,
        "{cycle:?}"
    );
}

/// A device that follows another one over a link, which sends this.
fn led(sent: &str) -> Run {
    let device = |name: &str, reference: &str| {
        format!(
            "[[device]]\nname = '{name}'\nmeasures = ['POSITION'{reference}]\naxis = [{{ plant.load.inertia = \
            0.01 }}]\n\
             [[controller]]\ndevice = '{name}'\nscheme = 'pd.scheme'\n"
        )
    };
    let scheme = SchemeFile::new(&format!(
        "all PDCTRL_MOD K_PARAM 10\nall PDCTRL_MOD D_PARAM 0.3\n\
         follow COMM_RXMOD CRX_ADD_DATA DES_POSITION\nfollow MOD_ENG MOD_ON COMM_RXMOD\n\
         all MOD_ENG MOD_ON PDCTRL_MOD\nlead COMM_TXMOD CTX_ADD_DATA {sent}\nlead MOD_ENG MOD_ON COMM_TXMOD\n\
         all MOD_ENG MATCHING_CHECK"
    ));
    scheme.run(&format!(
        "duration_s = 0.5\n{}{}[[link]]\nfrom = 'lead'\nto = 'follow'\n\
         [[experiment.move]]\ndevice = 'lead'\non = 'DES_POSITION'\nstep = {{ at_s = 0.1, amplitude = 0.1 }}\n",
        device("lead", ", 'DES_POSITION'"),
        device("follow", "")
    ))
}

#[test]
fn a_link_that_never_comes_up_is_named_and_no_run_with_it_is_stable() {
    let good = led("POSITION").outcome;
    assert!(good.stable && good.faults.is_empty(), "{:?}", good.faults);
    let bad = led("POSITION\nlead COMM_TXMOD CTX_ADD_DATA DES_POSITION").outcome;
    let named = |fault: &String| {
        fault.starts_with("the link to COMM_RXMOD of the follow never came up: all ")
            && fault.contains("packets contained other signals than expected")
    };
    assert!(!bad.stable && bad.faults.iter().any(named), "{:?}", bad.faults);
    assert!(bad.refused_packets > 400 && bad.lost_packets == 0, "{bad:?}");
}

/// Two devices of two axes each, one that turns and one that slides; the second one gets where the first one is over a link.
#[test]
fn a_device_follows_another_one_over_a_link() {
    let device = |name: &str, reference: &str| {
        format!(
            "[[device]]\nname = '{name}'\nmeasures = ['POSITION'{reference}]\n\
             axis = [{{ unit = 'm', plant.load = {{ inertia = 2.0, damping = 5.0 }} }}, {{ plant.load.inertia = \
             0.01 }}]\n\
             [[controller]]\ndevice = '{name}'\nscheme = 'pd.scheme'\n"
        )
    };
    let gains = "K_PARAM[0] 800\nD_PARAM[0] 60\nK_PARAM[1] 10\nD_PARAM[1] 0.3";
    let gains: String = gains.lines().map(|row| format!("all PDCTRL_MOD {row}\n")).collect();
    let scheme = SchemeFile::new(&format!(
        "{gains}follow COMM_RXMOD CRX_ADD_DATA DES_POSITION\nfollow MOD_ENG MOD_ON COMM_RXMOD\n\
         all MOD_ENG MOD_ON PDCTRL_MOD\nlead COMM_TXMOD CTX_ADD_DATA POSITION\nlead MOD_ENG MOD_ON COMM_TXMOD\n\
         all MOD_ENG MATCHING_CHECK"
    ));
    let rig = |delay_ticks: u32| {
        format!(
            "duration_s = 3.0\n{}{}[[link]]\nfrom = 'lead'\nto = 'follow'\ncarrier = {{ delay_ticks = \
            {delay_ticks} }}\n\
             [[experiment.move]]\ndevice = 'lead'\non = 'DES_POSITION'\nramp = {{ at_s = 0.5, until_s = 3.0, \
             size = 1.0 }}\n",
            device("lead", ", 'DES_POSITION'"),
            device("follow", "")
        )
    };
    for delay_ticks in [1_u32, 40] {
        let run = scheme.run(&rig(delay_ticks));
        let names: Vec<_> = run
            .outcome
            .axes
            .iter()
            .map(|axis| (axis.device.as_str(), axis.axis, axis.following.unwrap().unit))
            .collect();
        assert_eq!(names, [("lead", 0, "m"), ("follow", 0, "m"), ("follow", 1, "rad")]);
        assert!(run.outcome.stable && run.outcome.lost_packets == 0, "{:?}", run.outcome);
        // At an even speed, one is behind by the link and by its own lag, (damping + 0)/K of the speed.
        let [lead, follow] =
            ["lead", "follow"].map(|name| column(&run, "world", &format!("{name}.position")));
        let behind_m = lead[2900] - follow[2900];
        let expected_m = 0.4 * (f64::from(delay_ticks) * 1e-3 + 5.0 / 800.0);
        assert!((behind_m / expected_m - 1.0).abs() < 0.05, "{delay_ticks}: {behind_m} {expected_m}");
    }
}

#[test]
fn every_shipped_rig_runs_stably() {
    for (name, text) in SHIPPED {
        let outcome = run(text).outcome;
        assert!(outcome.stable && !outcome.axes.is_empty(), "{name}: {outcome:?}");
    }
}

#[test]
fn a_rig_runs_the_same_again() {
    let text = RigFile::shipped("joint").unwrap();
    let [first, second] =
        [(); 2].map(|()| Outcome { wall_s: 0.0, realtime_factor: 0.0, ..run(text).outcome });
    assert_eq!(first, second);
}

#[test]
fn the_settings_in_a_report_give_the_same_run_again() {
    for (name, text) in SHIPPED {
        let file = read(text);
        assert_eq!(read(&file.to_toml()), file, "{name}");
    }
}

#[test]
fn one_setting_goes_over_a_file_by_names_and_numbers() {
    let text = RigFile::shipped("joint").unwrap();
    let with = |set: &str| RigFile::read(text, "joint", PathBuf::new(), &[set.to_owned()]);
    let file = with("device.joint.axis.0.plant.load.inertia=1").unwrap();
    assert!((file.devices[0].axes[0].plant.as_ref().unwrap().load.inertia - 1.0).abs() < 1e-12);
    assert_eq!(with("controller.joint.scheme=my.scheme").unwrap().controllers[0].scheme, "my.scheme");
    for (set, expected) in [
        ("duration_s", "write key=value"),
        ("device.arm.delay_ticks=1", "select an entry by index or name: joint"),
        ("device.joint.delay_tick=1", "unknown key `device.joint.delay_tick`; did you mean 'delay_ticks'?"),
        ("duration_s.x=1", "`duration_s` is a value"),
        ("duration_s=long", "--set duration_s=long"),
    ] {
        let error = with(set).unwrap_err().to_string();
        assert!(error.contains(expected), "{set}: {error}");
    }
}

#[test]
fn everything_that_does_not_go_together_is_named_at_once() {
    let text = r#"
        duration_s = -1.0
        [[device]]
        name = "drive"
        measures = ["POSITON", "DES_POSITION"]
        delay_ticks = 4.0
        [[device.axis]]
        plant.load.inertia = 0.0
        [[controller]]
        device = "driv"
        scheme = "builtin:joint"
        [[experiment.move]]
        device = "drive"
        axis = 1
        on = "DES_VELOCITY"
        step = { at_s = 0.1, amplitude = 1.0 }
        ramp = { at_s = 0.1, until_s = 0.0, amplitude = 1.0 }
    "#;
    let error = RigFile::read(text, "my.toml", PathBuf::new(), &[]).unwrap_err().to_string();
    for expected in [
        "cannot run my.toml:",
        "duration_s is -1",
        "measures unknown data type 'POSITON'; did you mean 'POSITION'?",
        "DES_POSITION, which has no sensor and no [[experiment.move]]",
        "delay_ticks is 4, must be 0 to 3",
        "axis 0: plant.",
        "unknown device 'driv'; did you mean 'drive'?",
        "axis 0 of 'drive' has 0 controllers",
        "axis 1 of 'drive' is out of range: the only axis is 0",
        "has no reference 'DES_VELOCITY': add the reference to the device's `measures`; did you mean 'DES_POSITION'?",
        "has step and ramp: set exactly one",
        "until_s is 0 s, must be after at_s, 0.1 s",
    ] {
        assert!(error.contains(expected), "{expected} is not in\n{error}");
    }
}

#[test]
fn a_key_that_does_not_exist_is_named_with_its_line() {
    let text = "duration_s = 1.0\n[[device]]\nname = \"a\"\nmeasure = []\n";
    let error = RigFile::read(text, "my.toml", PathBuf::new(), &[]).unwrap_err().to_string();
    assert!(error.contains("line 4") && error.contains("measure"), "{error}");
}

/// A joint that is stable until it touches an undamped wall: its torque comes too late for what it does there. It is told
/// though it never gets there.
#[test]
fn a_loop_that_would_swing_at_its_wall_is_not_stable() {
    let scheme = SchemeFile::new(PD);
    let at_wall = |damping: f64| {
        let wall = format!(
            "plant.load = {{ inertia = 0.02, damping = 0.05 }}\nwall = {{ position = 0.7, stiffness = 1e5, \
            damping = {damping} }}"
        );
        let text = pd_rig(1.0).replace("plant.load = { inertia = 0.02, damping = 0.05 }", &wall);
        scheme.run(&text).outcome
    };
    let undamped = at_wall(0.0);
    let growth = undamped.axes[0].contact_growth_per_tick.unwrap();
    assert!(!undamped.stable && growth > 1.001, "{undamped:?}");
    assert!(undamped.faults.iter().any(|fault| fault.contains("in contact is unstable")), "{undamped:?}");
    assert_eq!(undamped.axes[0].loop_figures.unwrap().growth_per_tick, None, "free, it dies out");
    let damped = at_wall(30.0);
    assert!(
        damped.stable && damped.axes[0].contact_growth_per_tick.is_none_or(|growth| growth < 1.0),
        "{damped:?}"
    );
}

/// At rest each line passes on the force at its other end, and the hand holds both; each wall gives way by its stiffness.
#[test]
fn one_master_feels_both_slaves() {
    let run = run(&RigFile::shipped("three").unwrap().replace("duration_s = 6.0", "duration_s = 3.6"));
    let last = |source: &str, signal: &str| *column(&run, source, signal).last().unwrap();
    let [left_n, right_n] = ["left", "right"].map(|side| last(side, "DES_FORCE"));
    let [left_m, right_m] = ["left", "right"].map(|side| last("world", &format!("{side}.position")));
    assert!((left_n / (1e4 * (left_m - 0.02)) - 1.0).abs() < 1e-2, "{left_n} N at {left_m} m");
    assert!((right_n / (500.0 * (right_m - 0.04)) - 1.0).abs() < 1e-2, "{right_n} N at {right_m} m");
    let held_n = last("master", "DES_FORCE");
    assert!((held_n + left_n + right_n).abs() < 0.01 * left_n, "{held_n} N for {left_n} N and {right_n} N");
    let hand_n = 300.0 * (0.1 - last("world", "master.position"));
    assert!((hand_n + held_n).abs() < 0.01 * hand_n, "{hand_n} N for {held_n} N");
}

/// Without dry friction, the torques of an arm at rest are those that hold its weight.
/// Two chains of springs side by side: `1/k = 1/K + T/(2 b) + 1/Ks + 1/Ke` each, from its own wall on.
#[test]
fn what_a_hand_feels_of_two_walls_is_what_their_chains_come_to() {
    let run = run(RigFile::shipped("three").unwrap());
    let chain =
        |round_trip_s: f64, wall: f64| 1.0 / (1.0 / 3000.0 + round_trip_s / 20.0 + 1.0 / 5000.0 + 1.0 / wall);
    let (left, right, hand) = (chain(0.02, 1e4), chain(0.05, 500.0), 300.0);
    let position = (hand * 0.1 + left * 0.02 + right * 0.04) / (hand + left + right);
    let expected = hand * (0.1 - position) / (position - 0.02);
    let [felt] = run.outcome.perceived.as_slice() else { panic!("{:?}", run.outcome.perceived) };
    assert!((felt.stiffness / expected - 1.0).abs() < 1e-3, "{felt:?} {expected}");
    assert_eq!((felt.device.as_str(), felt.met_by.as_str(), felt.unit), ("master", "left", "N/m"));
    assert_eq!(felt.unsettled, None);
}

#[test]
fn a_stiffness_that_has_not_settled_says_so() {
    let sets = ["device.master.axis.0.hand.damping=600".to_owned()];
    let file = RigFile::read(RigFile::shipped("three").unwrap(), "three", PathBuf::new(), &sets).unwrap();
    let run = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ());
    let [felt] = run.outcome.perceived.as_slice() else { panic!("{:?}", run.outcome.perceived) };
    assert!(felt.unsettled.as_ref().is_some_and(|how| how.contains("still missing")), "{felt:?}");
}

#[test]
fn nothing_is_felt_of_a_wall_that_is_not_met() {
    let sets = ["experiment.move.0.minimum_jerk.amplitude=0.01".to_owned()];
    let file = RigFile::read(RigFile::shipped("three").unwrap(), "three", PathBuf::new(), &sets).unwrap();
    let run = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ());
    assert_eq!(run.outcome.perceived, []);
}

#[test]
fn an_arm_at_rest_is_held_against_its_weight() {
    let text =
        RigFile::shipped("arm").unwrap().replace("at_s = 1.0, until_s = 2.2", "at_s = 8.0, until_s = 9.0");
    let mut sets: Vec<String> = (0..6).map(|link| format!("device.arm.arm.link.{link}.coulomb=0")).collect();
    sets.push("duration_s=2.9".to_owned());
    let file = RigFile::read(&text, "arm", PathBuf::new(), &sets).unwrap();
    let run = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ());
    let last = |source: &str, signal: &str, axis: usize| {
        let place = run.recording.find(source, signal, Some(axis)).unwrap();
        run.recording.column(place).last().unwrap()
    };
    let positions: Vec<f64> = (0..6).map(|axis| last("world", "arm.position", axis)).collect();
    let arm = file.devices[0].arm.as_ref().unwrap().build().unwrap();
    let expected = arm.gravity_torques(&positions);
    assert!(expected[1].abs() > 10.0, "{expected:?}");
    for (axis, expected_nm) in expected.iter().enumerate().take(6) {
        let torque_nm = last("arm", "DES_FORCE", axis);
        assert!((torque_nm - expected_nm).abs() < 0.1, "axis {axis}: {torque_nm} for {expected_nm} N m");
    }
}

#[test]
fn what_does_not_go_together_in_coupled_axes_is_named() {
    let text = RigFile::shipped("phantom").unwrap();
    for (set, expected) in [
        ("device.phantom.axis.0.plant.load.inertia=1", "a coupled axis cannot have a plant"),
        ("device.phantom.axis.1.hand.inertia=1", "have different values of hand.inertia"),
        ("device.phantom.phantom.coulomb_nm=-1", "phantom.coulomb_nm is -1"),
        ("device.robot.axis.2.wall.stiffness=-5", "the stiffness > 0"),
        (
            "device.robot.axis.0.hand.damping=-1",
            "missing key `inertia` in `device.robot.axis.0.hand.damping`",
        ),
        ("experiment.move.0.device=robot", "has no hand with a stiffness"),
    ] {
        let error =
            RigFile::read(text, "phantom", PathBuf::new(), &[set.to_owned()]).unwrap_err().to_string();
        assert!(error.contains(expected), "{set}: {error}");
    }
}

/// A spring that is sampled gives out `K h/2 ∫ v² dt` of energy: its force is half a tick late on average, in and out.
#[test]
fn a_sampled_spring_gives_out_the_energy_of_its_delay() {
    let rows = PD.replace("D_PARAM 1.5", "D_PARAM 0");
    let text = pd_rig(0.0)
        .replace(
            "plant.load = { inertia = 0.02, damping = 0.05 }",
            "plant.load = { inertia = 0.02, damping = \
        0.05 }\nhand = { inertia = 0.01, damping = 2.0, stiffness = 1000.0 }",
        )
        .replace("duration_s = 0.6", "duration_s = 2.0")
        .replace("on = \"DES_POSITION\"", "on = \"hand\"")
        .replace(
            "step = { at_s = 0.05, amplitude = 0.5 }",
            "minimum_jerk = { at_s = 0.1, until_s = 0.9, amplitude = 0.2 }",
        )
        + "[[experiment.move]]\ndevice = 'drive'\non = 'hand'\nminimum_jerk = { at_s = 1.0, until_s = 1.8, size \
        = -0.2 }\n\
           [[experiment.move]]\ndevice = 'drive'\non = 'DES_POSITION'\nstep = { at_s = -1.0, amplitude = 0.0 }\n";
    let run = SchemeFile::new(&rows).run(&text);
    let speeds = column(&run, "world", "drive.velocity");
    let expected_j = -40.0 * 0.5e-3 * speeds.iter().map(|speed| speed * speed * 1e-3).sum::<f64>();
    let found_j = run.outcome.energy_ports_min_j.unwrap();
    assert!(expected_j < -1e-3 && (found_j / expected_j - 1.0).abs() < 0.02, "{found_j} J, {expected_j} J");
    let led = SchemeFile::new(PD).run(&pd_rig(0.0)).outcome;
    assert_eq!(led.energy_ports_min_j, None, "the reference brings energy");
}

/// The paper's scheme at the tip of a `PHANToM` whose motors and encoders are at its joints: the hand feels the springs of both
/// laws, of the line and of the table one behind the other.
#[test]
fn a_table_feels_at_the_tip_of_a_phantom_like_the_springs_between() {
    let text = RigFile::shipped("phantom_tip").unwrap();
    for (set, wall_n_per_m, round_trip_s) in
        [("seed=1", 1e4, 0.021), ("device.robot.axis.2.wall.stiffness=1000", 1e3, 0.021)]
    {
        let file = RigFile::read(text, "phantom_tip", PathBuf::new(), &[set.to_owned()]).unwrap();
        let outcome = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ()).outcome;
        assert!(outcome.stable, "{outcome:?}");
        let expected = 1.0 / (1.0 / 3000.0 + round_trip_s / 20.0 + 1.0 / 5000.0 + 1.0 / wall_n_per_m);
        let felt = outcome.perceived.first().unwrap();
        assert!((felt.stiffness / expected - 1.0).abs() < 0.01, "{felt:?} instead of {expected}");
        // Two millijoules lift the linkage's weight when the circle begins; beside that all is passive.
        assert!(outcome.energy_ports_min_j.unwrap() > -2e-3, "{outcome:?}");
    }
}

/// Noise of the sensor, an encoder's steps and a gear with losses before it: the load is found all the same.
#[test]
fn the_shipped_experiment_identifies_its_joint_within_half_a_percent() {
    let text = RigFile::shipped("identify").unwrap();
    let file = RigFile::read(text, "identify", PathBuf::new(), &[]).unwrap();
    let run = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| ());
    let (position, force) = (column(&run, "joint", "POSITION"), column(&run, "joint", "FORCE"));
    let (position, force, force_timing) = (&position[..], &force[..], identify::ForceTiming::Measured);
    let experiment =
        identify::Experiment { period_s: 1e-3, position, force, force_timing, turns: true, others: &[] };
    let found = identify::identify(&experiment).unwrap();
    let truth = identify::true_parameters(file.devices[0].axes[0].plant.as_ref().unwrap(), true).unwrap();
    for (quantity, truth) in truth {
        let (value, half_width) = found.of(quantity).unwrap();
        // What is 0 is inside of its interval, or small beside the weight.
        let allowed = if truth > 0.0 { 0.005 * truth } else { 0.01 };
        assert!((value - truth).abs() < allowed, "{quantity:?}: {value} ± {half_width} instead of {truth}");
    }
}

/// Its parameters have the names of the bilateral scenario, and set what they say.
#[test]
fn the_telerobot_takes_the_keys_of_the_bilateral_scenario() {
    let text = RigFile::shipped("telerobot").unwrap();
    let read = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        RigFile::read(text, "telerobot", PathBuf::new(), &sets)
    };
    let usual = RigFile::from_shipped("bilateral", &[]).unwrap();
    for parameter in read(&[]).unwrap().parameters {
        let is_own = ["scheme", "link.delay_ticks"].contains(&parameter.name.as_str());
        assert!(is_own || usual.parameter(&parameter.name).is_some(), "{}", parameter.name);
    }
    let file = read(&["link.delay_ticks=7", "wall.stiffness_n_per_m=1e4", "master.stiffness_n_per_m=2000"]);
    let file = file.unwrap();
    assert_eq!(file.links.iter().map(|link| link.carrier.delay_ticks).collect::<Vec<_>>(), [7, 7]);
    assert!((file.devices[1].axes[0].wall.as_ref().unwrap().stiffness - 1e4).abs() < 1e-9);
    let settings = file.controllers[0].settings();
    assert_eq!((settings.len(), settings[0].value.as_str()), (1, "2000"));
    assert!(Experiment::new(&file).is_ok());
    // The settings in effect give the same file again.
    let again = RigFile::read(&file.to_toml(), "again", PathBuf::new(), &[]).unwrap();
    assert_eq!(again.links, file.links);
    for (set, expected) in [
        ("link.loss=2", "`link.loss` is 2, must be a number from 0 to 1"),
        ("wall.stiffnes_n_per_m=1", "did you mean `wall.stiffness_n_per_m`?"),
    ] {
        let error = read(&[set]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_wrong_parameter_is_refused_with_its_name() {
    let text = RigFile::shipped("joint").unwrap();
    for (parameter, expected) in [
        ("name = 'load', keys = []", "parameter 'load': sets no keys"),
        ("name = 'duration_s', keys = ['seed']", "parameter 'duration_s': the rig has a key of this name"),
        (
            "name = 'load', keys = ['device.joint.delay']",
            "parameter 'load': unknown key `device.joint.delay`",
        ),
        ("name = 'load', keys = ['device.drive.delay_ticks']", "parameter 'load': `device` is a list"),
    ] {
        let text = format!("parameter = [{{ {parameter} }}]\n{text}");
        let error = RigFile::read(&text, "wrong", PathBuf::new(), &[]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
