//! Check of the functions that a function can reach.

use std::collections::BTreeSet;

use crate::declarations::{CallDeclarations, NamePattern};
use crate::graph::{Graph, GraphError};
use crate::image::Image;

/// The reached code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReachableCode {
    /// Names of the reached functions, in order of their addresses.
    pub functions: Vec<String>,
    /// Start addresses of these functions and of their outlined pieces.
    pub addresses: BTreeSet<u32>,
    /// Number of square root instructions.
    pub square_roots: usize,
}

/// Reason that the check failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReachError {
    /// Calls cannot be followed.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// The image has no start function.
    #[error("the image has no function '{name}'")]
    NoRoot {
        /// Name of the function.
        name: String,
    },
    /// A forbidden function is reached.
    #[error(
        "the program can call the forbidden function {}:\n    {}",
        .path.last().map_or("", String::as_str),
        .path.join("\n    ")
    )]
    Forbidden {
        /// Call locations from the start; the last entry is the function.
        path: Vec<String>,
    },
    /// A trapping instruction is reached.
    #[error("the program can reach a trapping instruction:\n    {}", .path.join("\n    "))]
    Trap {
        /// Call locations from the start; the last entry is the trap.
        path: Vec<String>,
    },
}

/// Follows all calls of the function `root`. Returns the reached code if all reached functions have one of
/// the `allowed` names.
///
/// # Errors
/// [`ReachError`], with the path to the first violation.
pub fn check_reachable(
    image: &Image,
    declared: &CallDeclarations,
    root: &str,
    allowed: &[NamePattern],
) -> Result<ReachableCode, ReachError> {
    let graph = Graph::new(image, declared);
    let begin = image.function(root).ok_or_else(|| ReachError::NoRoot { name: root.to_owned() })?.address;
    let reached = graph.reached(begin)?;
    // The calls on the path, and the last function.
    let path = |last: u32| {
        let mut path = vec![image.location(last)];
        let mut function = last;
        while let Some((caller, edge)) = reached.get(&function).copied().flatten() {
            path.push(image.location(edge.at));
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
            path.push(image.location(*trap));
            return Err(ReachError::Trap { path });
        }
        square_roots += frame.square_roots.len();
        functions.push(image.location(address));
        addresses.extend(frame.outlined_pieces.iter().copied().chain([address]));
    }
    Ok(ReachableCode { functions, addresses, square_roots })
}
