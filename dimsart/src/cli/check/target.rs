//! The board that a scheme is checked for.

use std::error::Error;
use std::path::Path;

use boards::BOARDS;
use boards::catalogue::Tooling;
use dimsart_core::limits::{MAX_LINKS, Sizes};
use dimsart_core::{Costs, Dimsart, Usage};

use crate::budget::{Budget, BudgetError};
use crate::cycles::Firmware;
use crate::stamp::StampedImage;
use hil_sim::first_packet::first_packet;

/// A board, and what a tick may take there.
pub(super) struct Target {
    pub(super) name: String,
    pub(super) board: &'static Tooling,
    /// By the stamp of its image; without a stamped one, the reason.
    pub(super) limit: Result<Limit, String>,
}

/// What a tick may take on a board, by the stamp of an image.
pub(super) struct Limit {
    pub(super) cycles: u32,
    period_cycles: u32,
    pub(super) costs: Costs,
}

impl Target {
    /// The board of that name, with this image or the one that was built last.
    pub(super) fn find(name: &str, image: Option<&Path>) -> Result<Self, Box<dyn Error>> {
        let found = BOARDS.iter().find(|board| board.name == name).map(|board| &board.tooling);
        let board = found.ok_or_else(|| BudgetError::Unknown { name: name.to_owned() })?;
        Ok(Self { name: name.to_owned(), board, limit: limit(name, image)? })
    }

    /// What a controller takes that the board has not, but for words of its Data Base.
    pub(super) fn faults(&self, dimsart: &mut Dimsart) -> Vec<String> {
        let (Self { name, board, limit }, mut faults) = (self, Vec::new());
        let (dof, axes) = (dimsart.engine().device().dof(), board.axes);
        // A simulated device has as many as it is told to have.
        if board.motor.is_some() && dof > axes {
            faults.push(format!("it is for {dof} axes, and {name} has {axes}"));
        }
        let mut uses =
            |link: &usize| dimsart.listening_channel(*link) > 0 || first_packet(dimsart, *link).is_some();
        let Sizes { modules, wires, bindings, slots, links, .. } = board.sizes;
        let missing = (links..MAX_LINKS).filter(|link| uses(link));
        faults.extend(missing.map(|link| format!("it uses link {link}, and {name} has {links}, from 0")));
        let Usage { modules: taken_modules, slots: taken_slots, .. } = dimsart.engine().usage();
        let [taken_wires, taken_bindings] = dimsart.engine().wires_and_bindings();
        let too_many = [
            (taken_modules, modules, "modules"),
            (taken_slots, slots, "slots of the Data Base"),
            (taken_wires, wires, "ports that are plugged in"),
            (taken_bindings, bindings, "ports that commands have bound"),
        ];
        for (taken, most, what) in too_many.into_iter().filter(|(taken, most, _)| taken > most) {
            faults.push(format!("it takes {taken} {what}, and {name} has {most}: leave a module out"));
        }
        if let (Ok(limit), Some(cycles)) = (limit, dimsart.engine().tick_cycles())
            && cycles > limit.cycles
        {
            let most = limit.cycles;
            faults.push(format!(
                "a tick takes up to {cycles} cycles, and on {name} it may take {most}: leave a module out"
            ));
        }
        faults
    }

    /// How long a tick can be, or why that is not known.
    pub(super) fn time(&self, dimsart: &Dimsart) -> Option<String> {
        match &self.limit {
            Ok(limit) => dimsart.engine().tick_cycles().map(|cycles| limit.time_text(cycles)),
            Err(reason) => Some(format!("how long a tick takes is not known: {reason}")),
        }
    }
}

fn limit(board: &str, image: Option<&Path>) -> Result<Result<Limit, String>, Box<dyn Error>> {
    let period_cycles = Budget::of(board)?.period_cycles();
    let firmware = match Firmware::find(image, Some(board)) {
        Ok(firmware) => firmware,
        Err(error) if image.is_some() => return Err(error.into()),
        Err(error) => return Ok(Err(error.to_string())),
    };
    let image = StampedImage::read(&firmware.path)?;
    let Some(costs) = image.costs() else {
        let path = firmware.path.display();
        return Ok(Err(format!("{path} is not stamped; `dimsart stamp {path}` does that")));
    };
    // They live as long as the program, as on a board.
    let costs = Costs::new(costs.leak(), image.kinds().leak());
    Ok(Ok(Limit { cycles: image.limit_cycles(), period_cycles, costs }))
}

impl Limit {
    /// How long a tick can be, and how much of what it may take and of all its time that is.
    fn time_text(&self, cycles: u32) -> String {
        let share = |whole: u32| 100.0 * f64::from(cycles) / f64::from(whole);
        format!(
            "a tick takes up to {cycles} of {} cycles ({:.1} %), {:.1} % of the time to the next one",
            self.cycles,
            share(self.cycles),
            share(self.period_cycles)
        )
    }
}
