//! Pictures of a run, by kind of experiment.

mod press;
mod response;

use hil_sim::experiment::Run;
use hil_sim::rig_file::RigFile;

use crate::report::Figure;

/// Returns the title of a rig's report, or of one station `alone`.
#[must_use]
pub fn title(file: &RigFile, alone: Option<&str>) -> String {
    match (file.press_pair(), alone) {
        (Some(_), alone) => {
            format!("Bilateral control over a delayed link: {}", alone.unwrap_or("both sides"))
        }
        (None, Some(name)) => format!("Response of {name}"),
        (None, None) => {
            let names: Vec<&str> = file.devices.iter().map(|device| device.name.as_str()).collect();
            format!("Response of {}", names.join(", "))
        }
    }
}

/// Returns the file names of the figures, without extension.
#[must_use]
pub fn file_stems(file: &RigFile) -> Vec<String> {
    match file.press_pair() {
        Some(_) => press::FILE_STEMS.map(str::to_owned).to_vec(),
        None => response::file_stems(file),
    }
}

/// Creates the figures of the recorded signals.
#[must_use]
pub fn figures(file: &RigFile, run: &Run, alone: Option<&str>) -> Vec<Figure> {
    match &run.phases {
        Some(phases) => press::figures(&run.recording, phases, file, alone),
        None => response::figures(&run.recording, file),
    }
}
