//! Tests of `dimsart sweep` from the user's view.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const GRID: [&str; 4] = [
    "--vary",
    "device.joint.delay_ticks=0:3:1",
    "--vary",
    "device.joint.axis.0.plant.load.inertia=0.05,0.1,0.2",
];

fn sweep(folder: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.args(["sweep", "joint", "--set", "duration_s=0.4", "--out"]).arg(folder);
    command.args(GRID).args(more).output().unwrap()
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn shards_merge_into_what_one_machine_gives() {
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert!(sweep(whole.path(), &[]).status.success());
    for shard in ["1/3", "2/3", "3/3"] {
        assert!(sweep(parts.path(), &["--shard", shard]).status.success());
    }
    let merged = sweep(parts.path(), &["--merge"]);
    assert!(String::from_utf8_lossy(&merged.stdout).contains("12 of 12 points from 3 shards"));
    assert_eq!(read(whole.path(), "sweep.csv"), read(parts.path(), "sweep.csv"));
    assert!(whole.path().join("map.svg").exists());
}

/// A sweep that was killed while writing a row continues, with the same result as an uninterrupted sweep.
#[test]
fn a_sweep_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    assert!(sweep(folder.path(), &[]).status.success());
    let whole = read(folder.path(), "sweep.csv");
    fs::write(folder.path().join("sweep.csv"), &whole[..whole.len() / 2]).unwrap();
    assert!(sweep(folder.path(), &[]).status.success());
    assert_eq!(read(folder.path(), "sweep.csv"), whole);
    // All points are done; another figure only needs a new map.
    let again = sweep(folder.path(), &["--map", "axes.0.phase_margin_deg"]);
    assert!(String::from_utf8_lossy(&again.stdout).contains("12 of 12 points"));
    assert!(read(folder.path(), "map.svg").contains("axes.0.phase_margin_deg"));
}

/// More inertia at the same gains, or more delay, reduces the margin.
#[test]
fn a_row_has_the_figures_of_its_point() {
    let folder = tempfile::tempdir().unwrap();
    sweep(folder.path(), &[]);
    let text = read(folder.path(), "sweep.csv");
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let column = reader.headers().unwrap().iter().position(|name| name == "axes.0.phase_margin_deg").unwrap();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    let margins: Vec<f64> = rows.iter().map(|row| row.get(column).unwrap().parse().unwrap()).collect();
    assert_eq!((rows.len(), rows[0].get(0), rows[11].get(0)), (12, Some("0"), Some("3")));
    for delay in 0..3 {
        for inertia in 0..3 {
            let [less, more] = [delay, delay + 1].map(|delay| margins[3 * delay + inertia]);
            assert!(more < less, "{margins:?}");
        }
    }
}

#[test]
fn what_cannot_be_swept_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (more, expected) in [
        (vec!["--vary", "nothing=1,2"], "nothing"),
        (vec!["--vary", "k=1:2"], "expected KEY=A,B,C"),
        (vec!["--shard", "4/3"], "expected NUMBER/COUNT"),
        (vec!["--map", "axes.0.phase_margin"], "did you mean 'axes.0.phase_margin_deg'?"),
        (vec!["--merge"], "no sweep-N-of-M.csv"),
    ] {
        let output = sweep(folder.path(), &more);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && error.contains(expected), "{more:?}: {error}");
        let _ = fs::remove_file(folder.path().join("sweep.csv"));
    }
}

/// Without `--vary`: the stability map of the bilateral loop, and its border by eigenvalues.
#[test]
fn the_shipped_map_says_what_it_runs_and_has_the_loops_growth() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command.args(["sweep", "--set", "duration_s=0.1", "--out"]).arg(folder.path());
        command.args(more).output().unwrap()
    };
    let output = shipped(&["--shard", "1/50"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("dimsart sweep --vary wall.stiffness_n_per_m=log:"), "{text}");
    assert!(shipped(&["--merge"]).status.success());
    let table = read(folder.path(), "sweep.csv");
    let growth = table.lines().next().unwrap().split(',').position(|name| name == "loops.2.growth_per_tick");
    let stable = table.lines().next().unwrap().split(',').position(|name| name == "stable");
    let rows = table.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
    let verdicts: Vec<bool> = rows
        .map(|row| {
            let growth: f64 = row[growth.unwrap()].parse().unwrap();
            assert_eq!(row[stable.unwrap()] == "true", growth < 1.000_01, "{row:?}");
            growth > 1.0
        })
        .collect();
    assert!(verdicts.contains(&true) && verdicts.contains(&false), "{verdicts:?}");
}

/// Creates neither a run nor a folder.
#[test]
fn a_wrong_setting_or_key_is_wrong_usage_and_said_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (
            &["--set", "link.los=3", "--vary", "dof=1:3:1"][..],
            "dimsart: --set link.los=3: unknown key `link.los`; did you mean `link.loss`?\n",
        ),
        (
            &["--vary", "link.loss=0:2:0.5"],
            "dimsart: --vary, at link.loss=1.5: --set link.loss=1.5: `link.loss` is 1.5, must be",
        ),
        (
            &["joint", "--set", "duration_s=-1", "--vary", "seed=1:2:1"],
            "dimsart: cannot run joint with --set duration_s=-1:\n  duration_s is -1 s, must be > 0 s\n",
        ),
        (
            &["joint", "--vary", "sed=1:2:1"],
            "--vary, at sed=1: --set sed=1: unknown key `sed`; did you mean 'seed'?",
        ),
        (&["joint", "--vary", "seed=1,2", "--vary", "duration_s=1,-1"], "--vary, at seed=1 duration_s=-1: "),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        let out = folder.path().join("sweep");
        let output = command.arg("sweep").args(arguments).arg("--out").arg(&out).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains(expected), "{arguments:?}: {message}");
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(!out.exists());
    }
}

