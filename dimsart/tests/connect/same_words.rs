//! The same fault has the same text in a file and on a device.

use dimsart::connect::{ConnectError, Device};
use dimsart_core::Dimsart;
use hil_sim::link::Stream;
use hil_sim::schemes::{LoadReport, SIDES, SchemeText, load};

use crate::emulated::{Emulated, QUICK, Robot};

const BILATERAL: &str = include_str!("../../../schemes/bilateral.scheme");
const NOTHING: &str = "; nothing has changed";

/// Mistakes of more than one word.
const WHOLE: &[&str] = &[
    "all MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MOD_ON PCTRL_MOD",
    "all PDCTRL_MOD PORT_POSITION MAP\nall MOD_ENG MOD_ON PDCTRL_MOD",
    "all PDCTRL_MOD PORT_POSITION CH1_WAVES\nall MOD_ENG MOD_ON PDCTRL_MOD",
    "all PDCTRL_MOD PORT_POSITION RECORDED_ROWS\nall MOD_ENG MOD_ON PDCTRL_MOD",
    "all INTEG_MOD PORT_SIGNAL_IN FORCE\nall INTEG_MOD PORT_SIGNAL_OUT POSITION\nall MOD_ENG MOD_ON INTEG_MOD",
    "all VEL2POS_MOD PORT_VELOCITY DES_POSITION\nall MOD_ENG MOD_ON VEL2POS_MOD",
    "all TIMEDELAY_MOD PORT_SIGNAL_IN FORCE\nall TIMEDELAY_MOD PORT_SIGNAL_OUT POSITION\n\
     all MOD_ENG MOD_ON TIMEDELAY_MOD",
    "all TIMEDELAY_MOD PORT_SIGNAL_IN FORCE\nall TIMEDELAY_MOD PORT_SIGNAL_OUT FORCE\n\
     all MOD_ENG MOD_ON TIMEDELAY_MOD",
    "all COMM_TXMOD CTX_ADD_DATA POSITION\nall MOD_ENG MOD_ON COMM_TXMOD\nall MOD_ENG MOD_ON COMM_TXMOD.2",
    "all COMM_RXMOD CRX_ADD_DATA FORCE\nall MOD_ENG MOD_ON COMM_RXMOD\nall MOD_ENG MOD_ON COMM_RXMOD.2",
    "all SUM_MOD PORT_A POSITION\nall SUM_MOD PORT_B FORCE\nall MOD_ENG MOD_ON SUM_MOD",
    "all MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MOD_ON PDCTRL_MOD",
    "all MOD_ENG MOD_OFF PDCTRL_MOD",
    "all MOD_ENG MOD_RESET PDCTRL_MOD",
    "all MOD_ENG MOD_CLOSE PDCTRL_MOD.3",
    "all MOD_ENG PLACE_BEFORE PDCTRL_MOD",
    "all MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MOD_INIT PDCTRL_MOD",
    "all MOD_ENG MOD_ON PDCTRL_MOD\nall PDCTRL_MOD PORT_POSITION POSITION.2",
    "all MOD_ENG MOD_ON TIMEDELAY_MOD\nall TIMEDELAY_MOD TD_PARAM 3",
    "all TIMEDELAY_MOD TD_PARAM 60000\nall MOD_ENG MOD_ON TIMEDELAY_MOD",
    "all RECORDER_MOD LENGTH 60000\nall MOD_ENG MOD_ON RECORDER_MOD",
    "all PDCTRL_MOD K_PARAM[3] 1",
    "all PDCTRL_MOD K_PARAM[300] 1",
    "all PDCTRL_MOD K_PARAM[x] 1",
    "all PDCTRL_MOD LAW_OUTPUT[0] ON",
    "all PDCTRL_MOD LAW_OUTPUT MAYBE",
    "all WTRANSF_MOD CONF_MODE SLAV",
    "all PDCTRL_MOD PORT_ POSITION",
    "all PDCTRL_MOD PORT_POSITION",
    "all TIMEDELAY_MOD PORT_LINE FORCE",
    "all COMM_RXMOD CRX_ADD_DATA",
    "all COMM_RXMOD CRX_ADD_DATA WAVES",
    "all COMM_RXMOD STALE LIMITED\nall COMM_RXMOD CRX_COUNTERS OFF",
    "all PDCTRL_MOD.0 K_PARAM 1",
    "all PDCTRL_MOD.256 K_PARAM 1",
    "all SIGGEN_MOD FREQUENCY -1",
    "all TIMEDELAY_MOD TD_PARAM 1.5",
];

