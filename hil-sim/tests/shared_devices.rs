//! Rigs whose controllers share a device, a bus, or run at rates of their own.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::path::PathBuf;

use hil_sim::experiment::{Run, run};
use hil_sim::rig_file::RigFile;

fn read(name: &str, sets: &[&str]) -> RigFile {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    RigFile::read(RigFile::shipped(name).unwrap(), name, PathBuf::new(), &sets).unwrap()
}

fn wrong(text: &str) -> String {
    RigFile::read(text, "my.toml", PathBuf::new(), &[]).unwrap_err().to_string()
}

fn column(run: &Run, source: &str, signal: &str, axis: usize) -> Vec<f64> {
    let place = run.recording.find(source, signal, Some(axis)).unwrap();
    run.recording.column(place).collect()
}

const JOINTS: [&str; 6] = ["base", "shoulder", "elbow", "roll", "pitch", "tip"];

/// A bus brings a reference a tick later; else six controllers of a joint each do what one of six does.
#[test]
fn six_joint_controllers_move_an_arm_as_one_controller_does() {
    let sets = ["duration_s=1.5", "experiment.margins=false"];
    let (alone, shared) = (run(&read("arm", &sets)).unwrap(), run(&read("arm_bus", &sets)).unwrap());
    assert!(shared.outcome.stable && shared.outcome.faults.is_empty(), "{:?}", shared.outcome);
    for (axis, joint) in JOINTS.iter().enumerate() {
        let (one, other) = (
            column(&alone, "world", "arm.position", axis),
            column(&shared, "world", &format!("{joint}.position"), 0),
        );
        let moved = one.iter().fold(0.0_f64, |most, position| most.max(position.abs()));
        let off = one.iter().zip(other.iter().skip(1)).map(|(one, other)| (one - other).abs());
        let off = off.fold(0.0, f64::max);
        // Gravity pulls from the first tick on, a tick before the first reference comes.
        assert!(off < 2e-3 * moved, "{joint}: {off} rad of {moved}");
        // The coordinator hears where the joint was a tick ago.
        let signal = if axis == 0 { "POSITION".to_owned() } else { format!("POSITION.{}", axis + 1) };
        let heard = column(&shared, "coordinator", &signal, axis);
        let late = heard.iter().skip(1).zip(&other).map(|(heard, was)| (heard - was).abs());
        assert!(late.fold(0.0, f64::max) < 1e-6, "{joint}");
    }
}

/// Twelve frames in a tick, by the bits of CAN FD; at a quarter of the rate they do not fit any more.
#[test]
fn a_bus_that_is_too_slow_is_a_fault_with_its_remedy() {
    let fast = run(&read("arm_bus", &["duration_s=0.2", "experiment.margins=false"])).unwrap().outcome;
    let traffic = fast.media.first().unwrap();
    assert_eq!((traffic.packets, traffic.dropped), (12 * 200, 0));
    assert!((0.7..0.85).contains(&traffic.load), "{traffic:?}");
    let slow = [
        "duration_s=0.2",
        "experiment.margins=false",
        "bus.bus.can_fd.bits_per_s=250000",
        "bus.bus.can_fd.queue_frames=8",
    ];
    let slow = run(&read("arm_bus", &slow)).unwrap().outcome;
    assert!(slow.faults.iter().any(|fault| fault.contains("queue full; raise the bit rates")), "{slow:?}");
}

fn pair(bus: &str, link: &str, every_ticks: u32) -> String {
    format!(
        "duration_s = 0.5\n{bus}\n\
         [[device]]\nname = 'lead'\nmeasures = ['DES_POSITION']\ntakes = []\naxis = [{{}}]\n\
         [[device]]\nname = 'follow'\naxis = [{{ plant.load.inertia = 0.01 }}]\n\
         [[controller]]\ndevice = 'lead'\nscheme = 'SCHEME'\nevery_ticks = {every_ticks}\n\
         [[controller]]\ndevice = 'follow'\nscheme = 'SCHEME'\n\
         [[link]]\nfrom = 'lead'\nto = 'follow'\n{link}\n\
         [[experiment.move]]\ndevice = 'lead'\non = 'DES_POSITION'\nramp = {{ at_s = 0.1, until_s = 0.5, amplitude = \
         1.0 }}\n"
    )
}

