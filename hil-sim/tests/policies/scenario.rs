//! A scenario: settings of a pair, and events.

use crate::faulty_pair::{Fault, Line, Shows, Writes};
use dimsart_link::protocol::LeaseAction;
use proptest::collection::vec;
use proptest::option::weighted;
use proptest::prelude::*;
use proptest::sample::select;

/// Tick from which on nothing is wrong any more, whatever has begun.
pub(crate) const LAST_FAULT_TICK: u32 = 360;

/// All that makes a run what it is. Written out by `{:?}` it can be run again.
#[derive(Debug, Clone)]
pub(crate) struct Scenario {
    pub(crate) dof: usize,
    /// Of the lines to master and slave.
    pub(crate) link_ticks: [u32; 2],
    /// Rows of the scheme in the place of those with the same command.
    pub(crate) settings: Vec<(&'static str, u32)>,
    pub(crate) stale: &'static str,
    pub(crate) wall_mm: u32,
    pub(crate) amplitude_mm: u32,
    pub(crate) spare_cycles: u32,
    pub(crate) events: Vec<Event>,
}

/// Something that happens at a side, before a tick.
#[derive(Debug, Clone)]
pub(crate) struct Event {
    pub(crate) tick: u32,
    pub(crate) side: usize,
    pub(crate) what: What,
}

#[derive(Debug, Clone)]
pub(crate) enum What {
    /// A fault for so many ticks.
    Wrong { fault: Fault, axis: usize, ticks: u32 },
    /// The client that holds the lease, or did, wants something of it.
    Lease(LeaseAction),
    /// It gives these rows, one after the other.
    Rows(Vec<&'static str>),
    /// Another client gives a row.
    RejectedPackets(&'static str),
    /// Another client wants something of the lease.
    StrangerLease(LeaseAction),
}

const MODULES: [&str; 5] = ["COMM_RXMOD", "WTRANSF_MOD", "PDCTRL_MOD", "TIMEDELAY_MOD", "COMM_TXMOD"];

/// What an operator does when he does it: among them what is refused, and what is no good.
const ROWS: &[&str] = &[
    "MOD_ENG RESET",
    "MOD_ENG RESET",
    "MOD_ENG STOP",
    "MOD_ENG MATCHING_CHECK",
    "MOD_ENG BEGIN",
    "MOD_ENG COMMIT",
    "MOD_ENG ABORT",
    "MOD_ENG MOD_OFF WTRANSF_MOD",
    "MOD_ENG MOD_OFF TIMEDELAY_MOD",
    "MOD_ENG MOD_OFF COMM_TXMOD",
    "MOD_ENG MOD_OFF FAILING_MOD.2",
    "MOD_ENG MOD_ON PDCTRL_MOD",
    "MOD_ENG MOD_ON COMM_TXMOD",
    "MOD_ENG MOD_RESET PDCTRL_MOD",
    "MOD_ENG MOD_RESET COMM_RXMOD",
    "MOD_ENG MOD_RESET FAILING_MOD.2",
    "MOD_ENG MOD_CLOSE PDCTRL_MOD",
    "MOD_ENG MOD_INIT PDCTRL_MOD",
    "MOD_ENG CLOSE",
    "PDCTRL_MOD K_PARAM 0",
    "PDCTRL_MOD K_PARAM 1e6",
    "PDCTRL_MOD K_PARAM 1e7",
    "PDCTRL_MOD D_PARAM 1e4",
    "PDCTRL_MOD EVERY_TICKS 5",
    "WTRANSF_MOD B_PARAM 0.001",
    "WTRANSF_MOD B_PARAM 1e4",
    "WTRANSF_MOD B_PARAM 0",
    "TIMEDELAY_MOD TD_PARAM 0",
    "TIMEDELAY_MOD TD_PARAM 60001",
    "COMM_RXMOD STALE HOLD",
    "COMM_RXMOD CRX_CHANNEL 7",
];

/// Changes that are sound, and some that are not.
const TRANSACTIONS: &[&[&str]] = &[
    &["MOD_ENG BEGIN", "PDCTRL_MOD K_PARAM 2000", "MOD_ENG COMMIT"],
    &["MOD_ENG BEGIN", "MOD_ENG MOD_OFF TIMEDELAY_MOD", "TIMEDELAY_MOD TD_PARAM 3", "MOD_ENG COMMIT"],
    &[
        "MOD_ENG BEGIN",
        "MOD_ENG MOD_OFF TIMEDELAY_MOD",
        "TIMEDELAY_MOD TD_PARAM 3",
        "MOD_ENG MOD_ON TIMEDELAY_MOD",
        "MOD_ENG COMMIT",
    ],
    &[
        "MOD_ENG BEGIN",
        "MOD_ENG MOD_OFF FAILING_MOD.2",
        "PDCTRL_MOD PORT_DES_FORCE DES_FORCE",
        "MOD_ENG COMMIT",
    ],
    &["MOD_ENG BEGIN", "MOD_ENG MOD_OFF COMM_TXMOD", "MOD_ENG MOD_ON COMM_TXMOD", "MOD_ENG COMMIT"],
    &["MOD_ENG BEGIN", "MOD_ENG CLOSE", "MOD_ENG ABORT"],
];

fn shows() -> impl Strategy<Value = Shows> {
    prop_oneof![
        select(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, 1e6, 0.0][..]).prop_map(Shows::This),
        select(&[1e-3_f32, -1e-2, 1.0][..]).prop_map(Shows::More),
        Just(Shows::Stuck),
        select(&[1e-5_f32, -1e-3, 4e-3][..]).prop_map(Shows::Drift),
    ]
}

fn fault() -> impl Strategy<Value = Fault> {
    let writes = select(&[Writes::Nan, Writes::Infinity, Writes::Large][..]);
    let line = prop_oneof![
        Just(Line::Silent(u32::MAX)),
        (1..3_u32).prop_map(|every| Line::Damaged { every }),
        Just(Line::Repeats),
        Just(Line::Doubles),
    ];
    prop_oneof![
        4 => shows().prop_map(Fault::Sensor),
        1 => Just(Fault::ShortFrame),
        1 => Just(Fault::LongFrame),
        1 => Just(Fault::ActuatorStuck),
        3 => (1..4_u8, writes).prop_map(|(place, writes)| Fault::Writes(place, writes)),
        3 => (select(&MODULES[..]), select(&[10, 30, 500][..]))
            .prop_map(|(module, percent)| Fault::TakesLonger(module, percent)),
        4 => line.prop_map(Fault::Line),
        1 => Just(Fault::LeaseNotRenewed),
    ]
}

fn what() -> impl Strategy<Value = What> {
    let action = || select(&[LeaseAction::Take, LeaseAction::Release, LeaseAction::Renew][..]);
    // A silence of 20 ticks loses the link; 19 ticks do not.
    let ticks = prop_oneof![4 => 1..30_u32, 1 => 19..21_u32, 1 => 30..300_u32];
    prop_oneof![
        10 => (fault(), 0..3_usize, ticks)
            .prop_map(|(fault, axis, ticks)| What::Wrong { fault, axis, ticks }),
        3 => action().prop_map(What::Lease),
        4 => select(ROWS).prop_map(|row| What::Rows(vec![row])),
        2 => select(TRANSACTIONS).prop_map(|rows| What::Rows(rows.to_vec())),
        1 => select(ROWS).prop_map(What::RejectedPackets),
        1 => action().prop_map(What::StrangerLease),
        // As a whole it lets an operator go on in the midst of what is wrong.
        3 => Just(What::Rows(vec!["MOD_ENG RESET"])),
        3 => Just(What::Lease(LeaseAction::Take)),
    ]
}

/// A large force, a fault, and who is in a hurry: a reset before the device has reached its safe value is rare otherwise.
fn hurry(tick: u32, side: usize) -> [Event; 4] {
    let wrong = |fault, ticks| What::Wrong { fault, axis: 0, ticks };
    let reset = || What::Rows(vec!["MOD_ENG RESET"]);
    // As fast as a sensor can show: what jumps is refused, and makes no force.
    let run = wrong(Fault::Sensor(Shows::Drift(4e-3)), 8);
    let all = [(0, run), (8, wrong(Fault::ShortFrame, 1)), (9, reset()), (12, reset())];
    all.map(|(after_ticks, what)| Event { tick: tick + after_ticks, side, what })
}

/// Any scenario, the simplest one without events.
pub(crate) fn scenarios() -> impl Strategy<Value = Scenario> {
    // Close to each other: that a reset meets a fault's first ticks, and several faults come at once.
    let tick = (0..15_u32, 0..4_u32).prop_map(|(cluster, tick)| 20 + 20 * cluster + tick);
    let event = (tick, 0..2_usize, what()).prop_map(|(tick, side, what)| Event { tick, side, what });
    let settings = (0..20_u32, select(&[3000, 2000, 4000][..]), select(&[10, 8, 12][..])).prop_map(
        |(delay_ticks, stiffness, impedance)| {
            vec![("TD_PARAM", delay_ticks), ("K_PARAM", stiffness), ("B_PARAM", impedance)]
        },
    );
    let place = (select(&["ZERO", "LIMITED"][..]), 2..30_u32, 0..30_u32, select(&[0, 2000][..]));
    let hurried = weighted(0.1, (20..300_u32, 0..2_usize));
    (1..4_usize, [0..4_u32, 0..4_u32], settings, place, (vec(event, 0..9), hurried)).prop_map(
        |(dof, link_ticks, settings, (stale, wall_mm, amplitude_mm, spare_cycles), (mut events, hurried))| {
            events.extend(hurried.into_iter().flat_map(|(tick, side)| hurry(tick, side)));
            events.sort_by_key(|event| event.tick);
            Scenario { dof, link_ticks, settings, stale, wall_mm, amplitude_mm, spare_cycles, events }
        },
    )
}
