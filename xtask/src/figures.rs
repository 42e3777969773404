//! `cargo xtask write figures`: writes memory of the firmware to `docs/firmware.md`, and timing for the book.

use cycles::stack::StackBound;

use crate::boards::{Image, Images, Size, build_all, hold};
use crate::example::example;
use crate::shell::Outcome;
use crate::table::table;
use crate::toolchain::Toolchain;
use crate::{measured, setup, stack};

const HEAD: &str = "\
# Firmware: memory and timing

`cargo xtask write figures` writes this page. The command and `cargo xtask test` fail if an image exceeds a limit. Budgets for
flash and RAM are in `boards/budgets/`; the emulated board and the variants of other boards have no budget.

- **Flash** contains code, constants and the initial values of variables.
- **RAM** contains all variables, including the data base with the modules' parameters and state, but not the stack or the code
  copied to CCM SRAM. The data base of nucleo-g474re (3072 words) holds 16 kinds of modules at 7 degrees of freedom and a recorder
  of 250 rows (`dimsart-core/tests/behaviour/capacity.rs`).
- **Stack** is the worst case: every priority at its deepest call, nested, including the registers saved by interrupts. It is
  computed from all calls in the machine code (`cargo xtask step stack` lists them). The limit is the space that the memory map
  leaves.

The book has a page with the time of ticks and commands.
";

const KINDS: &str = "
## Module kinds of an image

`cargo board nucleo-g474re,filters` builds an image with the default module groups and `filters`. With
`--no-default-features` the image contains only the named groups: `cargo board b-g431b-esc1,control,teleoperation
--no-default-features` is what `cargo xtask flash b-g431b-esc1` builds. `dimsart modules` shows the group of each kind. A
project's own kinds are always included (`firmware/src/modules.rs`).
";

const TIME: &str = "
## Time on the emulated board

One side of Table 1 runs as firmware on the emulated board, everything else on the host, for 100 000 ticks in lockstep. Each tick
includes a round trip of sensor and actuator data. Ticks per second depend on the machine and its load; the target is 10 000.
Instructions are counted from reading the sensors to commanding the actuators; they depend only on source and compiler. Under
load, the command line receives a request or noise in every tick; the line's rate is 115 200 baud.
";

const JITTER: &str = "
Timer ticks start exactly one period apart (in instructions), with and without requests: jitter is 0, because tasks below the tick
do not mask its interrupt (`dimsart/tests/emulated/timer_tick.rs`). On an STM32 the drivers' queues mask interrupts briefly
(from the source code, not measured).
";

const COMMANDS: &str = "
## Commands

Instructions that a command adds to its tick, on the same board. The commands are those of a transaction that replaces PDCTRL_MOD
by PIDCTRL_MOD in the shipped scheme with two more SUM modules, without and with additional P controllers. A tick executes one
command at most; the tick's bound and the limit for modules reserve half of a board's time for commands. `dimsart connect` checks
a scheme in one tick and commits it in a later one. The cost of a commit depends mainly on the number of modules: the engine
matches kept modules and their words. Switching the scheme changes one word. In the last row a SUM module writes an invalid
position, and all P controllers are isolated with it; isolated modules take no time.
";

const CYCLES: &str = "
## Cycles of a tick

From `dimsart/examples/cycle_figures.rs`: cycles of a model based on Arm's tables ([cycles.md](../cycles.md)) for the memory that the
board runs from, not measured on silicon. The emulated processor runs every tick of the shipped experiment, with jitter and loss,
and of random inputs; the results equal the host's bit by bit. The bound holds for all measurements and packets.
";

const BY_HAND: &str = "
## Against a function by hand

The master's tick compared with Table 1 written by hand as one function (`dimsart-core/by-hand/src/lib.rs`), in the same image and
with the same optimisation, over the shipped experiment with jitter and loss. Commands and packets are equal bit by bit. The
function has a fixed scheme, constant parameters and a frame of three positions; the board's frame has 9 words, including the
board's own state.
";

/// Builds every image, measures it and writes the page.
pub(crate) fn run() -> Outcome {
    setup::emulator()?;
    let toolchain = Toolchain::set_up()?;
    let images = build_all(toolchain, Images::All)?;
    let bounds = stack::bounds(&images)?;
    let summary = page(&toolchain.version()?, &images, &bounds) + KINDS;
    let mut details = "# Firmware: time of ticks and commands\n".to_owned();
    for (head, name, foot) in [
        (TIME, "firmware_figures", JITTER),
        (COMMANDS, "command_figures", ""),
        (CYCLES, "cycle_figures", ""),
        (BY_HAND, "by_hand_figures", ""),
    ] {
        details += &format!("{head}\n{}{foot}", example(name, "release", &[])?);
    }
    println!("{summary}\n{details}");
    measured::write("firmware", &summary, &details)?;
    hold(&images)?;
    stack::hold(&images, &bounds)
}

fn page(rustc: &str, images: &[Image], bounds: &[StackBound]) -> String {
    let rows: Vec<[String; 7]> = images.iter().zip(bounds).map(row).collect();
    let head = ["Image", "Flash, bytes", "Limit", "RAM, bytes", "Limit", "Stack, bytes", "Limit"];
    format!("{HEAD}\nCompiler: rustc {rustc}\n\n## Memory\n{}", table(head, &rows))
}

fn row((image, bound): (&Image, &StackBound)) -> [String; 7] {
    let limit =
        |of: fn(Size) -> u64| image.budget.map_or_else(|| "-".to_owned(), |budget| of(budget).to_string());
    let (flash, ram) = (image.size.flash.to_string(), image.size.ram.to_string());
    let (stack, available) = (bound.bytes.to_string(), bound.available_bytes.to_string());
    let [max_flash, max_ram] = [limit(|size| size.flash), limit(|size| size.ram)];
    [image.name.clone(), flash, max_flash, ram, max_ram, stack, available]
}
