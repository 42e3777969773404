//! `cargo xtask write figures`: memory and time of the firmware, to `docs/firmware.md`.

use std::fmt::Write;

use crate::boards::{Image, Images, Size, build_all, hold};
use crate::example::example;
use crate::shell::{Outcome, command, top};
use crate::table::table;
use crate::toolchain::Toolchain;
use crate::{setup, stack};

const HEAD: &str = "\
# What the firmware takes

Written by `cargo xtask write figures`; this and `cargo xtask test` fail when an image is over its budget in
`boards/budgets/`.
Flash is code, constants and the initial values of variables; RAM is all variables, the Data Base with its modules'
parameters and state among them, without the stack and without the code that is copied to CCM SRAM. The emulated board
and variants of others have room and no budget.
The Data Base of nucleo-g474re, 3072 words, holds all 16 kinds of modules at 7 degrees of freedom beside a recorder of
250 rows (`dimsart-core/tests/behaviour/capacity.rs`).
";

const KINDS: &str = "
## Module kinds of an image

`cargo board nucleo-g474re,filters` builds an image with the shipped groups of modules and `filters`. With
`--no-default-features` the image has the named groups only: `cargo board b-g431b-esc1,control,teleoperation
--no-default-features` is what `cargo xtask flash b-g431b-esc1` builds. `dimsart modules` shows the group of each kind. A
project's own kinds are always added (`firmware/src/modules.rs`).
";

const STACK: &str = "
## Stack

Every priority at its deepest on top of the others, with what interrupts save: by following all calls in the machine
code. `cargo xtask step stack` shows the calls. At most is what the memory map leaves for it; `cargo xtask test` fails when
that is too little.
";

const TIME: &str = "
## Time on the emulated board

One side of Table 1 runs as firmware, everything else on the host, for 100 000 ticks in lockstep with a round trip
of sensors and actuators each. Host and emulator share one processor: they hand over twice in every tick. Ticks per
second depend on the machine and on what else it does; wanted are 10 000. Instructions are those from reading the
sensors to commanding the actuators, counted by the emulator's time; they depend on source and compiler alone. A
request or noise is put on the command line in every tick; 100 times the line's rate is 100 times what 115 200 baud
carry.
";

const JITTER: &str = "
Ticks from the timer's interrupt begin exactly a period apart in instruction-count time: jitter 0 while nobody talks
to the board, and 0 while requests come: what is handed over below the tick masks no interrupt.
`dimsart/tests/emulated/timer_tick.rs` holds both to 0. On an STM32 the drivers' own queues mask interrupts for a
moment (from reading, not measured).
";

const COMMANDS: &str = "
## Commands

What a command adds to the tick that carries it out, on the same board, in instructions: the commands of a transaction
that puts PIDCTRL_MOD in the place of PDCTRL_MOD, in the shipped scheme with two SUM modules more, alone and beside P
controllers. A tick carries out one command at most. A tick's bound and the limit that modules are held to leave commands
the other half of a board's time. `dimsart connect` has a scheme checked in one tick and committed in a later one. Most of
a commit's cost hangs on the number of modules: which of them go on, and where their words are. The change itself is of
one word. In the last row a SUM module writes what is no position, and all P controllers are cut out with it: what is not
called any more takes no time.
";

const CYCLES: &str = "
## Cycles of a tick

By `dimsart/examples/cycle_figures.rs`: cycles of a model that is built on Arm's tables ([cycles.md](cycles.md)), from
the memory that the board runs from, never of silicon. Each tick of the shipped experiment, with jitter and loss, and of
random inputs is run in the emulated processor and is the host's bit by bit; the bound holds for anything that is
measured and comes in.
";

const BY_HAND: &str = "
## Against a function by hand

What the master's tick takes beside Table 1 written by hand as one function (`dimsart-core/by-hand/src/lib.rs`), in the
same image and optimised as the core is: over the shipped experiment with jitter and loss, with the same commands and
packets bit by bit. The function has one scheme, parameters that are constants and a frame of three positions; the
board's frame has what the board says of itself, too, 9 words in all.
";

/// Builds every image, measures and writes the pages.
pub(crate) fn run() -> Outcome {
    setup::emulator()?;
    let toolchain = Toolchain::set_up()?;
    let images = build_all(toolchain, Images::All)?;
    let bounds = stack::bounds(&images)?;
    let page = page(&images) + KINDS + STACK + &stack::summary(&images, &bounds);
    let page = page
        + TIME
        + "
" + &example("firmware_figures", "release", &[])?
        + JITTER
        + COMMANDS
        + "
" + &example("command_figures", "release", &[])?;
    let page = page
        + CYCLES
        + "
" + &example("cycle_figures", "release", &[])?
        + BY_HAND
        + "
" + &example("by_hand_figures", "release", &[])?;
    println!("{page}");
    let file = top().join("docs/firmware.md");
    std::fs::write(&file, page).map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    hold(&images)?;
    stack::hold(&images, &bounds)
}

fn page(images: &[Image]) -> String {
    let rustc = command("rustc", ["--version"]).output().ok();
    let rustc = rustc.and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let rows: Vec<[String; 5]> = images.iter().map(row).collect();
    let mut page = format!("{HEAD}\nCompiler: {}\n", rustc.trim());
    let head = ["Image", "Flash, bytes", "At most", "RAM, bytes", "At most"];
    let _ = write!(page, "\n## Memory\n{}", table(head, &rows));
    page
}

fn row(image: &Image) -> [String; 5] {
    let most =
        |of: fn(Size) -> u64| image.budget.map_or_else(|| "-".to_owned(), |budget| of(budget).to_string());
    let (flash, ram) = (image.size.flash.to_string(), image.size.ram.to_string());
    [image.name.clone(), flash, most(|size| size.flash), ram, most(|size| size.ram)]
}
