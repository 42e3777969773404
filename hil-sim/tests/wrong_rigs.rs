//! Of a rig file or a `--set` that is wrong, everything is said at once, with its place.

use std::path::PathBuf;

use hil_sim::rig_file::RigFile;

#[test]
fn every_wrong_key_is_named_at_once_with_what_does_not_go_together() {
    let text = r#"
        duration_s = "long"
        sample_period_s = 5
        [[device]]
        measures = ["POSITION", "DES_POSITON"]
        [[device.axis]]
        unit = "feet"
        plant.load.inertia = -0.02
        plant.load.inerta = 0.02
        plant.motor = { kind = "brused", resistance_ohm = 1 }
        plant.friction = { viscos = 1 }
        [[controller]]
        device = "arm"
        scheme = "builtin:joint"
        every_ticks = -1
        axes = 3
        [experiment]
        margins = "yes"
    "#;
    let error = RigFile::read(text, "my.toml", PathBuf::new(), &[]).unwrap_err();
    assert!(!error.is_usage_error());
    let expected = [
        "cannot run my.toml:",
        "line 2, column 22: `duration_s` is string \"long\", must be a number",
        "line 4, column 9: `device.0.name` is missing",
        "line 7, column 16: `device.0.axis.0.unit` is `feet`, must be `rad` or `m`",
        "line 9, column 20: unknown key `device.0.axis.0.plant.load.inerta`; did you mean 'inertia'?",
        "line 10, column 32: `device.0.axis.0.plant.motor.kind` is `brused`, must be one of `ideal`, `brushed`, \
         `three_phase`",
        "line 11, column 28: unknown key `device.0.axis.0.plant.friction.viscos`; did you mean 'viscous'?",
        "line 15, column 23: `controller.0.every_ticks` is integer `-1`, must be an integer >= 0",
        "line 16, column 16: `controller.0.axes` is integer `3`, must be a list",
        "line 18, column 19: `experiment.margins` is string \"yes\", must be true or false",
        "sample_period_s is 5 s, must be 0.00001 s to 0.1 s",
    ];
    assert_eq!(error.to_string().split("\n  ").collect::<Vec<_>>(), expected);
}

#[test]
fn every_wrong_set_is_named_and_keys_that_go_together_are_set_together() {
    let text = RigFile::shipped("joint").unwrap();
    let read = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        RigFile::read(text, "joint", PathBuf::new(), &sets)
    };
    let hand = ["inertia", "damping", "stiffness"].map(|key| format!("device.joint.axis.0.hand.{key}=1"));
    let hand = hand.each_ref().map(String::as_str);
    assert!(read(&hand).is_ok());
    for (sets, expected) in [
        (
            &["duration_s=long", "sed=3"][..],
            "--set duration_s=long: `duration_s` is string \"long\", must be a number\n--set sed=3: unknown key \
            `sed`; did you mean 'seed'?",
        ),
        (
            &hand[..1],
            "--set device.joint.axis.0.hand.inertia=1: missing key `damping` in `device.joint.axis.0.hand.inertia`",
        ),
        (
            &["seed=2", "duration_s=-1"],
            "cannot run joint with --set seed=2 with --set duration_s=-1:\n  duration_s is -1 s, must be > 0 s",
        ),
    ] {
        let error = read(sets).unwrap_err();
        assert_eq!(error.to_string(), expected);
        assert!(error.is_usage_error());
    }
}