const ROWS: &str = "lead COMM_TXMOD CTX_ADD_DATA DES_POSITION\nlead MOD_ENG MOD_ON COMM_TXMOD\n\
                    follow COMM_RXMOD CRX_ADD_DATA DES_POSITION\nfollow MOD_ENG MOD_ON COMM_RXMOD\n\
                    follow PDCTRL_MOD K_PARAM 10\nfollow PDCTRL_MOD D_PARAM 0.3\nfollow MOD_ENG MOD_ON PDCTRL_MOD\n\
                    all MOD_ENG MATCHING_CHECK";

fn run_pair(rows: &str, text: &str) -> Result<Run, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pair.scheme"), rows).unwrap();
    let text = text.replace("SCHEME", "pair.scheme");
    let file =
        RigFile::read(&text, "pair", folder.path().to_owned(), &[]).map_err(|error| error.to_string())?;
    run(&file).map_err(|error| error.to_string())
}

/// Ticks by which what is received is behind what is sent, on an even ramp of 2.5 rad/s.
fn behind_ticks(run: &Run) -> f64 {
    let [sent, got] = ["lead", "follow"].map(|name| column(run, name, "DES_POSITION", 0));
    let behind: Vec<f64> = (300..400).map(|tick| (sent[tick] - got[tick]) / 2.5e-3).collect();
    behind.iter().sum::<f64>() / 100.0
}

/// A packet of one word: 921 600 bit/s take 0.2 ms for it, a path of 7.3 ms ends in the eighth tick.
#[test]
fn every_bus_takes_the_time_that_it_takes() {
    let channels = "lead COMM_TXMOD CTX_CHANNEL 5\nfollow COMM_RXMOD CRX_CHANNEL 5\n";
    for (bus, rows, expected) in [
        ("", ROWS.to_owned(), 0.0),
        ("[[bus]]\nname = 'line'\nuart = {}", ROWS.to_owned(), 1.0),
        ("[[bus]]\nname = 'line'\nudp = { delay_s = 0.0073 }", ROWS.to_owned(), 8.0),
        ("[[bus]]\nname = 'line'\ncan_fd = {}", channels.to_owned() + ROWS, 1.0),
        ("[[bus]]\nname = 'line'\ncan = { bits_per_s = 500000 }", channels.to_owned() + ROWS, 1.0),
    ] {
        let link = if bus.is_empty() { "" } else { "bus = 'line'" };
        let every_ticks = 1;
        let run = run_pair(&rows, &pair(bus, link, every_ticks)).unwrap();
        let behind = behind_ticks(&run);
        assert!((behind - expected).abs() < 0.01, "{bus}: {behind} ticks");
        assert_eq!(run.outcome.media.len(), usize::from(!bus.is_empty()), "{bus}");
    }
}

/// A controller of every fourth tick gives a staircase, on average one and a half ticks behind.
#[test]
fn a_controller_can_have_a_rate_of_its_own() {
    let run = run_pair(ROWS, &pair("", "", 4)).unwrap();
    let steps = column(&run, "follow", "DES_POSITION", 0);
    let changes: Vec<usize> =
        (201..400).filter(|tick| (steps[*tick] - steps[tick - 1]).abs() > 0.0).collect();
    assert!(changes.iter().all(|tick| tick % 4 == 0) && changes.len() == 49, "{changes:?}");
    assert!((steps[300] - 2.5 * 0.2).abs() < 1e-6, "{}", steps[300]);
}