/// A final row that checks the whole scheme.
const CHECK: &str = "\nall MOD_ENG MATCHING_CHECK\n";

fn offline(rows: &SchemeText, side: &str) -> LoadReport {
    let Robot { mut dimsart, .. } = Robot::new();
    let dimsart: &mut Dimsart = &mut dimsart;
    load(rows, side, &[], dimsart)
}

/// Compares a device's texts about a scheme with those about its file; returns false for a valid scheme.
fn is_the_same(device: &mut Device<Box<dyn Stream>>, rows: String, side: &str) -> bool {
    let scheme = SchemeText { name: "my.scheme".to_owned(), text: rows };
    let LoadReport { errors, faults, delays } = offline(&scheme, side);
    device.delete_module(None).unwrap();
    let sent = device.send_scheme(&scheme, side);
    if let Some(expected) = errors.first() {
        let found = sent.unwrap_err().to_string();
        assert_eq!(found.strip_suffix(NOTHING), Some(expected.as_str()), "{side}\n{}", scheme.text);
        return true;
    }
    let is_of_check = |text: &&String| !text.contains("the scheme is stopped after its last row");
    let faults: Vec<_> = faults.into_iter().filter(|text| is_of_check(&text)).collect();
    match sent {
        Ok(_) => {
            let texts = device.check().unwrap().findings.into_iter().map(|finding| finding.text);
            assert_eq!(
                texts.collect::<Vec<_>>(),
                [faults.clone(), delays].concat(),
                "{side}\n{}",
                scheme.text
            );
        }
        Err(ConnectError::InvalidRow { message, .. }) => {
            let expected =
                format!("refused: the scheme has {} fault(s): {}", faults.len(), faults.join("; "));
            assert_eq!(message, expected, "{side}\n{}", scheme.text);
        }
        Err(error) => assert_eq!(error.to_string(), "", "{}", scheme.text),
    }
    !faults.is_empty()
}

/// Returns variants of a line with one mistake: words omitted, mistyped, repeated, or added.
fn mistaken(line: &str) -> Vec<String> {
    let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
    let mut lines = vec![String::new(), format!("{line}\n{line}"), format!("{} more", words.join(" "))];
    for index in 0..words.len() {
        let with = |word: String| {
            let mut words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
            words[index] = word;
            words.join(" ")
        };
        let word = words[index];
        let shorter: String = word.chars().take(word.chars().count() - 1).collect();
        lines.extend([with(String::new()), with(shorter), with(format!("{word}X")), with("-1".to_owned())]);
    }
    lines
}

#[test]
fn a_fault_reads_the_same_in_a_file_and_on_a_device() {
    let emulated = Emulated::start();
    let mut device = emulated.connect(QUICK);
    for rows in WHOLE {
        assert!(is_the_same(&mut device, format!("{rows}{CHECK}"), "master"), "no fault: {rows}");
    }
    let modules: String = (1..=33).map(|number| format!("all PCTRL_MOD.{number} K_PARAM 1\n")).collect();
    assert!(is_the_same(&mut device, modules, "master"));
}

#[test]
fn every_mistake_in_the_shipped_scheme_reads_the_same_in_a_file_and_on_a_device() {
    let emulated = Emulated::start();
    let mut device = emulated.connect(QUICK);
    let lines: Vec<&str> = BILATERAL.lines().collect();
    for side in SIDES {
        let mut faulty = 0;
        for (place, line) in lines.iter().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            for instead in mistaken(line) {
                let mut rows: Vec<&str> = lines.clone();
                rows[place] = &instead;
                faulty += u32::from(is_the_same(&mut device, rows.join("\n"), side));
            }
        }
        assert!(faulty > 150, "{side}: {faulty} faulty schemes");
    }
}
