//! Settings over a rig: of the command line, and of files that name what differs.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::path::{Path, PathBuf};

use hil_sim::plant::JointMotorParameters;
use hil_sim::rig_file::{RigFile, RigFileError, SHIPPED};
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, proptest};

fn with(sets: &[&str]) -> Result<RigFile, RigFileError> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    RigFile::from_shipped("bilateral", &sets)
}

fn refused(argument: &str) -> String {
    with(&[argument]).unwrap_err().to_string()
}

/// A file of settings that is gone when the test ends.
struct File(tempfile::TempDir);

impl File {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("cell.toml"), text).unwrap();
        Self(folder)
    }

    fn load(&self, sets: &[&str]) -> Result<RigFile, RigFileError> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        RigFile::load(&self.0.path().join("cell.toml"), &sets)
    }

    fn refused(&self) -> String {
        let folder = format!("{}/", self.0.path().display());
        self.load(&[]).unwrap_err().to_string().replace(&folder, "")
    }
}

#[test]
fn the_shipped_experiment_says_nothing_that_a_scheme_can_say_for_itself() {
    let file = with(&[]).unwrap();
    assert!(file.controllers.iter().all(|controller| controller.settings().is_empty()));
    assert!(file.duration_s.is_infinite());
    let has_motor =
        file.devices.iter().flat_map(|device| &device.axes).any(|axis| {
            axis.plant.as_ref().is_some_and(|plant| plant.motor != JointMotorParameters::default())
        });
    assert!(!has_motor);
}

#[test]
fn a_parameter_sets_all_of_its_keys() {
    let file = with(&[
        "seed=7",
        "duration_s=2.5",
        "dof=2",
        "link.forward_delay_ticks=3",
        "link.backward_delay_ticks=4",
        "link.loss=0.1",
        "link.stale=integral",
        "wave.impedance_n_s_per_m=12",
        "wave.form=implicit",
        "master.stiffness_n_per_m=1000",
        "wall.stiffness_n_per_m=inf",
        "hand.contact_force_n=[1, 0.5]",
        "slave.motor.voltage_limit_v=12",
        "record={every_ticks=10, signals=['world']}",
    ])
    .unwrap();
    assert_eq!((file.seed, file.duration_s.to_bits()), (7, 2.5_f64.to_bits()));
    assert!(file.devices.iter().all(|device| device.axes.len() == 2));
    let delays: Vec<u32> = file.links.iter().map(|link| link.carrier.delay_ticks).collect();
    assert_eq!(delays, [3, 4]);
    assert!(file.links.iter().all(|link| (link.carrier.loss - 0.1).abs() < 1e-12));
    for controller in &file.controllers {
        let settings = controller.settings();
        let set = |command: &str| {
            let found = settings.iter().find(|setting| setting.command == command);
            found.map(|setting| setting.value.clone())
        };
        assert_eq!(set("STALE").as_deref(), Some("INTEGRAL"));
        assert_eq!(set("B_PARAM").as_deref(), Some("12"));
        assert_eq!((set("FORM").as_deref(), set("LAW_OUTPUT").as_deref()), (Some("IMPLICIT"), Some("ON")));
        assert_eq!(set("K_PARAM").is_some(), controller.name() == "master");
    }
    let press = file.experiment.press.as_ref().unwrap();
    assert_eq!(press.force, [1.0, 0.5]);
    let [master, slave] = [0, 1].map(|device: usize| file.devices[device].axes[0].clone());
    assert!(slave.wall.unwrap().stiffness.is_infinite());
    assert_eq!(master.plant.unwrap().motor, JointMotorParameters::default());
    let JointMotorParameters::Brushed(motor) = slave.plant.unwrap().motor else { panic!("no motor") };
    assert_eq!(
        (motor.voltage_limit_v.to_bits(), motor.resistance_ohm.to_bits()),
        (12.0_f64.to_bits(), 2.32_f64.to_bits())
    );
    assert_eq!((file.record.every_ticks, file.record.signals), (10, vec!["world".to_owned()]));
    let with_motor = with(&["master.motor={}"]).unwrap();
    assert!(matches!(
        with_motor.devices[0].axes[2].plant.as_ref().unwrap().motor,
        JointMotorParameters::Brushed(_)
    ));
}

