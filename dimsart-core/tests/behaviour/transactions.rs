//! Transactions on a running scheme: atomic, and modules in both schemes continue.

#![expect(clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

mod any_scheme;
mod random;

use dimsart_core::{
    Command, CommandError, DriveState, SafetyReason, Scalar as _, TickResult, Word, limits::MAX_MODULES,
    types,
};

use crate::common::{Bench, Snapshot};

const MASS_KG: f32 = 0.5;

/// A mass on one axis that follows a sine, in contact with a spring beyond a position.
struct Joint {
    bench: Bench,
    x_m: f32,
    v_m_s: f32,
    ticks: u16,
    force_n: f32,
    largest_step_n: f32,
}

impl Joint {
    fn new(rows: &str) -> Self {
        let mut bench = Bench::of(1, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
        bench.run(rows);
        Self { bench, x_m: 0.0, v_m_s: 0.0, ticks: 0, force_n: 0.0, largest_step_n: 0.0 }
    }

    fn run(&mut self, ticks: u16) {
        for _ in 0..ticks {
            let t_s = f32::from(self.ticks) * crate::common::H;
            let force_n = self.bench.tick(&[self.x_m, 0.1 * (6.0 * t_s).sin()])[0];
            self.largest_step_n = (force_n - self.force_n).abs().max(self.largest_step_n);
            self.force_n = force_n;
            let wall_n = if self.x_m > 0.05 { -2000.0 * (self.x_m - 0.05) } else { 0.0 };
            self.v_m_s += crate::common::H * (force_n + wall_n - self.v_m_s) / MASS_KG;
            self.x_m += crate::common::H * self.v_m_s;
            self.ticks += 1;
        }
    }

    /// The maximum step of the force from now on.
    fn largest_step_n(&mut self, ticks: u16) -> f32 {
        self.largest_step_n = 0.0;
        self.run(ticks);
        self.largest_step_n
    }
}

const PD: &str = "PDCTRL_MOD K_PARAM 1000\nPDCTRL_MOD D_PARAM 20\nMOD_ENG MOD_ON PDCTRL_MOD";
const PID: &str =
    "PIDCTRL_MOD K_PARAM 600\nPIDCTRL_MOD D_PARAM 30\nPIDCTRL_MOD I_PARAM 3000\nMOD_ENG MOD_ON PIDCTRL_MOD";
const TO_PID: &str = "MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON PIDCTRL_MOD\nMOD_ENG COMMIT";
const TO_PD: &str = "MOD_ENG BEGIN\nMOD_ENG MOD_OFF PIDCTRL_MOD\nMOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG COMMIT";

/// In free motion and in contact.
const MOMENTS: [u16; 4] = [100, 180, 330, 620];

#[test]
fn a_pid_takes_over_from_a_pd_without_a_step_of_the_force() {
    for moment in MOMENTS {
        let mut joint = Joint::new(PD);
        joint.bench.rows(PID.split_once("\nMOD_ENG").unwrap().0);
        joint.run(moment);
        let usual = joint.largest_step_n(20);
        let mut naive = Joint::new(PD);
        naive.bench.rows(PID.split_once("\nMOD_ENG").unwrap().0);
        naive.run(moment + 20);
        joint.bench.rows(TO_PID);
        naive.bench.rows("MOD_ENG STOP\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON PIDCTRL_MOD");
        naive.bench.rows("MOD_ENG MATCHING_CHECK");
        let (step, naive) = (joint.largest_step_n(20), naive.largest_step_n(20));
        assert!(step < 2.0 * usual + 0.05, "{moment}: {step} N, usually {usual} N, naively {naive} N");
        assert!(naive > 5.0 * step, "{moment}: {step} N, naively {naive} N");
    }
}

/// A PD cannot take over the integral's force, but takes over the derivative.
#[test]
fn a_pd_takes_over_from_a_pd_of_the_same_gains_without_a_step_of_the_force() {
    for moment in MOMENTS {
        let mut joint = Joint::new(PD);
        joint.bench.rows("PDCTRL_MOD.2 K_PARAM 1000\nPDCTRL_MOD.2 D_PARAM 20");
        joint.run(moment);
        let usual = joint.largest_step_n(20);
        joint
            .bench
            .rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON PDCTRL_MOD.2\nMOD_ENG COMMIT");
        let step = joint.largest_step_n(20);
        assert!(step < 2.0 * usual + 0.05, "{moment}: {step} N, usually {usual} N");
    }
}

#[test]
fn what_a_pd_takes_over_at_once_is_its_predecessor_s_last_force() {
    let mut joint = Joint::new(PID);
    joint.bench.rows(PD.split_once("\nMOD_ENG").unwrap().0);
    joint.run(333);
    let before = joint.force_n;
    joint.bench.rows(TO_PD);
    joint.run(1);
    assert!((joint.force_n - before).abs() < 1e-3, "{before} {}", joint.force_n);
}

/// A law without state changes the command at once; with a rate limit it ramps from its predecessor's last
/// force.
#[test]
fn a_law_without_memory_takes_over_as_a_ramp_behind_a_limit() {
    let start = "MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nPCTRL_MOD K_PARAM 20\n";
    let behind = "PCTRL_MOD PORT_DES_FORCE DES_FORCE.2\nLIMIT_MOD PORT_SIGNAL_IN DES_FORCE.2\n\
                  LIMIT_MOD PORT_SIGNAL_OUT DES_FORCE\nLIMIT_MOD RATE 100\n";
    let (on, limit) = ("MOD_ENG MOD_ON PCTRL_MOD\n", "MOD_ENG MOD_ON LIMIT_MOD\n");
    for moment in MOMENTS {
        let rows =
            [[start, on, "MOD_ENG COMMIT"].concat(), [start, behind, on, limit, "MOD_ENG COMMIT"].concat()];
        let [at_once, as_a_ramp] = rows.map(|rows| {
            let mut joint = Joint::new(PD);
            joint.run(moment);
            joint.bench.rows(&rows);
            joint.largest_step_n(20)
        });
        // 100 N/s, 1 ms.
        assert!(at_once > 0.3 && as_a_ramp <= 0.1001, "{moment}: {at_once} N, {as_a_ramp} N");
    }
}

/// The new module's output had no writer: there is nothing to take over, and it begins as after a start.
#[test]
fn what_writes_something_of_its_own_takes_nothing_over() {
    let rows = "PDCTRL_MOD.2 K_PARAM 10000\nPDCTRL_MOD.2 D_PARAM 20\nPDCTRL_MOD.2 PORT_DES_FORCE SIGNAL_OUT";
    let mut joint = Joint::new(PD);
    joint.bench.rows(rows);
    joint.run(100);
    joint.bench.rows("MOD_ENG BEGIN\nMOD_ENG MOD_ON PDCTRL_MOD.2\nMOD_ENG COMMIT");
    joint.run(1);
    let written = [types::SIGNAL_OUT.first()];
    let written_n: Vec<_> = joint.bench.dimsart.signals(&written).map(f32::from_word).collect();
    assert!(written_n[0].abs() > 5.0, "{written_n:?}");
}

fn is_refused(bench: &mut Bench, row: &str, expected: CommandError) {
    let before = bench.snapshot();
    assert_eq!(bench.order(row), Err(expected), "{row}");
    assert_eq!(bench.snapshot(), before, "{row}");
}

#[test]
fn a_transaction_is_opened_once_and_ended_once() {
    let mut bench = Joint::new(PD).bench;
    is_refused(&mut bench, "MOD_ENG COMMIT", CommandError::NoTransaction);
    is_refused(&mut bench, "MOD_ENG ABORT", CommandError::NoTransaction);
    for end in ["COMMIT", "ABORT"] {
        bench.rows("MOD_ENG BEGIN");
        is_refused(&mut bench, "MOD_ENG BEGIN", CommandError::TransactionOpen);
        bench.rows(&format!("MOD_ENG {end}"));
        assert!(!bench.dimsart.engine().is_in_transaction());
    }
}

#[test]
fn a_refused_commit_names_every_fault_and_can_be_mended() {
    let mut joint = Joint::new(PD);
    joint.run(50);
    let running: Snapshot = joint.bench.snapshot();
    joint.bench.rows("MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON SUM_MOD");
    let refused = joint.bench.order("MOD_ENG COMMIT");
    let findings = joint.bench.findings();
    assert_eq!(refused, Err(CommandError::HasFaults { faults: findings.len() }));
    assert!(findings.len() > 1, "{findings:?}");
    assert!(findings.iter().any(|finding| finding.contains("DES_FORCE")), "{findings:?}");
    assert_eq!(joint.bench.dimsart.engine().steps().count(), 1);
    joint.run(10);
    joint.bench.rows("MOD_ENG MOD_CLOSE SUM_MOD\nMOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG COMMIT");
    let after = joint.bench.snapshot();
    assert_eq!((after.steps, after.bindings), (running.steps, running.bindings));
    assert!(after.is_running);
}

#[test]
fn parameters_of_a_transaction_wait_for_its_commit() {
    let mut bench = Joint::new("PCTRL_MOD K_PARAM 10\nMOD_ENG MOD_ON PCTRL_MOD").bench;
    bench.rows("MOD_ENG BEGIN\nPCTRL_MOD K_PARAM 20");
    assert_eq!(bench.tick(&[0.0, 1.0]), [10.0]);
    bench.rows("MOD_ENG ABORT");
    assert_eq!(bench.tick(&[0.0, 1.0]), [10.0]);
    bench.rows("MOD_ENG BEGIN\nPCTRL_MOD K_PARAM 20\nMOD_ENG COMMIT");
    assert_eq!(bench.tick(&[0.0, 1.0]), [20.0]);
    bench.rows("PCTRL_MOD K_PARAM 30");
    assert_eq!(bench.tick(&[0.0, 1.0]), [30.0]);
}

#[test]
fn a_module_that_stays_keeps_its_state_in_another_place_with_other_parameters_and_signals() {
    let rows = "INTEGRATOR_MOD PORT_SIGNAL_IN POSITION\nMOD_ENG MOD_ON INTEGRATOR_MOD\n";
    let mut bench = Joint::new(&format!("{rows}{PD}")).bench;
    (0..1000).for_each(|_| drop(bench.tick(&[1.0, 1.0])));
    let before = bench.signal("SIGNAL_OUT")[0];
    assert!(before > 0.9);
    bench.rows(
        "MOD_ENG BEGIN\nMOD_ENG MOD_OFF INTEGRATOR_MOD\nINTEGRATOR_MOD PORT_SIGNAL_OUT SIGNAL_OUT.2
        INTEGRATOR_MOD LIMIT 5\nMOD_ENG MOD_ON INTEGRATOR_MOD\nMOD_ENG COMMIT",
    );
    bench.tick(&[1.0, 1.0]);
    crate::common::assert_close(bench.signal("SIGNAL_OUT.2")[0], before + crate::common::H, 1e-6);
}

#[test]
fn a_delay_line_that_stays_keeps_its_samples_and_one_of_another_length_begins() {
    let rows = "TIMEDELAY_MOD PORT_SIGNAL_IN POSITION\nTIMEDELAY_MOD PORT_SIGNAL_OUT POSITION.2\nTIMEDELAY_MOD TD_PARAM 4\nMOD_ENG MOD_ON TIMEDELAY_MOD\n";
    let mut bench = Joint::new(&format!("{rows}{PD}")).bench;
    let delayed = |bench: &mut Bench, x: f32| {
        bench.tick(&[x, 0.0]);
        bench.signal("POSITION.2")[0]
    };
    for x in 1..=6_u8 {
        delayed(&mut bench, x.into());
    }
    let again = "MOD_ENG BEGIN\nMOD_ENG MOD_OFF TIMEDELAY_MOD\nMOD_ENG MOD_ON TIMEDELAY_MOD\nMOD_ENG COMMIT";
    bench.rows(again);
    crate::common::assert_close(delayed(&mut bench, 7.0), 3.0, 0.0);
    bench.rows(&again.replace("MOD_ENG MOD_ON", "TIMEDELAY_MOD TD_PARAM 2\nMOD_ENG MOD_ON"));
    let found: Vec<f32> = (8..12_u8).map(|x| delayed(&mut bench, x.into())).collect();
    assert_eq!(found, [0.0, 0.0, 8.0, 9.0]);
}

#[test]
fn a_whole_scheme_is_exchanged_for_another_one_and_nothing_is_lost() {
    let mut joint = Joint::new(PD);
    let usage = joint.bench.dimsart.engine().usage();
    joint.run(100);
    for (rows, is_first) in [(PID, false), (PD, true)].repeat(50) {
        joint
            .bench
            .rows(&format!("MOD_ENG BEGIN\nMOD_ENG CLOSE\n{rows}\nMOD_ENG MATCHING_CHECK\nMOD_ENG COMMIT"));
        joint.run(3);
        if is_first {
            assert_eq!(joint.bench.dimsart.engine().usage(), usage);
        }
    }
}

#[test]
fn a_transaction_on_a_scheme_that_is_stopped_starts_it_where_it_was_checked() {
    let mut bench = Bench::of(1, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    bench.rows(&format!("MOD_ENG BEGIN\n{PD}\nMOD_ENG COMMIT"));
    assert!(!bench.dimsart.engine().is_running());
    bench.rows(&format!("MOD_ENG BEGIN\nMOD_ENG CLOSE\n{PID}\nMOD_ENG MATCHING_CHECK"));
    assert!(!bench.dimsart.engine().is_running());
    assert_eq!(bench.try_tick(&[Word(0); 2]).0, TickResult::Idle);
    bench.rows("MOD_ENG COMMIT");
    assert_eq!(bench.steps(), ["PIDCTRL_MOD Early"]);
    bench.tick(&[0.0, 0.0]);
}

#[test]
fn stop_and_reset_are_for_what_runs() {
    let mut joint = Joint::new(PD);
    joint
        .bench
        .rows("MOD_ENG BEGIN\nMOD_ENG CLOSE\nMOD_ENG RESET\nMOD_ENG MOD_RESET PDCTRL_MOD\nMOD_ENG STOP");
    assert!(!joint.bench.dimsart.engine().is_running());
    assert_eq!(joint.bench.steps(), ["PDCTRL_MOD Early"]);
    joint.bench.rows("MOD_ENG ABORT\nMOD_ENG MATCHING_CHECK");
    joint.run(1);
}

#[test]
fn what_does_not_fit_beside_the_scheme_that_runs_is_refused_and_costs_nothing() {
    let mut bench = Joint::new(PD).bench;
    let rows = "RECORDER_MOD PORT_SIGNAL_IN POSITION\nRECORDER_MOD LENGTH 1500\nMOD_ENG MOD_ON RECORDER_MOD";
    bench.rows(rows);
    let before = bench.dimsart.engine().usage();
    bench.rows("MOD_ENG BEGIN\nMOD_ENG CLOSE\nRECORDER_MOD.2 LENGTH 1500");
    let in_draft = bench.dimsart.engine().usage();
    assert!(matches!(bench.order("MOD_ENG MOD_ON RECORDER_MOD.2"), Err(CommandError::Storage(_))));
    assert_eq!(bench.dimsart.engine().usage(), in_draft);
    bench.rows("MOD_ENG ABORT");
    assert_eq!(bench.dimsart.engine().usage(), before);
}

#[test]
fn instances_of_a_transaction_are_counted_apart() {
    let mut bench = Joint::new(PD).bench;
    bench.rows("MOD_ENG BEGIN");
    for number in 2..=MAX_MODULES {
        bench.rows(&format!("MOD_ENG MOD_INIT PCTRL_MOD.{number}"));
    }
    is_refused(&mut bench, "MOD_ENG MOD_INIT SUM_MOD", CommandError::TooManyModules);
    bench.rows("MOD_ENG CLOSE\nMOD_ENG MOD_INIT SUM_MOD\nMOD_ENG ABORT");
    assert_eq!(bench.dimsart.engine().usage().modules, 1);
}

/// After windup without motion, a scheme commands the same as one that has just started.
#[test]
fn arming_is_a_beginning() {
    const ROWS: &str = "
        SIGGEN_MOD FORM SQUARE
        SIGGEN_MOD AMPLITUDE 2
        MOD_ENG MOD_ON SIGGEN_MOD
        INTEGRATOR_MOD PORT_SIGNAL_IN DES_POSITION
        INTEGRATOR_MOD PORT_SIGNAL_OUT SIGNAL_OUT.2
        MOD_ENG MOD_ON INTEGRATOR_MOD
        PIDCTRL_MOD K_PARAM 10
        PIDCTRL_MOD I_PARAM 100
        PIDCTRL_MOD D_PARAM 1
        MOD_ENG MOD_ON PIDCTRL_MOD";
    let mut armed = Joint::new(ROWS).bench;
    armed.dimsart.set_motion_allowed(false);
    for _ in 0..60_000 {
        let (tick, commanded) = armed.try_tick(&crate::common::words(&[0.0, 1.0]));
        assert_eq!((tick, &commanded[..]), (TickResult::Disarmed, &[Word(0)][..]));
    }
    assert!(armed.signal("DES_FORCE")[0] > 5_000.0, "no windup");
    armed.dimsart.set_motion_allowed(true);
    let mut started = Joint::new(ROWS).bench;
    for tick in 0..500_u16 {
        let measured = [f32::from(tick) * 1e-3, 1.0];
        assert_eq!(armed.tick(&measured), started.tick(&measured), "{tick}");
        assert_eq!(armed.bits("SIGNAL_OUT"), started.bits("SIGNAL_OUT"), "{tick}");
        assert_eq!(armed.bits("SIGNAL_OUT.2"), started.bits("SIGNAL_OUT.2"), "{tick}");
    }
    assert_eq!(armed.dimsart.safety().reason(), SafetyReason::None);
    // No effect if already allowed.
    armed.dimsart.set_motion_allowed(true);
    assert_eq!(armed.tick(&[0.5, 1.0]), started.tick(&[0.5, 1.0]));
}

#[test]
fn a_command_that_is_refused_in_a_transaction_changes_nothing_of_it() {
    let mut bench = Joint::new(PD).bench;
    bench.rows("MOD_ENG BEGIN");
    for row in ["PDCTRL_MOD LAW_OUTPUT ON", "MOD_ENG MOD_ON PDCTRL_MOD", "MOD_ENG MOD_OFF SUM_MOD"] {
        let before = bench.snapshot();
        assert!(bench.order(row).is_err(), "{row}");
        assert_eq!(bench.snapshot(), before, "{row}");
    }
    let pd = dimsart_modules::ALL.module("PDCTRL_MOD").unwrap();
    assert_eq!(bench.dimsart.command(Command::CloseModule(pd)), Ok(()));
    assert_eq!(bench.dimsart.command(Command::CloseModule(pd)), Err(CommandError::NotPluggedIn(pd)));
}

/// An invalid force is not taken over; replacing the law removes the failed module.
#[test]
fn what_takes_over_from_a_force_that_is_not_finite_begins_anew() {
    for (rows, to) in [(PID, TO_PID), (PD, "")] {
        let mut joint =
            Joint::new("PDCTRL_MOD K_PARAM 1e6\nPDCTRL_MOD D_PARAM 1e4\nMOD_ENG MOD_ON PDCTRL_MOD");
        let (module, settings) = if to.is_empty() {
            ("PDCTRL_MOD.2", rows.replace("PDCTRL_MOD", "PDCTRL_MOD.2"))
        } else {
            ("PIDCTRL_MOD", rows.to_owned())
        };
        joint.bench.rows(settings.rsplit_once("\nMOD_ENG").unwrap().0);
        let far = crate::common::words(&[-3e38, 3e38]);
        assert!(matches!(joint.bench.try_tick(&far).0, TickResult::ModuleFailed(_)));
        assert!(joint.bench.dimsart.engine().module_fault().is_some());
        joint.bench.rows(&format!(
            "MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON {module}\nMOD_ENG COMMIT"
        ));
        assert_eq!(joint.bench.dimsart.engine().module_fault(), None);
        assert_eq!(joint.bench.dimsart.safety().state(), DriveState::Fault, "which still needs a reset");
        joint.bench.rows("MOD_ENG RESET");
        joint.run(100);
        assert!(joint.force_n.is_finite() && joint.force_n != 0.0);
    }
}

/// Neither a refusal nor an aborted change drops a received packet; a new receiver waits for the next packet.
#[test]
fn a_packet_that_waits_is_the_listener_s_whatever_is_refused_meanwhile() {
    let rx = "COMM_RXMOD CRX_ADD_DATA DES_POSITION\nMOD_ENG MOD_ON COMM_RXMOD\nMOD_ENG MOD_ON PDCTRL_MOD";
    let mut bench = Bench::of(1, &[types::POSITION], &[types::DES_FORCE]);
    bench.run(rx);
    let mut sender = Bench::of(1, &[types::DES_POSITION], &[]);
    sender.run("COMM_TXMOD CTX_ADD_DATA DES_POSITION\nMOD_ENG MOD_ON COMM_TXMOD");
    let second = "COMM_RXMOD.2 CRX_ADD_DATA DES_POSITION.2";
    for (number, rows) in [
        (1_u8, second),
        (2, "MOD_ENG BEGIN\nMOD_ENG MOD_ON COMM_RXMOD.2"),
        (3, "MOD_ENG ABORT"),
        (4, "MOD_ENG BEGIN\nMOD_ENG MOD_OFF COMM_RXMOD\nMOD_ENG MOD_ON COMM_RXMOD"),
        (5, "MOD_ENG PLACE_BEFORE COMM_RXMOD"),
    ] {
        sender.tick(&[number.into()]);
        let packet = sender.dimsart.take_outgoing(0).unwrap();
        bench.dimsart.receive_parsed(0, &Ok(packet)).unwrap();
        bench.rows(rows);
        let refused = bench.order(if number < 4 { "MOD_ENG MOD_ON COMM_RXMOD.2" } else { "MOD_ENG COMMIT" });
        assert!(refused.is_err(), "{rows}");
        bench.tick(&[0.0]);
        assert_eq!(bench.signal("DES_POSITION"), [f32::from(number)], "{rows}");
    }
}

/// Its memory has the same size, but its position in it would be wrong.
#[test]
fn a_delay_line_of_another_shape_begins_and_writes_nowhere_else() {
    let rows = "
        TIMEDELAY_MOD PORT_SIGNAL_IN POSITION
        TIMEDELAY_MOD PORT_SIGNAL_OUT POSITION.2
        TIMEDELAY_MOD TD_PARAM 4
        MOD_ENG MOD_ON TIMEDELAY_MOD
        SIGGEN_MOD FORM SQUARE
        SIGGEN_MOD AMPLITUDE 7
        MOD_ENG MOD_ON SIGGEN_MOD";
    let mut bench = Bench::of(3, &[types::POSITION, types::LINK_AGE], &[]);
    bench.run(rows);
    let measured = [Word::from(1.0); 3].into_iter().chain([Word(5)]).collect::<Vec<_>>();
    (0..20).for_each(|_| drop(bench.try_tick(&measured)));
    let before = bench.signal("SIGNAL_OUT");
    bench.rows(
        "MOD_ENG BEGIN\nMOD_ENG MOD_OFF TIMEDELAY_MOD\nTIMEDELAY_MOD PORT_SIGNAL_IN LINK_AGE
        TIMEDELAY_MOD PORT_SIGNAL_OUT LINK_AGE.2\nTIMEDELAY_MOD TD_PARAM 12
        MOD_ENG MOD_ON TIMEDELAY_MOD\nMOD_ENG COMMIT",
    );
    for tick in 0..30 {
        assert_eq!(bench.try_tick(&measured).0, TickResult::Ran);
        assert_eq!(bench.bits("LINK_AGE.2"), [if tick < 12 { 0 } else { 5 }], "{tick}");
        assert_eq!(bench.signal("SIGNAL_OUT").len(), before.len());
    }
    assert_eq!(bench.bits("POSITION"), [1.0_f32.to_bits(); 3]);
}

#[test]
fn a_stop_outlasts_a_commit_that_was_checked_before() {
    let mut bench = Joint::new(PD).bench;
    bench.rows("MOD_ENG BEGIN\nMOD_ENG MATCHING_CHECK\nMOD_ENG STOP\nMOD_ENG COMMIT");
    assert!(!bench.dimsart.engine().is_running());
}
