//! A law as text on the flash image: uploaded while it ticks, plugged in, saved, and present after a restart.

use std::sync::Arc;

use cycles::image::Image;
use hil_sim::law::Law;

use crate::common::{Shared, bench_of, image};

/// Longer than a start.
const START_S: f64 = 0.1;

const LAW: &str = "law SPRING \"A spring to where it stood.\"
in position: POSITION
out force: DES_FORCE
param stiffness: Stiffness = 0.1 in 0..10
param offset: Force = 0.02 in -1..1
state rest = position
force = stiffness * (rest - position) + offset";

fn start() -> Option<Shared> {
    let image: Arc<Image> = image("nucleo-g474re-online")?;
    let shared = Shared::of(bench_of("nucleo-g474re", image));
    shared.run_for(START_S);
    Some(shared)
}

fn force(shared: &Shared) -> String {
    let signals = shared.identify().signals(&["DES_FORCE".to_owned()]).unwrap();
    signals.iter().map(ToString::to_string).collect()
}

#[test]
fn a_law_is_uploaded_plugged_in_saved_and_runs_after_a_restart_and_no_tick_is_lost() {
    let Some(shared) = start() else { return };
    let law = Law::compile(LAW, "spring.law").unwrap();
    let mut device = shared.identify();
    let report = device.upload_law(&law, None).unwrap();
    assert_eq!((report.number, report.is_used, report.cycles.is_some()), (1, false, true), "{report}");
    device.begin().unwrap();
    device.unplug("PDCTRL_MOD").unwrap();
    device.set("ONLINE_MOD", "PROGRAM", "1").unwrap();
    device.set("ONLINE_MOD", "offset[0]", "0.5").unwrap();
    assert!(device.set("ONLINE_MOD", "offset", "1.5").is_err(), "the range of the law");
    // In place of the PD controller: later modules read its force.
    device.plug_in("ONLINE_MOD", Some("TIMEDELAY_MOD")).unwrap();
    device.commit().unwrap();
    shared.run_for(START_S);
    assert!(force(&shared).contains("0.5"), "{}", force(&shared));
    assert!(device.laws().unwrap().laws[0].is_used);
    let refused = device.remove_law(1).unwrap_err().to_string();
    assert!(refused.contains("a module has the law"), "{refused}");
    assert_eq!(device.save().unwrap().trial, "waits");
    let timing = device.overview().unwrap().status.timing.unwrap();
    println!("{report}; {timing}");
    assert_eq!((timing.late, timing.overruns), (0, 0), "{timing}");

    shared.bench().reset();
    shared.run_for(START_S);
    let mut device = shared.identify();
    let kept = device.overview().unwrap().status.schemes.unwrap();
    assert_eq!(kept.origin, "trial", "{kept}");
    assert!(force(&shared).contains("0.5"), "{}", force(&shared));
    let laws = device.laws().unwrap();
    assert_eq!((laws.laws[0].name.as_str(), laws.laws[0].is_used), ("SPRING", true), "{laws}");
    shared.assert_sound();
}

#[test]
fn a_damaged_law_and_one_that_takes_too_long_are_refused_and_nothing_changes() {
    let Some(shared) = start() else { return };
    let mut device = shared.identify();
    let before = device.scheme_rows(None).unwrap();
    let mut law = Law::compile(LAW, "spring.law").unwrap();
    law.words[6] ^= 1;
    let refused = device.upload_law(&law, Some(2)).unwrap_err().to_string();
    assert!(refused.contains("differs from the uploaded law"), "{refused}");
    assert_eq!(device.laws().unwrap().laws, []);
    assert_eq!(device.scheme_rows(None).unwrap(), before);

    // Of a law with the maximum number of square roots, one instance fits the tick, a second does not.
    let roots: String = (1..90).map(|n| format!("let a{n} = sqrt(a{})\n", n - 1)).collect();
    let long = format!("law ROOTS\nin x: POSITION\nout f: DES_FORCE.2\nlet a0 = abs(x)\n{roots}f = a89");
    let report = device.upload_law(&Law::compile(&long, "long.law").unwrap(), None).unwrap();
    assert_eq!(report.number, 1, "{report}");
    device.set("ONLINE_MOD", "PROGRAM", "1").unwrap();
    device.plug_in("ONLINE_MOD", None).unwrap();
    device.set("ONLINE_MOD.2", "PROGRAM", "1").unwrap();
    device.set("ONLINE_MOD.2", "PORT_f", "DES_FORCE.3").unwrap();
    let refused = device.plug_in("ONLINE_MOD.2", None).unwrap_err().to_string();
    assert!(refused.contains("cycles"), "{refused}");
    shared.run_for(START_S);
    let timing = device.overview().unwrap().status.timing.unwrap();
    assert_eq!((timing.late, timing.overruns), (0, 0), "{timing}");
    shared.assert_sound();
}
