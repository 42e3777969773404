//! Schemes have the names that a law's text gives to its parameters and ports.

use hil_sim::law::Law;
use hil_sim::schemes::{LoadReport, SchemeText, load};

use super::{controller, keep, tick};

const LAW: &str = "law SPRING
in x: POSITION
in rest: DES_POSITION
out force: DES_FORCE
param stiffness: Stiffness = 2 in 0..10
param offset: Force = 0 in -1..1
force = stiffness * (rest - x) + offset";

/// What rows with the law as number 1 come to, and the forces of a tick at two axes.
fn run(rows: &str) -> (LoadReport, Option<Vec<f32>>) {
    let mut dimsart = controller(2);
    keep(&mut dimsart, 1, &Law::compile(LAW, "spring.law").unwrap());
    let text = format!("{rows}\nall MOD_ENG MOD_ON ONLINE_MOD\nall MOD_ENG MATCHING_CHECK");
    let scheme = SchemeText { name: "my.scheme".to_owned(), text };
    let loaded = load(&scheme, "master", &[], &mut dimsart);
    let forces = loaded.is_valid().then(|| tick(&mut dimsart, &[1.0, 2.0, 8.0, 16.0, 0.5, 0.5]));
    (loaded, forces)
}

#[test]
fn a_scheme_sets_and_binds_by_the_laws_own_names_or_by_the_controllers() {
    for [stiffness, offset, rest] in [["stiffness", "offset", "rest"], ["P_1", "P_2", "IN_2"]] {
        let rows = format!(
            "all ONLINE_MOD PROGRAM 1\nall ONLINE_MOD {stiffness} 4\nall ONLINE_MOD {stiffness}[1] 6\n\
             all ONLINE_MOD {offset} -0.5\nall ONLINE_MOD PORT_{rest} VELOCITY\nall ONLINE_MOD EVERY_TICKS 1"
        );
        let (loaded, forces) = run(&rows);
        assert_eq!(loaded.errors, [""; 0], "{stiffness}");
        assert!(!loaded.is_valid(), "a velocity is no position");
        assert_eq!(forces, None);
        let (loaded, forces) = run(&rows.replace("VELOCITY", "POSITION"));
        assert_eq!(loaded, LoadReport::default());
        assert_eq!(forces, Some(vec![-0.5, -0.5]), "{stiffness}");
        let (_, forces) = run(&rows.replace("VELOCITY", "DES_POSITION"));
        assert_eq!(forces, Some(vec![-2.5, -9.5]), "{stiffness}");
    }
}

#[test]
fn a_name_that_the_law_does_not_have_is_pointed_to_with_those_that_it_has() {
    let names = "available: PROGRAM, stiffness, offset, PORT_x, PORT_rest, PORT_force";
    for (row, expected) in [
        (
            "stifness 4",
            format!(
                "my.scheme:2:16: 'stifness' is not a parameter or port of ONLINE_MOD; did you mean 'stiffness'? \
                {names}"
            ),
        ),
        ("gain 4", format!("my.scheme:2:16: 'gain' is not a parameter or port of ONLINE_MOD; {names}")),
        ("PORT_y POSITION", format!("did you mean 'PORT_x'? {names}")),
        ("stiffness 11", "my.scheme:2:26: '11' is not a number from 0 to 10 N·m/rad".to_owned()),
        ("stiffness[2] 1", "my.scheme:2:16: ".to_owned()),
    ] {
        let (loaded, _) = run(&format!("all ONLINE_MOD PROGRAM 1\nall ONLINE_MOD {row}"));
        let [error] = &loaded.errors[..] else { panic!("{row}: {loaded:?}") };
        assert!(error.contains(&expected), "{row}: {error}");
    }
}

#[test]
fn a_module_has_the_names_of_the_law_that_its_rows_have_given_it_so_far() {
    let (loaded, _) = run("all ONLINE_MOD stiffness 4\nall ONLINE_MOD PROGRAM 1");
    assert_eq!(loaded.errors.len(), 1, "{loaded:?}");
    assert!(loaded.errors[0].starts_with("my.scheme:1:16: 'stiffness'"), "{loaded:?}");
}
