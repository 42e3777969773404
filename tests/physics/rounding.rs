//! Effect of rounding on long contact with a wall.

use hil_sim::experiment;
use hil_sim::observer::creep::rounding_creep_m_per_s;
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::BUILT_IN;

const RIG: &str = r#"
    duration_s = 40.0
    device = [
        { name = "master", axis = [{ unit = "m", plant.load = { inertia = 0.05, damping = 0.5 }, hand = { inertia = 0.05, damping = 10.0, stiffness = 300.0 } }] },
        { name = "slave", axis = [{ unit = "m", plant.load = { inertia = 0.2, damping = 10.0 }, wall = { position = 0.02, stiffness = 1e4, damping = 10.0 } }] },
    ]
    controller = [{ device = "master", scheme = "own.scheme" }, { device = "slave", scheme = "own.scheme" }]
    link = [{ from = "master", to = "slave" }, { from = "slave", to = "master" }]
    [experiment]
    margins = false
    move = [{ device = "master", on = "hand", minimum_jerk = { at_s = 0.2, until_s = 1.0, amplitude = 0.05 } }]
"#;

/// At some impedances rounding errors cancel; the bound holds for all.
#[test]
fn a_hand_in_contact_creeps_by_less_than_the_bound_of_rounding() {
    let shipped = BUILT_IN.iter().find(|(name, _)| *name == "bilateral").unwrap().1;
    let mut max_share = 0.0_f64;
    for impedance in ["3.9", "7.3", "10", "21.7"] {
        let folder = tempfile::tempdir().unwrap();
        let rows = shipped.lines().map(|row| match row.split_whitespace().collect::<Vec<_>>().as_slice() {
            [dest, module, command @ "B_PARAM", _] => format!("{dest} {module} {command} {impedance}"),
            ["slave", module, command @ "K_PARAM", _] => format!("slave {module} {command} 2500"),
            _ => row.to_owned(),
        });
        std::fs::write(folder.path().join("own.scheme"), rows.collect::<Vec<_>>().join("\n")).unwrap();
        let file = RigFile::read(RIG, "rounding", folder.path().to_owned(), &[]).unwrap();
        let run = experiment::run(&file).unwrap();
        let column = |source: &str, signal: &str| -> Vec<f64> {
            run.recording.column(run.recording.find(source, signal, Some(0)).unwrap()).collect()
        };
        let (positions_m, forces_n) = (column("world", "master.position"), column("master", "DES_FORCE"));
        let at = |tick: usize| positions_m.get(tick).copied().unwrap();
        let crept_m_per_s = (at(39_000) - at(15_000)) / 24.0;
        let force_n = forces_n.last().unwrap().abs();
        assert!(force_n > 4.0, "{force_n} N: it is not in contact");
        let bound_m_per_s = 2.0 * rounding_creep_m_per_s(force_n, impedance.parse().unwrap());
        assert!(
            crept_m_per_s.abs() < bound_m_per_s,
            "b = {impedance}: {crept_m_per_s} m/s, bound {bound_m_per_s}"
        );
        max_share = max_share.max(crept_m_per_s.abs() / bound_m_per_s);
    }
    assert!(max_share > 0.01, "the bound is of another thing: {max_share}");
}
