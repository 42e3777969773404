//! Valid and invalid arm parameters.

use super::*;

const FILE: &str = r#"
    tip_m = [0.0, 0.0, 0.1]

    [[link]]
    kind = "revolute"
    d_m = 0.3
    mass_kg = 4.0
    centre_of_mass_m = [0.0, 0.0, 0.1]
    inertia_kg_m2 = [0.02, 0.02, 0.01, 0.0, 0.0, 0.0]
    motor_inertia = 0.2
    viscous = 0.5
    effort_limit = 100.0

    [[link]]
    kind = "prismatic"
    alpha_rad = 1.5708
    mass_kg = 1.0
    stops = { min = 0.0, max = 0.4 }
"#;

#[test]
fn an_arm_is_read_from_a_file_and_written_back() {
    let parameters: ArmParameters = toml::from_str(FILE).unwrap();
    let arm = parameters.build().unwrap();
    assert_eq!(arm.axes(), 2);
    let again: ArmParameters = toml::from_str(&toml::to_string(&parameters).unwrap()).unwrap();
    assert_eq!(again, parameters);
    assert!(toml::from_str::<ArmParameters>(&FILE.replace("d_m", "d_mm")).is_err());
}

#[test]
fn what_cannot_be_is_refused_by_its_path() {
    let refused = |change: &dyn Fn(&mut ArmParameters), path: &str| {
        let mut parameters: ArmParameters = toml::from_str(FILE).unwrap();
        change(&mut parameters);
        assert_eq!(parameters.check().unwrap_err().path, path);
    };
    refused(&|arm| arm.link.clear(), "link");
    refused(&|arm| arm.link = vec![arm.link[0].clone(); 9], "link");
    refused(&|arm| arm.gravity_m_per_s2[1] = f64::NAN, "gravity_m_per_s2[1]");
    refused(&|arm| arm.link[1].mass_kg = -1.0, "link[1].mass_kg");
    refused(&|arm| arm.link[0].centre_of_mass_m[2] = f64::INFINITY, "link[0].centre_of_mass_m[2]");
    // As no body of masses has them.
    refused(&|arm| arm.link[0].inertia_kg_m2[0] = 0.05, "link[0].inertia_kg_m2[0]");
    refused(&|arm| arm.link[0].inertia_kg_m2[3] = 0.02, "link[0].inertia_kg_m2[3]");
    refused(&|arm| arm.link[1].mass_kg = 0.0, "link[1].motor_inertia");
    refused(&|arm| arm.link[0].viscous = 1e9, "link[0].viscous");
    refused(
        &|arm| {
            arm.link[1].stops = Some(StopsParameters {
                max: -1.0,
                ..StopsParameters { min: 0.0, ..StopsParameters::default() }
            })
        },
        "link[1].stops.max",
    );
    refused(
        &|arm| arm.link[1].stops = Some(StopsParameters { stiffness: 1e13, ..StopsParameters::default() }),
        "link[1].stops.stiffness",
    );
}
