#![expect(clippy::float_cmp, reason = "settings are copied, not computed")]

use super::range::Range;
use super::{Key, Scenario, ScenarioError, Stale, WaveForm, apply, reference};
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, proptest};
use std::path::PathBuf;
use toml::Value;

fn with(sets: &[&str]) -> Result<Scenario, ScenarioError> {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    Scenario::load(None, &sets)
}

fn refused(argument: &str) -> String {
    with(&[argument]).expect_err(argument).to_string()
}

/// A scenario file that is gone when the test ends.
struct File(PathBuf);

impl File {
    fn new(name: &str, text: &str) -> Self {
        let path = std::env::temp_dir().join(format!("dimsart-{}-{name}.toml", std::process::id()));
        std::fs::write(&path, text).unwrap();
        Self(path)
    }

    fn load(&self, sets: &[&str]) -> Result<Scenario, ScenarioError> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        Scenario::load(Some(&self.0), &sets)
    }

    fn refused(&self) -> String {
        self.load(&[]).unwrap_err().to_string().replace(&self.0.display().to_string(), "cell.toml")
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn the_shipped_scenario_says_nothing_that_a_scheme_can_say_for_itself() {
    let scenario = Scenario::default();
    assert_eq!(scenario, with(&[]).unwrap());
    assert_eq!(
        (scenario.wave.impedance_ns_per_m, scenario.wave.form, scenario.link.stale),
        (None, None, None)
    );
    assert_eq!((scenario.link.timeout_ticks, scenario.link.every_ticks), (None, None));
    for side in [&scenario.master, &scenario.slave] {
        let gains = (side.stiffness_n_per_m, side.damping_ns_per_m, side.time_delay_ticks);
        assert_eq!(gains, (None, None, None));
    }
    assert_eq!((scenario.duration_s, &scenario.master.motor), (None, &None));
}

#[test]
fn every_promised_key_can_be_set() {
    let scenario = with(&[
        "seed=7",
        "duration_s=2.5",
        "link.forward_delay_ticks=3",
        "link.backward_delay_ticks=4",
        "link.loss=0.1",
        "wave.impedance_ns_per_m=12",
        "wave.form=implicit",
        "master.stiffness_n_per_m=1000",
        "slave.stiffness_n_per_m=2000.0",
        "wall.stiffness_n_per_m=inf",
    ])
    .unwrap();
    assert_eq!((scenario.seed, scenario.duration_s), (7, Some(2.5)));
    assert_eq!((scenario.link.forward_delay_ticks, scenario.link.backward_delay_ticks), (3, 4));
    assert_eq!((scenario.link.loss, scenario.wave.impedance_ns_per_m), (0.1, Some(12.0)));
    assert_eq!(scenario.wave.form, Some(WaveForm::Implicit));
    assert_eq!(
        (scenario.master.stiffness_n_per_m, scenario.slave.stiffness_n_per_m),
        (Some(1000.0), Some(2000.0))
    );
    assert_eq!(scenario.environments.wall.stiffness_n_per_m, f64::INFINITY);
}

#[test]
fn every_key_takes_its_own_default_and_says_what_it_means() {
    let complete = reference::complete();
    let keys = Scenario::keys();
    for key in &keys {
        assert!(!key.meaning.is_empty(), "{} has no comment", key.path);
        let path: Vec<String> = key.path.split('.').map(str::to_owned).collect();
        let example = reference::find(&complete, &path).unwrap();
        with(&[&format!("{}={example}", key.path)]).unwrap();
    }
    let left_out: Vec<&str> =
        keys.iter().filter(|key| key.default.is_none()).map(|key| key.path.as_str()).collect();
    assert!(
        left_out.contains(&"duration_s") && left_out.contains(&"slave.motor.voltage_limit_v"),
        "{left_out:?}"
    );
    assert!(keys.iter().any(|key| key.path == "link.loss" && key.default.as_deref() == Some("0.0")));
}

#[test]
fn the_shipped_file_shows_every_key_of_the_struct() {
    let complete: Scenario = toml::from_str(&reference::complete_text()).unwrap();
    let text = complete.to_toml();
    let document = toml::de::DeTable::parse(&text).unwrap();
    let mut paths: Vec<String> =
        reference::leaves(document.get_ref()).into_iter().map(|leaf| leaf.path.join(".")).collect();
    let mut keys: Vec<String> = Scenario::keys().into_iter().map(|key| key.path).collect();
    paths.sort();
    keys.sort();
    assert_eq!(paths, keys);
}

#[test]
fn every_number_has_a_range_without_nan() {
    let complete = reference::complete();
    let is_number = |value: &Value| matches!(value, Value::Float(_) | Value::Integer(_));
    let mut numbers = 0;
    for Key { path: key, .. } in Scenario::keys() {
        let path: Vec<String> = key.split('.').map(str::to_owned).collect();
        let example = reference::find(&complete, &path).unwrap();
        let is_list = example.as_array().is_some_and(|entries| entries.iter().any(is_number));
        if !is_number(example) && !is_list {
            continue;
        }
        numbers += 1;
        let range = Range::of(&key).unwrap_or_else(|| panic!("{key} has no line in range.rs"));
        assert!(!range.holds(f64::NAN), "{key}");
        let nan = if is_list { "[nan]" } else { "nan" };
        let message = refused(&format!("{key}={nan}"));
        assert!(message.contains(&format!("`{key}` cannot be {nan}; give it ")), "{message}");
    }
    assert!(numbers > 40, "{numbers} numbers");
}

#[test]
fn words_lists_paths_and_left_out_sections_can_be_set() {
    let scenario = with(&[
        "link.slave_address=127.0.0.1:5000",
        "link.stale = integral",
        "link.timeout_ticks=0",
        "link.every_ticks=2",
        "hand.contact_force_n=[1, 0.5]",
        "master.scheme=schemes/mine.scheme",
        "slave.scheme='2004'",
        "slave.motor.voltage_limit_v=12",
        "record={every_ticks=10, signals=['world']}",
    ])
    .unwrap();
    assert_eq!(scenario.link.stale, Some(Stale::Integral));
    assert_eq!((scenario.link.timeout_ticks, scenario.link.every_ticks), (Some(0), Some(2)));
    assert_eq!(scenario.link.slave_address.to_string(), "127.0.0.1:5000");
    assert_eq!([0, 1, 2].map(|axis| scenario.contact_force_n(axis)), [1.0, 0.5, 0.0]);
    assert_eq!(
        (scenario.master.scheme.as_str(), scenario.slave.scheme.as_str()),
        ("schemes/mine.scheme", "2004")
    );
    let motor = scenario.slave.motor.unwrap();
    assert_eq!((motor.voltage_limit_v, motor.resistance_ohm), (12.0, 2.32));
    assert_eq!(scenario.master.motor, None);
    assert_eq!((scenario.record.every_ticks, scenario.record.signals), (10, vec!["world".to_owned()]));
    assert!(with(&["master.motor={}"]).unwrap().master.motor.is_some());
}

#[test]
fn an_unknown_key_names_the_nearest_one() {
    for (wrong, right) in [
        ("link.los", "link.loss"),
        ("loss", "link.loss"),
        ("duration", "duration_s"),
        ("wave.impedance", "wave.impedance_ns_per_m"),
        ("mastr.stiffness_n_per_m", "master.stiffness_n_per_m"),
        ("link.forward_delay", "link.forward_delay_ticks"),
        ("link.loss.share", "link.loss"),
    ] {
        let message = refused(&format!("{wrong}=1"));
        assert_eq!(message, format!("--set {wrong}=1: there is no key `{wrong}`; did you mean `{right}`?"));
    }
    let message = refused("nonesuch.a=1");
    assert_eq!(message, "--set nonesuch.a=1: there is no key `nonesuch.a`; `dimsart run --keys` prints all");
}

#[test]
fn a_wrong_value_names_key_value_and_what_is_allowed() {
    for (argument, problem) in [
        ("link.loss=2", "`link.loss` cannot be 2; give it a number from 0 to 1"),
        ("link.loss=lots", "`link.loss` cannot be \"lots\"; give it a number from 0 to 1"),
        ("master.device.mass_kg=-1", "`master.device.mass_kg` cannot be -1; give it a finite number > 0"),
        ("slave.device.mass_kg=0", "`slave.device.mass_kg` cannot be 0; give it a finite number > 0"),
        ("hand.mass_kg=nan", "`hand.mass_kg` cannot be nan; give it a finite number >= 0"),
        ("hand.mass_kg=inf", "`hand.mass_kg` cannot be inf; give it a finite number >= 0"),
        ("wall.stiffness_n_per_m=0", "`wall.stiffness_n_per_m` cannot be 0; give it a number > 0, or inf"),
        ("dof=0", "`dof` cannot be 0; give it a number from 1 to 8"),
        ("dof=9", "`dof` cannot be 9; give it a number from 1 to 8"),
        ("dof=1.5", "`dof` cannot be 1.5; give it a whole number from 1 to 8"),
        (
            "record.signals=world",
            "`record.signals` cannot be \"world\"; give it a list of names, such as [\"world\"]",
        ),
        ("record.signals=[1]", "`record.signals` cannot be [1]; give it a string"),
        ("wave.form=splt", "`wave.form` cannot be \"splt\"; give it one of `split`, `implicit`, `printed`"),
        (
            "link=3",
            "`link` cannot be 3; give it no value: it is a section with the keys backward_delay_ticks, ",
        ),
        ("link.jitter_ticks=-1", "`link.jitter_ticks` cannot be -1; give it a number from 0 to 100000"),
        (
            "hand.contact_force_n=1",
            "`hand.contact_force_n` cannot be 1; give it a list, each entry a finite number",
        ),
    ] {
        let message = refused(argument);
        assert!(message.starts_with(&format!("--set {argument}: {problem}")), "{message}");
    }
}

#[test]
fn an_argument_that_sets_nothing_is_refused() {
    for argument in ["link.loss", "=1", "link.loss=", "link..loss=1", "hand.contact_force_n=[1,"] {
        assert!(refused(argument).contains("write it as key=value"), "{argument}");
    }
}

#[test]
fn a_refused_argument_leaves_the_settings_alone() {
    let mut settings = reference::shipped();
    apply(&mut settings, "link={loss=0.5, jitter_ticks=-1}").unwrap_err();
    assert_eq!(settings, reference::shipped());
}

#[test]
fn a_file_changes_what_it_names_and_an_argument_goes_over_it() {
    let file =
        File::new("over", "duration_s = 3.0\n[link]\nloss = 0.2\nforward_delay_ticks = 5\n[slave.motor]\n");
    let scenario = file.load(&["link.loss=0.3"]).unwrap();
    let mut expected = with(&["duration_s=3", "link.loss=0.3", "link.forward_delay_ticks=5"]).unwrap();
    expected.slave.motor = with(&["slave.motor={}"]).unwrap().slave.motor;
    assert!(expected.slave.motor.is_some());
    assert_eq!(scenario, expected);
}

#[test]
fn an_error_in_a_file_names_line_and_column() {
    let misspelt = File::new("misspelt", "seed = 2\n[link]\n  los = 0.2\n");
    assert_eq!(misspelt.refused(), "cell.toml:3:3: there is no key `link.los`; did you mean `link.loss`?");
    let wrong = File::new("wrong", "# comment\nslave.device = { mass_kg = -2.0 }\n");
    let message = "cell.toml:2:18: `slave.device.mass_kg` cannot be -2.0; give it a finite number > 0";
    assert_eq!(wrong.refused(), message);
    let broken = File::new("broken", "seed = 2\nlink = [\n");
    assert!(broken.refused().starts_with("cell.toml: not a TOML file: TOML parse error at line "));
    let missing = Scenario::load(Some(&PathBuf::from("no/such/file.toml")), &[]).unwrap_err().to_string();
    assert!(missing.starts_with("no/such/file.toml: cannot read the scenario"), "{missing}");
}

#[test]
fn the_effective_settings_are_a_scenario_file() {
    for sets in
        [vec![], vec!["wall.stiffness_n_per_m=inf", "master.motor={}", "duration_s=4", "link.stale=limited"]]
    {
        let scenario = with(&sets).unwrap();
        let file = File::new(&format!("again{}", sets.len()), &scenario.to_toml());
        let mut again = file.load(&[]).unwrap();
        // A path in a file begins in its folder.
        assert!(std::path::Path::new(&again.udp.delays_file).is_absolute());
        again.udp.delays_file.clone_from(&scenario.udp.delays_file);
        assert_eq!(again, scenario);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// Whatever is accepted is physical and survives its own text; whatever is not is refused by name.
    #[test]
    fn what_is_accepted_is_physical(index in 0_usize..200, value in any::<f64>()) {
        let keys = Scenario::keys();
        let key = &keys[index % keys.len()].path;
        match with(&[&format!("{key}={value:?}")]) {
            Ok(scenario) => {
                let (master, slave) = (&scenario.master.device, &scenario.slave.device);
                prop_assert!(master.mass_kg > 0.0 && slave.mass_kg > 0.0 && scenario.hand.mass_kg >= 0.0);
                prop_assert!(scenario.wave.impedance_ns_per_m.is_none_or(|b| b > 0.0));
                prop_assert!(scenario.environments.wall.stiffness_n_per_m > 0.0);
                prop_assert!((0.0..=1.0).contains(&scenario.link.loss));
                prop_assert!(scenario.duration_s.is_none_or(|s| s > 0.0 && s.is_finite()));
                prop_assert_eq!(toml::from_str::<Scenario>(&scenario.to_toml()).unwrap(), scenario);
            }
            Err(error) => prop_assert!(error.to_string().contains(&format!("`{key}` cannot be")), "{error}"),
        }
    }
}

#[test]
fn everything_that_is_wrong_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    std::fs::write(&path, "durration_s = 2\n[link]\nloss = 1.5\njitter_ticks = 2\n[hand]\nmas_kg = 1\n")
        .unwrap();
    let message = Scenario::load(Some(&path), &["link.los=0.1".to_owned()]).unwrap_err().to_string();
    for expected in [
        "my.toml:1:1",
        "durration_s",
        "my.toml:3:1",
        "link.loss",
        "my.toml:6:1",
        "mas_kg",
        "--set link.los=0.1",
    ] {
        assert!(message.contains(expected), "{expected} is not in\n{message}");
    }
    assert_eq!(message.lines().count(), 4, "{message}");
}

#[test]
fn a_force_for_an_axis_that_is_not_there_is_refused() {
    let set = |arguments: &[&str]| {
        let sets: Vec<String> = arguments.iter().map(|argument| (*argument).to_owned()).collect();
        Scenario::load(None, &sets).map(|_| ()).map_err(|error| error.to_string())
    };
    assert!(
        set(&["hand.contact_force_n=[1, 2, 3, 4, 5]"]).unwrap_err().contains("5 values and there are 3 axes")
    );
    assert_eq!(set(&["dof=1"]), Ok(()), "the shipped forces of further axes are nobody's fault");
    assert_eq!(set(&["dof=5", "hand.contact_force_n=[1, 2, 3, 4, 5]"]), Ok(()));
}
