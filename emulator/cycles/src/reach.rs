//! What a function can reach, and what it must not.

use std::collections::BTreeSet;

use crate::declared::{Declared, Name};
use crate::graph::{Graph, GraphError};
use crate::image::Image;

/// What was looked through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reached {
    /// Names of the functions that are reached, in the order of their addresses.
    pub functions: Vec<String>,
    /// Where they and the pieces begin that the compiler has outlined of them.
    pub addresses: BTreeSet<u32>,
    /// Square roots that are taken by an instruction.
    pub square_roots: usize,
}

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReachError {
    /// Calls cannot be followed.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// There is nothing to start from.
    #[error("the image has no function '{name}'")]
    NoRoot {
        /// Which.
        name: String,
    },
    /// A function is reached that is not allowed.
    #[error("{} is reached:\n    {}", .path.last().map_or("", String::as_str), .path.join("\n    "))]
    Forbidden {
        /// Where the calls are, from the begin on; the function is the last one.
        path: Vec<String>,
    },
    /// An instruction that traps is reached.
    #[error("a trap is reached:\n    {}", .path.join("\n    "))]
    Trap {
        /// Where the calls are, from the begin on; the trap is the last one.
        path: Vec<String>,
    },
}

/// Follows all calls of the function `root` and says what is reached, if all of it has one of the `allowed` names.
///
/// # Errors
/// [`ReachError`], with the path to the first thing that is wrong.
pub fn only(image: &Image, declared: &Declared, root: &str, allowed: &[Name]) -> Result<Reached, ReachError> {
    let graph = Graph::new(image, declared);
    let begin = image.function(root).ok_or_else(|| ReachError::NoRoot { name: root.to_owned() })?.address;
    let reached = graph.reached(begin)?;
    // The calls on the way, and what they lead to.
    let path = |last: u32| {
        let mut path = vec![image.place(last)];
        let mut function = last;
        while let Some((caller, edge)) = reached.get(&function).copied().flatten() {
            path.push(image.place(edge.at));
            function = caller;
        }
        path.reverse();
        path
    };
    let mut functions = Vec::new();
    let mut addresses = BTreeSet::new();
    let mut square_roots = 0;
    for &address in reached.keys() {
        let is_allowed = address == begin || allowed.iter().any(|name| graph.has_name(address, name));
        if !is_allowed {
            return Err(ReachError::Forbidden { path: path(address) });
        }
        let frame = graph.frames.of(address).map_err(GraphError::from)?;
        if let Some(trap) = frame.traps.first() {
            let mut path = path(address);
            path.push(image.place(*trap));
            return Err(ReachError::Trap { path });
        }
        square_roots += frame.square_roots.len();
        functions.push(image.place(address));
        addresses.extend(frame.pieces.iter().copied().chain([address]));
    }
    Ok(Reached { functions, addresses, square_roots })
}
