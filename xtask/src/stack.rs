//! `cargo xtask step stack`: bounds the stack of every image by its machine code.

use boards::BOARDS;
use cycles::frame::Frames;
use cycles::stack::{self, Level, StackBound};

use crate::boards::{Image, Images, PROFILE, build_all, declared, features, read_image};
use crate::shell::{Outcome, run as start, target};
use crate::table::table;
use crate::toolchain::{TARGET, Toolchain};

/// Builds every image and shows its stack.
pub(crate) fn run() -> Outcome {
    let toolchain = Toolchain::set_up()?;
    let images = build_all(toolchain, Images::All)?;
    let bounds = bounds(&images)?;
    for (image, bound) in images.iter().zip(&bounds) {
        println!("{}", in_full(&image.name, bound));
    }
    println!("{}", summary(&images, &bounds));
    cross_check(toolchain)?;
    hold(&images, &bounds)
}

/// Returns the stack bound of each image.
pub(crate) fn bounds(images: &[Image]) -> Result<Vec<StackBound>, String> {
    let declared = declared()?;
    let bound = |image: &Image| {
        let bound = stack::bound(&image.read()?, &declared, image.board.tooling.interrupts);
        bound.map_err(|error| format!("{}: cannot bound the stack: {error}", image.name))
    };
    images.iter().map(bound).collect()
}

/// Checks images against the space that the linker leaves for their stacks.
pub(crate) fn hold(images: &[Image], bounds: &[StackBound]) -> Outcome {
    let over: Vec<String> = images
        .iter()
        .zip(bounds)
        .filter(|(_, bound)| bound.bytes > bound.available_bytes)
        .map(|(image, bound)| {
            let StackBound { bytes, available_bytes, .. } = bound;
            format!("{} takes up to {bytes} bytes of stack but has {available_bytes}", image.name)
        })
        .collect();
    if over.is_empty() { Ok(()) } else { Err(over.join("\n") + ": `cargo xtask step stack` shows the calls") }
}

/// Checks the stack frames computed from an image's code against the compiler's.
pub(crate) fn cross_check(toolchain: Toolchain) -> Outcome {
    let board = BOARDS.iter().find(|board| board.tooling.chip.is_some()).ok_or("no board with a chip")?;
    let folder = target().join("stack-sizes");
    let arguments = ["--package", "firmware", "--profile", PROFILE];
    let flags = format!("target.{TARGET}.rustflags=['-Zemit-stack-sizes']");
    let mut build = toolchain.cargo("build", &arguments);
    // The compiler's option is unstable.
    build
        .args(features(board, None))
        .args(["--config", &flags])
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_TARGET_DIR", &folder);
    start(&mut build)?;
    let image = read_image(&folder.join(TARGET).join("firmware/firmware"))?;
    let frames = Frames::new(&image);
    let mut compared = 0;
    for (&function, &bytes) in
        image.stack_sizes.iter().filter(|(function, _)| !frames.is_outlined(**function))
    {
        let frame = frames.of(function).map_err(|error| error.to_string())?;
        if frame.own_bytes != bytes {
            let (name, own) = (image.location(function), frame.own_bytes);
            return Err(format!(
                "{name} has a stack frame of {own} bytes by its code, {bytes} by the compiler"
            ));
        }
        compared += 1;
    }
    if compared == 0 {
        return Err("the compiler emitted no stack frame sizes (.stack_sizes)".into());
    }
    println!("{}: {compared} stack frames equal those of the compiler", board.name);
    Ok(())
}

/// Returns a table with a row for each image.
pub(crate) fn summary(images: &[Image], bounds: &[StackBound]) -> String {
    let row = |(image, bound): (&Image, &StackBound)| {
        [image.name.clone(), bound.bytes.to_string(), bound.available_bytes.to_string()]
    };
    let rows: Vec<[String; 3]> = images.iter().zip(bounds).map(row).collect();
    table(["Image", "Stack, bytes", "Limit"], &rows)
}

/// Returns every priority with its deepest calls.
fn in_full(name: &str, bound: &StackBound) -> String {
    let mut lines = vec![format!("{name}: {} of {} bytes", bound.bytes, bound.available_bytes)];
    for Level { priority, handler, context_bytes, bytes, restarts_stack, chain } in &bound.levels {
        let level =
            priority.map_or_else(|| "the program".to_owned(), |priority| format!("priority {priority}"));
        let place = if *restarts_stack { " on a separate stack" } else { "" };
        lines.push(format!("  {level}, {handler}: {context_bytes} saved, then {bytes}{place}"));
        lines.extend(chain.iter().map(|(function, bytes)| format!("    {bytes:>6} {function}")));
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::{BOARDS, Image, StackBound, hold, in_full};
    use crate::boards::Size;
    use cycles::stack::Level;

    #[test]
    fn an_image_with_too_little_stack_is_named_with_both_sizes() {
        let (board, size) = (BOARDS.first().unwrap(), Size { flash: 0, ram: 0 });
        let image = [Image { name: "deep".into(), board, size, budget: None }];
        let bound = |bytes| [StackBound { levels: Vec::new(), bytes, available_bytes: 100 }];
        assert_eq!(hold(&image, &bound(100)), Ok(()));
        let message = hold(&image, &bound(101)).unwrap_err();
        assert!(message.starts_with("deep takes up to 101 bytes of stack but has 100"), "{message}");
    }

    #[test]
    fn every_priority_is_shown_with_its_calls() {
        let level = Level {
            priority: Some(2),
            handler: "TICK".into(),
            context_bytes: 108,
            bytes: 48,
            restarts_stack: false,
            chain: vec![("TICK".into(), 16), ("tick".into(), 32)],
        };
        let shown = in_full("board", &StackBound { levels: vec![level], bytes: 156, available_bytes: 200 });
        let expected = "board: 156 of 200 bytes\n  priority 2, TICK: 108 saved, then 48\n";
        assert_eq!(shown, format!("{expected}        16 TICK\n        32 tick\n"));
    }
}