#[test]
fn every_parameter_of_a_shipped_rig_has_a_meaning_and_takes_what_stands_there() {
    for (name, text) in SHIPPED {
        let file = RigFile::from_shipped(name, &[]).unwrap();
        // As of a file of somebody's own, whose parameters are checked.
        RigFile::read(&format!("{text}\n"), name, PathBuf::new(), &[]).unwrap();
        for parameter in &file.parameters {
            assert!(!parameter.meaning.is_empty(), "{name}: {}", parameter.name);
            let (default, _) = RigFile::shipped_setting(name, &parameter.name).unwrap();
            if let Some(default) = default {
                RigFile::from_shipped(name, &[format!("{}={default}", parameter.name)]).unwrap();
            }
        }
    }
    let (default, meaning) = RigFile::shipped_setting("bilateral", "link.loss").unwrap();
    assert_eq!((default.as_deref(), meaning.as_str()), (Some("0.0"), "share of lost packets"));
    assert_eq!(RigFile::shipped_setting("bilateral", "wave.impedance_n_s_per_m").unwrap().0, None);
}

#[test]
fn an_unknown_key_names_the_nearest_one() {
    for (wrong, right) in [
        ("link.los", "link.loss"),
        ("loss", "link.loss"),
        ("wave.impedance", "wave.impedance_n_s_per_m"),
        ("mastr.stiffness_n_per_m", "master.stiffness_n_per_m"),
        ("link.forward_delay", "link.forward_delay_ticks"),
    ] {
        let message = refused(&format!("{wrong}=1"));
        assert_eq!(message, format!("--set {wrong}=1: unknown key `{wrong}`; did you mean `{right}`?"));
    }
    assert!(refused("duration=1").contains("did you mean"), "{}", refused("duration=1"));
    assert!(refused("nonesuch.a=1").contains("nonesuch"));
}

#[test]
fn a_wrong_value_names_key_value_and_what_is_allowed() {
    for (argument, problem) in [
        ("link.loss=2", "`link.loss` is 2, must be a number from 0 to 1"),
        ("link.loss=lots", "`link.loss` is lots, must be a number from 0 to 1"),
        ("link.loss=nan", "`link.loss` is nan, must be a number from 0 to 1"),
        ("master.device.mass_kg=-1", "`master.device.mass_kg` is -1, must be a finite number > 0"),
        ("slave.device.mass_kg=0", "`slave.device.mass_kg` is 0, must be a finite number > 0"),
        ("hand.mass_kg=nan", "`hand.mass_kg` is nan, must be a finite number >= 0"),
        ("hand.mass_kg=inf", "`hand.mass_kg` is inf, must be a finite number >= 0"),
        ("wall.stiffness_n_per_m=0", "`wall.stiffness_n_per_m` is 0, must be a number > 0, or inf"),
        ("dof=0", "`dof` is 0, must be a number from 1 to 8"),
        ("dof=9", "`dof` is 9, must be a number from 1 to 8"),
        ("wave.form=splt", "`wave.form` is splt, must be one of implicit, printed, split"),
        ("link=3", "`link` is a section, not a value; set one of its keys: carrier, forward_delay_ticks, "),
        ("link.jitter_ticks=-1", "`link.jitter_ticks` is -1, must be a number from 0 to 100000"),
    ] {
        let message = refused(argument);
        assert!(message.starts_with(&format!("--set {argument}: {problem}")), "{message}");
    }
    for argument in ["dof=1.5", "record.signals=world", "record.signals=[1]", "hand.contact_force_n=1"] {
        let key = argument.split('=').next().unwrap();
        assert!(refused(argument).contains(&format!("`{key}")), "{}", refused(argument));
    }
}

#[test]
fn an_argument_that_sets_nothing_is_refused() {
    for argument in ["link.loss", "=1", "link.loss=", "link..loss=1", "hand.contact_force_n=[1,"] {
        assert!(refused(argument).contains("write key=value"), "{argument}");
    }
}