#[test]
fn rows_of_other_settings_are_not_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |subject: &str, duration: &str, seeds: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command.args(["sweep", subject, "--set", duration, "--vary", seeds, "--out"]).arg(folder.path());
        command.output().unwrap()
    };
    assert!(sweep("joint", "duration_s=0.2", "seed=1,2").status.success());
    for other in
        [sweep("joint", "duration_s=0.3", "seed=1,2"), sweep("rokviss", "duration_s=0.2", "seed=1,2")]
    {
        let message = String::from_utf8_lossy(&other.stderr);
        let is_refused =
            message.contains("differ from the settings of this sweep: give another folder with --out");
        assert!(other.status.code() == Some(1) && is_refused, "{message}");
    }
    let more = sweep("joint", "duration_s=0.2", "seed=1,2,3");
    assert!(String::from_utf8_lossy(&more.stdout).contains("3 of 3 points"), "{more:?}");
}

#[test]
fn a_folder_that_is_not_there_is_not_merged() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let output =
        command.args(["sweep", "--vary", "seed=1,2", "--merge", "--out", "not/here"]).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("cannot read the folder not/here: ") && !Path::new("not").exists(), "{message}");
}

/// Returns the rows of a telerobot sweep by column name, and the map of two keys.
fn telerobot(scheme: &str, sets: &[&str], vary: &[&str]) -> (Vec<HashMap<String, String>>, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    command.args(["sweep", "telerobot", "--out"]).arg(folder.path());
    for controller in ["controller.0", "controller.1"] {
        command.arg("--set").arg(format!("{controller}.scheme=builtin:{scheme}"));
    }
    command.args(sets.iter().flat_map(|set| ["--set", set]));
    command.args(vary.iter().flat_map(|values| ["--vary", values]));
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = read(folder.path(), "sweep.csv");
    let rows = csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect();
    (rows, fs::read_to_string(folder.path().join("map.svg")).ok())
}

/// Runs with position-force control agree with the roots of the loop within a tick: round trips of 9 to 21 ticks.
#[test]
fn position_force_is_stable_up_to_the_delay_margin_of_its_loop() {
    let vary = ["device.slave.axis.0.wall.stiffness=300,10000", "link.1.carrier.delay_ticks=4:16:2"];
    let (rows, map) = telerobot("position_force", &["link.0.carrier.delay_ticks=5"], &vary);
    let mut margins = Vec::new();
    for row in &rows {
        let figure = |name: &str| row[name].parse::<f64>().unwrap();
        let (ticks, margin) = (figure("theory.round_trip_ticks"), figure("theory.delay_margin_ticks"));
        assert!((ticks - 5.0 - figure("link.1.carrier.delay_ticks")).abs() < 1e-9);
        if (ticks - margin).abs() > 1.0 {
            assert_eq!(row["stable"] == "true", ticks < margin, "{row:?}");
        }
        margins.push(margin);
    }
    // The smallest unstable round trips by the largest roots of the polynomial (numpy): 21 and 13 ticks.
    assert!(margins[..7].iter().all(|margin| *margin > 20.0 && *margin < 21.0), "{margins:?}");
    assert!(margins[7..].iter().all(|margin| *margin > 12.0 && *margin < 13.0), "{margins:?}");
    assert!(map.unwrap().contains("theory: round trip = delay margin"));
}

/// Bouncing while the hand leads the slave off a hard wall does not count as a limit cycle.
#[test]
fn what_keeps_a_link_passive_is_stable_where_position_force_is_not() {
    let sets = ["device.slave.axis.0.wall.stiffness=13924.7665"];
    let vary = ["link.0.carrier.delay_ticks+link.1.carrier.delay_ticks=8"];
    for (scheme, expected) in [("waves", true), ("tdpa", true), ("tank", true), ("position_force", false)] {
        let (rows, _) = telerobot(scheme, &sets, &vary);
        assert_eq!(
            (rows[0]["stable"] == "true", rows[0]["limit_cycles"] == "0"),
            (expected, expected),
            "{scheme}"
        );
        assert_eq!(rows[0].contains_key("theory.needed_damping"), expected, "{scheme}");
    }
}

/// A lost packet loses the energy that was reported or sent, and adds none.
#[test]
fn a_tenth_of_the_packets_lost_sets_hardly_more_energy_loose() {
    // Remaining debt of a bounded damper, and overdraft of one tick.
    for (scheme, min_j) in [("tdpa", -0.13), ("tank", -4e-3)] {
        let (rows, _) = telerobot(scheme, &[], &["link.0.carrier.loss+link.1.carrier.loss=0,0.1"]);
        let [kept_j, lossy_j] =
            [0, 1].map(|row: usize| rows[row]["energy_ports_min_j"].parse::<f64>().unwrap());
        assert!(rows.iter().all(|row| row["stable"] == "true"), "{rows:?}");
        assert!(rows[1]["lost_packets"].parse::<u32>().unwrap() > 1000, "{rows:?}");
        assert!(
            kept_j >= min_j && lossy_j >= min_j && lossy_j >= 1.1 * kept_j,
            "{scheme}: {kept_j} {lossy_j}"
        );
    }
    let (rows, _) = telerobot("position_force", &[], &["link.0.carrier.loss+link.1.carrier.loss=0.1"]);
    assert!(rows[0]["energy_ports_min_j"].parse::<f64>().unwrap() < -1.0, "sustained oscillation: {rows:?}");
}