#[test]
fn a_can_link_without_a_channel_of_its_own_is_refused() {
    let text = pair("[[bus]]\nname = 'line'\ncan_fd = {}", "bus = 'line'", 1);
    let error = run_pair(ROWS, &text).unwrap_err();
    assert!(error.contains("from 'lead' to 'follow'") && error.contains("CTX_CHANNEL"), "{error}");
    let both = text.clone() + "[[link]]\nfrom = 'follow'\nto = 'lead'\nbus = 'line'\n";
    let rows = "lead COMM_TXMOD CTX_CHANNEL 5\nfollow COMM_RXMOD CRX_CHANNEL 5\n\
                follow COMM_TXMOD CTX_CHANNEL 5\nlead COMM_RXMOD CRX_CHANNEL 5\n\
                lead COMM_RXMOD CRX_ADD_DATA POSITION\nlead MOD_ENG MOD_ON COMM_RXMOD\n\
                follow COMM_TXMOD CTX_ADD_DATA POSITION\nfollow MOD_ENG MOD_ON COMM_TXMOD\n"
        .to_owned()
        + ROWS;
    let error = run_pair(&rows, &both).unwrap_err();
    assert!(error.contains("share channel 5 of one CAN bus"), "{error}");
}

#[test]
fn what_does_not_fit_together_is_said_before_anything_runs() {
    let text = pair("[[bus]]\nname = 'line'\nuart = {}\ncan = {}", "bus = 'lin'", 0);
    let error = wrong(&text);
    for expected in [
        "bus 'line': set exactly one of uart, can, can_fd, udp",
        "unknown bus 'lin'; did you mean 'line'?",
        "every_ticks is 0",
    ] {
        assert!(error.contains(expected), "{expected} is not in\n{error}");
    }
    let arm = RigFile::shipped("arm_bus").unwrap();
    let error = wrong(&arm.replace("axes = [3]", "axes = [2, 6]").replace("to = \"tip\"", "to = \"tool\""));
    for expected in [
        "axis 2 of 'arm' has 2 controllers",
        "axis 3 of 'arm' has 0 controllers",
        "a controller uses axis 6 of 'arm', but the axes are 0 to 5",
        "unknown controller 'tool'",
    ] {
        assert!(error.contains(expected), "{expected} is not in\n{error}");
    }
}

/// A file's own type is moved, sent and summed like any other; its unit is held against those of ports.
#[test]
fn a_file_declares_types_of_its_own() {
    let text =
        pair("[[type]]\nname = 'GRIP_WIDTH'\nunit = 'm'\n[[type]]\nname = 'GRIP_FORCE'\nunit = 'N'", "", 1)
            .replace("measures = ['DES_POSITION']", "measures = ['DES_POSITION', 'GRIP_WIDTH']");
    let text = text
        + "[[experiment.move]]\ndevice = 'lead'\non = 'GRIP_WIDTH'\nstep = { at_s = 0.1, amplitude = 0.04 }\n";
    let run = run_pair(ROWS, &text).unwrap();
    let widths = column(&run, "lead", "GRIP_WIDTH", 0);
    assert!(widths[50].abs() < 1e-9 && (widths[200] - 0.04).abs() < 1e-6);
    let rows = ROWS.replace(
        "follow PDCTRL_MOD K_PARAM",
        "lead SUM_MOD PORT_A GRIP_WIDTH\nlead SUM_MOD PORT_B \
    DES_POSITION\nlead MOD_ENG MOD_ON SUM_MOD\nfollow PDCTRL_MOD K_PARAM",
    );
    run_pair(&rows, &text).unwrap();
    let error = wrong(&text.replace("unit = 'm'", "unit = 'inch'").replace("'GRIP_FORCE'", "'FORCE'"));
    for expected in ["unknown unit 'inch'; use one of 1, m,", "type 'FORCE' is already a built-in type"] {
        assert!(error.contains(expected), "{expected} is not in\n{error}");
    }
}
