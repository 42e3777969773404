//! Rig files with drives that do not go together: everything is named.

use std::path::PathBuf;

use hil_sim::rig_file::RigFile;

use super::{step, text};

fn wrong(text: &str) -> String {
    RigFile::read(text, "my.toml", PathBuf::new(), &[]).unwrap_err().to_string()
}

#[test]
fn what_is_wrong_with_drives_is_named() {
    let file = text("", &step(0, 0.1));
    for (was, is, said) in [
        ("ids = [1, 2]", "ids = [1]", "`ids` has 1 entries"),
        ("ids = [1, 2]", "ids = [1, 1]", "duplicate drive id 1:"),
        ("ids = [1, 2]", "ids = [0, 2]", "id 0 is invalid with host id 0"),
        ("ids = [1, 2]", "ids = [1, 127]", "id 127 is invalid with host id 0"),
        ("ids = [1, 2]", "ids = [1, 2]\ntimeout_s = 0.0", "timeout_s is 0"),
        ("ids = [1, 2]", "ids = [1, 2]\nreply_delay_s = 0.1", "reply_delay_s is 0.1"),
        ("ids = [1, 2]", "ids = [1, 2]\nbit_error_rate = 2.0", "bit_error_rate is 2"),
        ("ids = [1, 2]", "ids = [1, 2]\nabsent = [{ axis = 2, from_s = 0.0, until_s = 1.0 }]", "axis 2"),
        ("name = \"robot\"", "name = \"robot\"\ndelay_ticks = 1.0", "delay_ticks is not allowed with drives"),
        ("[[device.axis]]", "[[device.axis]]\nunit = \"m\"", "drives are rotary"),
        ("\"VELOCITY\"", "\"FORCE\"", "which its drives do not report"),
        ("ids = [1, 2]", "ids = [1, 2]\nturns = 3", "turns"),
    ] {
        let found = wrong(&file.replacen(was, is, 1));
        assert!(found.contains(said), "{is}: {found}");
    }
    let without = wrong(&file.replacen("[device.moteus]\n        ids = [1, 2]", "", 1));
    assert!(without.contains("but has no drives: add [device.moteus] or"), "{without}");
}
