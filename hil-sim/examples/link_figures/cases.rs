//! Table 1 over every carrier, with and without errors: what is set, and what must come of it.

use std::error::Error;
use std::sync::atomic::AtomicBool;

use hil_sim::experiment::Experiment;
use hil_sim::outcome::Outcome;
use hil_sim::rig_file::RigFile;

/// A carrier with its faults under a policy.
pub(crate) struct Case {
    /// For people.
    pub(crate) carrier: &'static str,
    /// Policy and play-out, for people.
    pub(crate) policy: &'static str,
    /// Over the shipped scenario, separated by spaces.
    pub(crate) sets: &'static str,
    /// Whether packets get damaged or lost.
    pub(crate) has_errors: bool,
    /// Whether what is perceived is what is predicted; else lost motion adds up, and two sides creep apart.
    pub(crate) is_perceived: bool,
}

const UART: &str = "UART, 921 600 baud";
const UART_ERRORS: &str = "UART, a bit in 100 000 wrong";
const CAN_FD: &str = "CAN FD, 1 and 4 Mbit/s";
const CAN_FD_ERRORS: &str = "CAN FD, a bit in 100 000 wrong";
const CAN: &str = "classic CAN, 1 Mbit/s, every 3rd tick";
const CAN_ERRORS: &str = "classic CAN, 900 kbit/s, every 4th tick, a bit in 100 000 wrong";
const UDP: &str = "UDP, 5 ms each way";
const UDP_BAD: &str = "UDP, 3 to 7 ms, 1 % lost in bursts";

const fn clean(carrier: &'static str, policy: &'static str, sets: &'static str) -> Case {
    Case { carrier, policy, sets, has_errors: false, is_perceived: true }
}

const fn bad(carrier: &'static str, policy: &'static str, sets: &'static str, is_perceived: bool) -> Case {
    Case { carrier, policy, sets, has_errors: true, is_perceived }
}

/// All of them.
pub(crate) const CASES: [Case; 21] = [
    clean(UART, "zero", "link.carrier=uart link.stale=zero"),
    clean(UART, "limited", "link.carrier=uart link.stale=limited"),
    bad(UART_ERRORS, "zero", "link.carrier=uart uart.bit_error_rate=1e-5 link.stale=zero", false),
    bad(UART_ERRORS, "limited", "link.carrier=uart uart.bit_error_rate=1e-5 link.stale=limited", false),
    bad(
        UART_ERRORS,
        "limited, play-out 4",
        "link.carrier=uart uart.bit_error_rate=1e-5 link.stale=limited link.playout_ticks=4",
        true,
    ),
    clean(CAN_FD, "zero", "link.carrier=can_fd link.stale=zero"),
    clean(CAN_FD, "limited", "link.carrier=can_fd link.stale=limited"),
    bad(CAN_FD_ERRORS, "zero", "link.carrier=can_fd can.bit_error_rate=1e-5 link.stale=zero", true),
    bad(CAN_FD_ERRORS, "limited", "link.carrier=can_fd can.bit_error_rate=1e-5 link.stale=limited", true),
    clean("CAN FD, every 2nd tick", "zero", "link.carrier=can_fd link.every_ticks=2 link.stale=zero"),
    clean("CAN FD, every 5th tick", "zero", "link.carrier=can_fd link.every_ticks=5 link.stale=zero"),
    clean("CAN FD, every 10th tick", "limited", "link.carrier=can_fd link.every_ticks=10 link.stale=limited"),
    clean(CAN, "zero", "link.carrier=can link.every_ticks=3 link.stale=zero"),
    clean(CAN, "limited", "link.carrier=can link.every_ticks=3 link.stale=limited"),
    bad(
        CAN_ERRORS,
        "zero",
        "link.carrier=can can.bits_per_s=900000 link.every_ticks=4 can.bit_error_rate=1e-5 link.stale=zero",
        true,
    ),
    bad(
        CAN_ERRORS,
        "limited",
        "link.carrier=can can.bits_per_s=900000 link.every_ticks=4 can.bit_error_rate=1e-5 link.stale=limited",
        true,
    ),
    clean(UDP, "zero", "link.carrier=udp udp.delay_s=0.005 link.stale=zero"),
    clean(UDP, "limited", "link.carrier=udp udp.delay_s=0.005 link.stale=limited"),
    bad(
        UDP_BAD,
        "zero",
        "link.carrier=udp udp.delay=uniform udp.delay_s=0.003 udp.spread_s=0.004 udp.burst_entry_probability=0.006 \
         udp.burst_exit_probability=0.6 link.stale=zero",
        false,
    ),
    bad(
        UDP_BAD,
        "limited",
        "link.carrier=udp udp.delay=uniform udp.delay_s=0.003 udp.spread_s=0.004 udp.burst_entry_probability=0.006 \
         udp.burst_exit_probability=0.6 link.stale=limited",
        false,
    ),
    bad(
        UDP_BAD,
        "limited, play-out 14",
        "link.carrier=udp udp.delay=uniform udp.delay_s=0.003 udp.spread_s=0.004 udp.burst_entry_probability=0.006 \
         udp.burst_exit_probability=0.6 link.stale=limited link.playout_ticks=14",
        true,
    ),
];

impl Case {
    /// The whole run.
    ///
    /// # Errors
    /// When it cannot be set up.
    pub(crate) fn run(&self) -> Result<Outcome, Box<dyn Error>> {
        let none = ["link.forward_delay_ticks=0", "link.backward_delay_ticks=0"];
        let sets: Vec<String> =
            none.into_iter().chain(self.sets.split_whitespace()).map(str::to_owned).collect();
        let scenario = RigFile::from_shipped("bilateral", &sets)?;
        let experiment = Experiment::new(&scenario)?.without_recording();
        Ok(experiment.run(&AtomicBool::new(false), |_| {}).outcome)
    }
}

/// By how much perceived stiffness is off the prediction, the axis that is off most; none without contact.
pub(crate) fn off(outcome: &Outcome) -> Option<f64> {
    let off = |perceived: &Option<f64>, predicted: &Option<f64>| Some((*perceived)? / (*predicted)? - 1.0);
    let axes = outcome.k_perceived_n_per_m.iter().zip(&outcome.k_predicted_n_per_m);
    axes.filter_map(|(perceived, predicted)| off(perceived, predicted))
        .max_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// What the media damaged or lost, both ways.
pub(crate) fn errors(outcome: &Outcome) -> u64 {
    outcome.media.iter().map(|traffic| traffic.errors).sum()
}