#[test]
fn a_file_changes_what_it_names_and_an_argument_goes_over_it() {
    let file = File::new("duration_s = 3.0\n[link]\nloss = 0.2\nforward_delay_ticks = 5\n[slave.motor]\n");
    let loaded = file.load(&["link.loss=0.3"]).unwrap();
    let expected =
        with(&["duration_s=3.0", "link.loss=0.3", "link.forward_delay_ticks=5", "slave.motor={}"]).unwrap();
    assert_eq!(loaded, expected);
    let other = File::new("rig = 'telerobot'\n[link]\ndelay_ticks = 7\n").load(&[]).unwrap();
    assert!(other.links.iter().all(|link| link.carrier.delay_ticks == 7));
}

#[test]
fn an_error_in_a_file_names_line_and_column() {
    let misspelt = File::new("seed = 2\n[link]\n  los = 0.2\n");
    assert_eq!(misspelt.refused(), "cell.toml:3:3: unknown key `link.los`; did you mean `link.loss`?");
    let wrong = File::new("# comment\nslave.device = { mass_kg = -2.0 }\n");
    let message = "cell.toml:2:18: `slave.device.mass_kg` is -2.0, must be a finite number > 0";
    assert_eq!(wrong.refused(), message);
    let broken = File::new("seed = 2\nlink = [\n");
    assert!(
        broken.refused().contains("not a valid TOML file: TOML parse error at line "),
        "{}",
        broken.refused()
    );
    let missing = RigFile::load(Path::new("no/such/file.toml"), &[]).unwrap_err().to_string();
    assert!(missing.starts_with("cannot read the rig file no/such/file.toml"), "{missing}");
    let unknown = File::new("rig = 'nosuch'\nseed = 2\n").refused();
    assert!(unknown.contains("nosuch"), "{unknown}");
}

#[test]
fn the_effective_settings_are_a_rig_file() {
    for sets in
        [vec![], vec!["wall.stiffness_n_per_m=inf", "master.motor={}", "duration_s=4", "link.stale=limited"]]
    {
        let file = with(&sets).unwrap();
        let again = RigFile::read(&file.to_toml(), "again", PathBuf::new(), &[]).unwrap();
        assert_eq!(again, file);
    }
}

#[test]
fn everything_that_is_wrong_is_told_at_once() {
    let file = File::new("durration_s = 2\n[link]\nloss = 1.5\njitter_ticks = 2\n[hand]\nmas_kg = 1\n");
    let message = file.load(&["link.los=0.1"]).unwrap_err().to_string();
    for expected in [
        "cell.toml:1:1",
        "durration_s",
        "cell.toml:3:1",
        "link.loss",
        "cell.toml:6:1",
        "mas_kg",
        "--set link.los=0.1",
    ] {
        assert!(message.contains(expected), "{expected} is not in\n{message}");
    }
    assert_eq!(message.lines().count(), 4, "{message}");
}

#[test]
fn a_force_for_an_axis_that_is_not_there_is_refused() {
    let set = |arguments: &[&str]| with(arguments).map(|_| ()).map_err(|error| error.to_string());
    assert!(set(&["hand.contact_force_n=[1, 2, 3, 4, 5]"]).unwrap_err().contains("5 values for 3 axes"));
    assert_eq!(set(&["dof=1"]), Ok(()), "the shipped forces of further axes are nobody's fault");
    assert_eq!(set(&["dof=5", "hand.contact_force_n=[1, 2, 3, 4, 5]"]), Ok(()));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// What is accepted is physical and survives its own text; what is not is refused by name.
    #[test]
    fn what_is_accepted_is_physical(index in 0_usize..200, value in any::<f64>()) {
        let usual = with(&[]).unwrap();
        let key = &usual.parameters[index % usual.parameters.len()].name;
        match with(&[&format!("{key}={value:?}")]) {
            Ok(file) => {
                for axis in file.devices.iter().flat_map(|device| &device.axes) {
                    prop_assert!(axis.joint().unwrap().load.inertia > 0.0);
                    prop_assert!(axis.wall.as_ref().is_none_or(|wall| wall.stiffness > 0.0));
                }
                prop_assert!(file.links.iter().all(|link| (0.0..=1.0).contains(&link.carrier.loss)));
                prop_assert!(file.duration_s > 0.0);
                prop_assert_eq!(RigFile::read(&file.to_toml(), "again", PathBuf::new(), &[]).unwrap(), file);
            }
            Err(error) => prop_assert!(error.to_string().contains(&**key) || error.to_string().contains("cannot \
            run"), "{error}"),
        }
    }
}
