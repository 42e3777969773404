//! The board for which a scheme is checked.

use std::error::Error;
use std::path::Path;

use boards::BOARDS;
use boards::catalogue::ToolData;
use dimsart_core::limits::{Capacities, MAX_LINKS};
use dimsart_core::{Costs, Dimsart, Usage};

use crate::budget::{Budget, BudgetError};
use crate::cycles::Firmware;
use crate::stamp::StampedImage;
use hil_sim::first_packet::first_packet;

/// A board and its limit of a tick.
pub(super) struct Target {
    pub(super) name: String,
    pub(super) board: &'static ToolData,
    /// From the stamp of its image, or why it is unknown.
    pub(super) limit: Result<Limit, String>,
}

/// Limit of a tick on a board, from the stamp of an image.
pub(super) struct Limit {
    pub(super) cycles: u32,
    period_cycles: u32,
    pub(super) costs: Costs,
}

impl Target {
    /// Finds a board by name, with this image or the image built last.
    pub(super) fn find(name: &str, image: Option<&Path>) -> Result<Self, Box<dyn Error>> {
        let found = BOARDS.iter().find(|board| board.name == name).map(|board| &board.tooling);
        let board = found.ok_or_else(|| BudgetError::UnknownBoard { name: name.to_owned() })?;
        Ok(Self { name: name.to_owned(), board, limit: limit(name, image)? })
    }

    /// Lists resources that the board lacks, except words of the Data Base.
    pub(super) fn faults(&self, dimsart: &mut Dimsart) -> Vec<String> {
        let (Self { name, board, limit }, mut faults) = (self, Vec::new());
        let (dof, axes) = (dimsart.engine().device().dof(), board.axes);
        // A simulated device can have any number of axes.
        if board.motor.is_some() && dof > axes {
            faults.push(format!("the scheme needs {dof} axes, {name} has {axes}: reduce the number of axes"));
        }
        let mut uses =
            |link: &usize| dimsart.receive_channel(*link) > 0 || first_packet(dimsart, *link).is_some();
        let Capacities { modules, wires, bindings, slots, links, .. } = board.sizes;
        let missing = (links..MAX_LINKS).filter(|link| uses(link));
        faults.extend(missing.map(|link| {
            format!(
                "the scheme uses link {link}, {name} has links 0 to {}: use an available link",
                links.saturating_sub(1)
            )
        }));
        let Usage { modules: taken_modules, slots: used_slots, .. } = dimsart.engine().usage();
        let [taken_wires, taken_bindings] = dimsart.engine().wire_and_binding_counts();
        let too_many = [
            (taken_modules, modules, "modules"),
            (used_slots, slots, "slots of the Data Base"),
            (taken_wires, wires, "ports of plugged modules"),
            (taken_bindings, bindings, "bound ports"),
        ];
        for (taken, most, what) in too_many.into_iter().filter(|(taken, most, _)| taken > most) {
            faults.push(format!("the scheme needs {taken} {what}, {name} has {most}: remove a module"));
        }
        if let (Ok(limit), Some(cycles)) = (limit, dimsart.engine().tick_cycles())
            && cycles > limit.cycles
        {
            let most = limit.cycles;
            faults.push(format!(
                "a tick takes up to {cycles} cycles, the limit on {name} is {most} cycles: remove a module"
            ));
        }
        faults
    }

    /// Describes the maximum time of a tick, or why it is unknown.
    pub(super) fn time(&self, dimsart: &Dimsart) -> Option<String> {
        match &self.limit {
            Ok(limit) => dimsart.engine().tick_cycles().map(|cycles| limit.time_text(cycles)),
            Err(reason) => Some(format!("maximum tick time unknown: {reason}")),
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
        return Ok(Err(format!("image {path} is not stamped: run `dimsart stamp {path}`")));
    };
    // Static, as on a board.
    let costs = Costs::new(costs.leak(), image.kinds().leak());
    Ok(Ok(Limit { cycles: image.limit_cycles(), period_cycles, costs }))
}

impl Limit {
    /// Describes the maximum time of a tick, and its share of the limit and of the period.
    fn time_text(&self, cycles: u32) -> String {
        let share = |whole: u32| 100.0 * f64::from(cycles) / f64::from(whole);
        format!(
            "a tick takes up to {cycles} of the allowed {} cycles ({:.1} %), and {:.1} % of the period",
            self.cycles,
            share(self.cycles),
            share(self.period_cycles)
        )
    }
}
