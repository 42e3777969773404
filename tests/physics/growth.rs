use std::sync::atomic::AtomicBool;
use dimsart_core::types;
use hil_sim::growth::Growth;
use hil_sim::rig::{Probe, Rig};
use hil_sim::experiment::Experiment;
use hil_sim::scenario::Scenario;
use crate::loops::{delays, scenario};
use crate::stability::{held, nudge};

fn look(rig: &mut Rig, ticks: u64, label: &str) {
    let mut signals: Vec<_> = rig.stations().iter().enumerate().flat_map(|(i, s)| [types::DES_FORCE, types::CH1_WAVES, types::CH2_WAVES].into_iter().map(move |t| (i, t.name, Probe::new(t.first()), Vec::<Growth>::new(), if t.name == "DES_FORCE" { 30.0 } else { 10.0 }))).collect();
    let mut seen: Option<String> = None;
    let mut left: Option<u64> = None;
    for k in 0..ticks {
        rig.tick();
        for (i, name, probe, growths, range) in &mut signals {
            for (axis, v) in probe.values(&rig.stations()[*i]).enumerate() {
                if growths.len() <= axis { growths.push(Growth::new(*range * 1e-4)); }
                if let Some(g) = growths[axis].add(v) && seen.is_none() { seen = Some(format!("tick {k} station {i} {name}[{axis}] {g:.5}")); }
                if v.abs() > *range && left.is_none() { left = Some(k); }
            }
        }
        if left.is_some() { break; }
        rig.advance();
    }
    let most = signals.iter().flat_map(|(i, n, _, g, _)| g.iter().enumerate().map(move |(a, g)| (g.most(), *i, *n, a))).max();
    println!("{label}: seen {seen:?} left {left:?} most {most:?}");
}


#[test]
fn explore() {
    let dump = |settings: &str, ticks: u64| {
        let s: Vec<String> = settings.split_whitespace().map(str::to_owned).collect();
        let scenario = Scenario::load(None, &s).unwrap();
        let mut e = Experiment::new(&scenario).unwrap();
        println!("== {settings}");
        let mut last = [[0.0; 3]; 2];
        let mut peaks = vec![[[0.0_f64; 3]; 2]; (ticks / 16 + 1) as usize];
        let rig = e.rig_mut();
        for k in 0..ticks {
            rig.tick();
            for st in 0..2 { for (j, t) in [types::DES_FORCE, types::CH1_WAVES, types::CH2_WAVES].into_iter().enumerate() {
                let v = Probe::new(t.first()).values(&rig.stations()[st]).next().unwrap();
                let d: f64 = v - last[st][j]; last[st][j] = v;
                let p = &mut peaks[(k / 16) as usize][st][j]; *p = p.max(d.abs());
            } }
            rig.advance();
        }
        for st in 0..2 { for j in 0..3 { print!("{st} {j}:"); for p in &peaks { print!(" {:.0e}", p[st][j]); } println!(); } }
    };
    dump("wave.form=printed", 400);
    dump("", 640);
    dump("link.loss=0.1", 640);
    let _ = (AtomicBool::new(false), scenario, delays, held, nudge, look);
}
